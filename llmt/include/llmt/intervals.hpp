/// \file
/// Prediction intervals from held-out residuals.
///
///     const llmt::Bounds bounds = result.intervals.predict(new_inputs, 0.9);
///     const double lowest = bounds.lower(0, 0);  // of the first row; bounds.upper likewise
#pragma once

#include <Eigen/Core>
#include <string>
#include <vector>

#include "llmt/abi.hpp"
#include "llmt/model.hpp"

namespace llmt {

/// Lower and upper ends, rows x outputs.
struct Bounds {
  Eigen::MatrixXd lower;
  Eigen::MatrixXd upper;
  /// Rows that lack an input for which there were too few held-out rows like them for the level. Their intervals are
  /// likely too narrow, see Intervals.
  std::vector<Eigen::Index> uncalibrated = {};
};

/// CV+ prediction intervals (Barber, Candes, Ramdas & Tibshirani 2021): with R_i the absolute residual of row i under
/// the model f_k(i) that was fitted without the row's fold, and n rows,
///   lower = floor(a (n + 1))-th smallest of f_k(i)(x) - R_i,   upper = ceil((1 - a) (n + 1))-th smallest of f_k(i)(x)
///   + R_i.
/// The guarantee is a coverage of 1 - 2 a for exchangeable rows; in practice it is near 1 - a, the level that is asked
/// for. With a single fold this is split conformal prediction, whose guarantee is 1 - a. Weights of rows are not used.
///
/// Rows that lack an input which the models use (an empty cell, an unknown category) err more than complete rows. The
/// two kinds of rows are therefore calibrated apart: n and R_i are those of the held-out rows of the kind of x. If
/// there are too few of the kind for the level, the interval is that of all held-out rows, as far as needed widened to
/// the largest residuals of the kind. If there is none of the kind, it is that of all held-out rows.
///
/// Within a kind the width depends on the residuals of all its rows, not on the residuals near x. Where the noise
/// differs between regions, or the loss between missing inputs, the coverage holds on average, not in each of them.
class Intervals {
 public:
  /// No folds; predict() throws.
  Intervals() = default;

  /// One model and one matrix of absolute residuals (rows x outputs) for each fold. `incomplete`: the same of the rows
  /// that lack an input; empty: there are none. Throws std::invalid_argument if the numbers of folds, inputs, outputs
  /// or levels differ, or a residual is negative or not finite.
  Intervals(std::vector<Model> models, std::vector<Eigen::MatrixXd> residuals,
            std::vector<Eigen::MatrixXd> incomplete = {});

  bool empty() const { return models_.empty(); }
  const std::vector<Model>& models() const { return models_; }
  const std::vector<Eigen::MatrixXd>& residuals() const { return residuals_; }  ///< each column ascending
  /// Residuals of the rows that lack an input; one matrix for each fold.
  const std::vector<Eigen::MatrixXd>& incomplete_residuals() const { return incomplete_; }

  /// Intervals that contain the fraction `level` (0.9, for example) of the outputs. Throws std::invalid_argument if
  /// there are no folds, the level is not between 0 and 1, or there are too few held-out rows of both kinds together
  /// for it, and as Model::predict().
  Bounds predict(const Eigen::Ref<const Eigen::MatrixXd>& inputs, double level, int max_threads = 0) const;

 private:
  std::vector<Model> models_;
  std::vector<Eigen::MatrixXd> residuals_;
  std::vector<Eigen::MatrixXd> incomplete_;
};

/// A model and the intervals that were made with it.
struct ModelWithIntervals {
  Model model;
  Intervals intervals;  ///< may be empty
};

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
