/// \file
/// Prediction intervals from held-out residuals.
///
///     const llmt::Bounds bounds = result.intervals.predict(new_inputs, 0.9);
///     const double lowest = bounds.lower(0, 0);  // of the first row; bounds.upper likewise
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <string>
#include <vector>

#include "llmt/abi.hpp"
#include "llmt/bounds.hpp"
#include "llmt/gaps.hpp"
#include "llmt/model.hpp"
#include "llmt/spread.hpp"
#include "llmt/training_record.hpp"

namespace llmt {

/// Held-out rows with one model and one spread: those of a fold, or of a part of the only fold.
struct HeldOutPart {
  std::size_t model = 0;       ///< which of Intervals::models() was fitted without the rows
  Eigen::MatrixXd residuals;   ///< rows x outputs: absolute residuals, each divided by the spread at its row; ascending
  Eigen::MatrixXd incomplete;  ///< the same of the rows that lack an input
  std::vector<Spread> spreads = {};  ///< one an output, learnt from the other parts; empty: 1 everywhere
  /// One an output: (I.3) of docs/algorithms/intervals.md, by how much the folds' models usually disagree, as a part of
  /// the spread. Empty: by nothing, as a single model.
  std::vector<double> disagreement = {};
};

/// Normalised CV+ prediction intervals (Barber, Candes, Ramdas & Tibshirani 2021; Lei et al. 2018): with f_k(i) the
/// model that was fitted without the fold of row i, s_k(i) the spread of errors as the other folds' held-out rows tell
/// it, S_i = |y_i - f_k(i)(x_i)| / s_k(i)(x_i), n rows and a = 1 - level,
///   lower = floor(a (n + 1))-th smallest of f_k(i)(x) - s_k(i)(x) S_i,
///   upper = floor(a (n + 1))-th largest of f_k(i)(x) + s_k(i)(x) S_i.
/// So the width follows the size of the errors near x. The guarantee is a coverage of 1 - 2 a for exchangeable rows; in
/// practice it is near 1 - a, the level that is asked for. A single fold is dealt to five parts, which share its model:
/// the spread of a part is learnt from the others. This is split conformal prediction. Below 100 held-out rows the
/// spread does not depend on x.
///
/// Weights of the training rows that are no counts say how well a row is known, so that a new row has a weight of its
/// own: sigma(x, w) of Spread. Without weights of the new rows the intervals are those of rows of the median weight of
/// the held-out rows.
///
/// Rows that lack an input which the models use (an empty cell, an unknown category) err more than complete rows. The
/// two kinds of rows are therefore calibrated apart: n and S_i are those of the held-out rows of the kind of x. If
/// there are too few of the kind for the level, the interval is that of all held-out rows, as far as needed widened to
/// the largest residuals of the kind. If there is none of the kind, it is that of all held-out rows.
///
/// In a Gap of the training rows s_k(x) is the 99th percentile of all S_i over the 90th times as large.
class Intervals {
 public:
  /// No folds; predict() throws.
  Intervals() = default;

  /// Models of the folds and the parts of their held-out rows. Throws std::invalid_argument if the numbers of inputs,
  /// outputs or levels of the models differ, a part names no model or has another number of outputs or spreads, a
  /// residual is negative or not finite, or as check_spread(), check_gaps() and check_record().
  Intervals(std::vector<Model> models, std::vector<HeldOutPart> parts, std::vector<Gap> gaps = {},
            TrainingRecord record = {});

  /// One model and one matrix of absolute residuals (rows x outputs) for each fold, without spreads. `incomplete`: the
  /// same of the rows that lack an input; empty: there are none.
  Intervals(std::vector<Model> models, std::vector<Eigen::MatrixXd> residuals,
            std::vector<Eigen::MatrixXd> incomplete = {});

  bool empty() const { return models_.empty(); }
  const std::vector<Model>& models() const { return models_; }
  const std::vector<HeldOutPart>& parts() const { return parts_; }  ///< in the order of their models
  const std::vector<Gap>& gaps() const { return gaps_; }            ///< of the training rows
  const TrainingRecord& record() const { return record_; }          ///< of the training rows; may be empty

  /// Intervals that contain the fraction `level` (0.9, for example) of the outputs. Throws std::invalid_argument if
  /// there are no folds, the level is not between 0 and 1, or there are too few held-out rows of both kinds together
  /// for it, and as Model::predict(). `weights`: of the rows, in the unit of those in training; empty: the median one.
  /// Throws std::invalid_argument as check_row_weights().
  Bounds predict(const Eigen::Ref<const Eigen::MatrixXd>& inputs, double level, int max_threads = 0,
                 const Eigen::VectorXd& weights = {}) const;

  /// The same for several levels, in the time of little more than one.
  std::vector<Bounds> predict(const Eigen::Ref<const Eigen::MatrixXd>& inputs, const std::vector<double>& levels,
                              int max_threads = 0, const Eigen::VectorXd& weights = {}) const;

 private:
  std::vector<Model> models_;
  std::vector<HeldOutPart> parts_;
  std::vector<Gap> gaps_;
  TrainingRecord record_;
};

/// A model and the intervals that were made with it.
struct ModelWithIntervals {
  Model model;
  Intervals intervals;  ///< may be empty
};

/// Quantiles of each output, rows x probabilities; see quantiles_from(). Throws std::invalid_argument as
/// levels_of_quantiles() and Intervals::predict().
std::vector<Eigen::MatrixXd> quantiles(const ModelWithIntervals& model, const Eigen::Ref<const Eigen::MatrixXd>& inputs,
                                       const std::vector<double>& probabilities, int max_threads = 0,
                                       const Eigen::VectorXd& weights = {});

/// The text of to_json(model) with the intervals as one member more, if there are any. Throws std::invalid_argument if
/// the intervals belong to another model: if a model of theirs has other numbers of inputs, outputs or levels, names
/// other than the model's or those that fit() gives (x1, x2, ... and y, or y1, y2, ...), or was trained on rows outside
/// of the model's training extent. Throws as to_json(model).
std::string to_json(const Model& model, const Intervals& intervals);

/// Reads what to_json() wrote, with the intervals, which are empty if there are none. `name` stands before the place in
/// errors. Throws std::runtime_error as from_json(), and if the intervals belong to another model.
ModelWithIntervals from_json_with_intervals(const std::string& text, const std::string& name = "model");

/// Writes to_json(model, intervals) to a file. Throws as to_json() and write_file().
void save(const Model& model, const Intervals& intervals, const std::string& path);

/// Reads a file that save() wrote. Throws std::runtime_error as from_json_with_intervals(), with the path, and as
/// read_file().
ModelWithIntervals load_with_intervals(const std::string& path);

}  // namespace llmt
