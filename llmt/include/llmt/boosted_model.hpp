/// \file
/// A boosted model: the sum of many small local linear model trees. docs/algorithms/boosting.md has the equations.
///
///     const llmt::BoostedModel model = llmt::fit_boosted({inputs, outputs}).model;
///     const Eigen::MatrixXd predicted = model.predict(new_inputs);
#pragma once

#include <Eigen/Core>
#include <string>
#include <vector>

#include "llmt/abi.hpp"
#include "llmt/boosted_sum.hpp"
#include "llmt/bounds.hpp"
#include "llmt/gaps.hpp"
#include "llmt/partition.hpp"
#include "llmt/training_record.hpp"

namespace llmt {

/// A sum of trees for each output: immutable, safe to use from many threads.
class BoostedModel {
 public:
  /// Throws std::invalid_argument naming the part that does not fit: another number of sums than outputs, an index out
  /// of range, a tree that is none, a number that is not finite, two columns of one name, and as check_record().
  BoostedModel(std::vector<InputColumn> inputs, std::vector<OutputColumn> outputs, std::vector<double> deviations,
               std::vector<BoostedSum> sums, std::vector<Gap> gaps = {}, TrainingRecord record = {});

  Eigen::Index num_inputs() const { return std::ssize(inputs_); }
  Eigen::Index num_outputs() const { return std::ssize(outputs_); }
  const std::vector<InputColumn>& inputs() const { return inputs_; }
  const std::vector<OutputColumn>& outputs() const { return outputs_; }
  const std::vector<double>& deviations() const { return deviations_; }  ///< by which inputs are divided
  const std::vector<BoostedSum>& sums() const { return sums_; }          ///< one an output
  const std::vector<Gap>& gaps() const { return gaps_; }                 ///< of the training rows, for intervals
  const TrainingRecord& record() const { return record_; }               ///< of the training rows; may be empty

  /// Predictions, rows x outputs, for `inputs` (rows x inputs; NaN: missing). Throws std::invalid_argument if the
  /// number of columns differs or a value is infinite. Same bytes at any number of threads (0: all), and for a row
  /// alone or among others.
  Eigen::MatrixXd predict(const Eigen::Ref<const Eigen::MatrixXd>& inputs, int max_threads = 0) const;

  /// Whether every sum has residuals of held-out rows.
  bool has_intervals() const;

  /// Prediction intervals that hold the fraction `level` (0.9, for example) of the outputs, f(x) the prediction, s_p
  /// the spread of part p of the held-out rows and S_i their n scaled residuals:
  ///   lower, upper = f(x) -+ the floor((1 - level) (n + 1))-th largest of s_p(i)(x) S_i,
  /// as in normalised split conformal prediction (Lei et al. 2018). They are about right: the trees of all rows are a
  /// little better than those of the residuals, whose rows decided where these stopped. Throws std::invalid_argument if
  /// there are no residuals, too few for the level, or if the level is not between 0 and 1, and as predict() and
  /// check_row_weights(). `weights`: as of Intervals::predict().
  Bounds intervals(const Eigen::Ref<const Eigen::MatrixXd>& inputs, double level, int max_threads = 0,
                   const Eigen::VectorXd& weights = {}) const;

  /// The same for several levels.
  std::vector<Bounds> intervals(const Eigen::Ref<const Eigen::MatrixXd>& inputs, const std::vector<double>& levels,
                                int max_threads = 0, const Eigen::VectorXd& weights = {}) const;

 private:
  std::vector<InputColumn> inputs_;
  std::vector<OutputColumn> outputs_;
  std::vector<double> deviations_;
  std::vector<BoostedSum> sums_;
  std::vector<Gap> gaps_;
  TrainingRecord record_;
};

/// Quantiles of each output, rows x probabilities; see quantiles_from(). Throws std::invalid_argument as
/// levels_of_quantiles() and BoostedModel::intervals().
std::vector<Eigen::MatrixXd> quantiles(const BoostedModel& model, const Eigen::Ref<const Eigen::MatrixXd>& inputs,
                                       const std::vector<double>& probabilities, int max_threads = 0,
                                       const Eigen::VectorXd& weights = {});

/// How large a model is, over all outputs.
struct BoostedSize {
  Eigen::Index trees = 0;
  Eigen::Index leaves = 0;
  Eigen::Index parameters = 0;  ///< constants and slopes of leaves, thresholds and half widths of splits
};
BoostedSize size_of(const BoostedModel& model);

/// Of each input of a model, whether a split or a leaf uses it.
std::vector<bool> used_inputs(const BoostedModel& model);

/// How far each row lies outside of the training rows: the largest excess over the training extent, as a multiple of
/// that input's training range, see Extrapolation. 0 inside. Throws as BoostedModel::predict().
std::vector<double> distance_outside(const BoostedModel& model, const Eigen::Ref<const Eigen::MatrixXd>& inputs);

/// Rows, ascending, that lack an input which the model uses: a number is missing, or a category is unknown, see
/// InputColumn::levels. Their intervals are calibrated with those of all rows, and are likely too narrow. Throws as
/// BoostedModel::predict().
std::vector<Eigen::Index> incomplete_rows(const BoostedModel& model, const Eigen::Ref<const Eigen::MatrixXd>& inputs);

/// The model as JSON text; docs/file-formats.md describes it. Numbers are written so that they read back exactly.
/// Throws std::runtime_error for a model that load_boosted() would refuse because of its size.
std::string to_json(const BoostedModel& model);

/// Reads what to_json() wrote; the text may be of any origin. Throws std::runtime_error as from_json().
BoostedModel boosted_from_json(const std::string& text, const std::string& name = "model");

/// Writes to_json() to a file as save() of a Model does. Throws std::runtime_error naming the path.
void save(const BoostedModel& model, const std::string& path);

/// Reads a file that save() wrote. Throws std::runtime_error as boosted_from_json(), and for more than 256 MiB.
BoostedModel load_boosted(const std::string& path);

}  // namespace llmt
