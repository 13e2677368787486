/// \file
/// The fitted model: a partition of the input space, an affine local model in every leaf, and validity functions that
/// say how much each leaf counts at a point. docs/algorithms/model.md has the equations.
///
///     llmt::save(model.named({"outdoor_C", "flow_C"}, {"cop"}), "heat_pump.json");
///     const llmt::Model again = llmt::load("heat_pump.json");
///     const Eigen::MatrixXd predicted = again.predict(new_inputs);
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <memory>
#include <string>
#include <vector>

#include "llmt/abi.hpp"
#include "llmt/partition.hpp"

namespace llmt {

/// On which side of an oblique split a leaf lies.
struct ObliqueSide {
  int node = 0;  ///< index into Partition::nodes
  bool left = true;
};

/// A leaf as a person reads it: where it holds and what it says there.
struct Leaf {
  int node = 0;              ///< index into Partition::nodes
  Eigen::Index samples = 0;  ///< training rows
  int rank = 0;              ///< as Node::rank
  Eigen::VectorXd low;       ///< box, one per model input: low < x <= high; -infinity where open
  Eigen::VectorXd high;      ///< +infinity where open
  /// The sides of oblique splits on which the leaf lies, from the root down.
  std::vector<ObliqueSide> sides = {};
  std::vector<std::vector<int>>
      levels;            ///< one per model input: levels that belong to the leaf; empty: all, or numeric
  Eigen::VectorXd rmse;  ///< sqrt(rss / samples) over the training rows, one per output of the partition
  /// f = intercept + slope . regressors, one intercept per output of the partition. Numbers are 0 as regressors where
  /// the input is 0, but a product is 0 where one of its factors is at its mean.
  Eigen::VectorXd intercept;
  Eigen::MatrixXd slope;  ///< outputs of the partition x regressors
};

/// How far a query lies from the training rows.
struct Extrapolation {
  /// The largest excess over the training extent, as a multiple of that input's training range; 0 inside, infinity
  /// where an input that never varied differs.
  double distance = 0.0;
  /// Validity-weighted mean of a' (sum validity a a')^-1 a over the leaves that reach the point, a = [1, deviations]:
  /// the leverage of the point on its own local models. Training rows have about (coefficients / rows of the leaf); 1
  /// and more means that the local model is carried beyond its rows. The largest over the partitions.
  double leverage = 0.0;
};

class Evaluator;

/// A fitted local linear model tree: immutable, always complete, safe to use from many threads.
///
/// For output o, served by partition P, at input x:
///   y_o(x) = sum_i Phi_i(x) f_i(x),  f_i(x) = value_o + slope_o . d(x)
/// over the leaves of P, with Phi their validities (see ValidityKind) and d the deviations of the regressors from their
/// centres. The boxes cover the whole space.
///
/// Three guards keep local models where their rows were. Where x leaves the range of a regressor that the leaf's rows
/// covered, the slope of the leaf gives way to that of its parent, beyond the parent's range to that of its parent, up
/// to the root:
///   f_i(x) = value_i + slope_i . c_i + sum over ancestors a of slope_a . (c_a - c_below a)
/// with c the deviations held to the node's range. What the prediction adds to the root's model is then held to the
/// range of the root's residuals in training, widened by a tenth of it on both sides, and at last, beyond the training
/// extent, outer_slope . (d - c_root) is added: the root's slopes as far as the first leaves agree on them. Every hold
/// is rounded off over a tenth of its range, so that derivatives stay continuous. Affine data are reproduced
/// everywhere; data that are quadratic in the inputs, by a model with products, within the training extent. Beyond it
/// products stay where their factors leave it, and the linear parts go on.
///
/// A fourth guard is there where held-out rows asked for it: the value is clamped to Partition::output_range. It is
/// constant outside of that range, and its derivative jumps where it enters the range.
///
/// A missing value (NaN) takes the share that was learned at each split on its input, and in a local model the mean of
/// the leaf's rows.
class Model {
 public:
  /// Throws std::invalid_argument naming the part that does not fit: no partition or node, an output served twice or
  /// not at all, children out of order, an index out of range, a shape, a number that is not finite, two columns or
  /// levels of one name. Or that does not go with the training extent, which InputColumn and OutputColumn give: a
  /// centre, mean or range of a regressor outside of it, more rows in a node than in its parent, a rank above the
  /// number of coefficients, a residual_range that the outputs and the root's model cannot leave, an output_range
  /// outside of the output's.
  Model(std::vector<InputColumn> inputs, std::vector<OutputColumn> outputs, std::vector<Regressor> regressors,
        std::vector<Partition> partitions);

  Eigen::Index num_inputs() const { return std::ssize(inputs_); }
  Eigen::Index num_outputs() const { return std::ssize(outputs_); }
  const std::vector<InputColumn>& inputs() const { return inputs_; }
  const std::vector<OutputColumn>& outputs() const { return outputs_; }
  const std::vector<Regressor>& regressors() const { return regressors_; }  ///< columns of the local models
  const std::vector<Partition>& partitions() const { return partitions_; }

  /// Predictions, rows x outputs, for `inputs` (rows x inputs; NaN: missing; categorical inputs as positions in
  /// InputColumn::levels, others than those are unknown categories, or as InputColumn::codes). Throws
  /// std::invalid_argument if the number of columns differs or a value is infinite. Same bytes at any number of threads
  /// (0: all), and for a row alone or among others.
  Eigen::MatrixXd predict(const Eigen::Ref<const Eigen::MatrixXd>& inputs, int max_threads = 0) const;

  /// Derivatives of the prediction at one point, outputs x inputs, in closed form. Zero for categorical inputs, and of
  /// an output that is clamped there; at a jump of a crisp model that of the side the point belongs to. Throws as
  /// predict(), and if a value is missing.
  Eigen::MatrixXd jacobian(const Eigen::Ref<const Eigen::VectorXd>& point) const;

  /// Which leaf holds each row, rows x partitions: positions in leaves(partition); where validities overlap, the leaf
  /// of the largest. Throws as predict().
  Eigen::MatrixXi leaf_of(const Eigen::Ref<const Eigen::MatrixXd>& inputs, int max_threads = 0) const;

  /// Validities of the leaves of a partition at each row, rows x leaves as in leaves(partition). Throws as
  /// predict(), and if there is no such partition.
  Eigen::MatrixXd validities(const Eigen::Ref<const Eigen::MatrixXd>& inputs, Eigen::Index partition,
                             int max_threads = 0) const;

  /// How far each row lies from the training rows. Missing values do not count. Throws as predict().
  std::vector<Extrapolation> extrapolation(const Eigen::Ref<const Eigen::MatrixXd>& inputs, int max_threads = 0) const;

  /// Standard errors of the local models' means, rows x outputs: the square root of the validity-weighted mean of
  /// s_i^2 a' (sum validity a a')^-1 a, s_i^2 = (rss_i + 10 s^2) / (samples_i - rank_i + 10) drawn towards the residual
  /// variance s^2 of all rows. They take the tree as given and the noise as equal within a leaf, say nothing of bias
  /// and are too small; for intervals that hold what they promise see Intervals. Infinite where the square of a
  /// deviation is beyond doubles. Throws as predict().
  Eigen::MatrixXd standard_errors(const Eigen::Ref<const Eigen::MatrixXd>& inputs, int max_threads = 0) const;

  /// The leaves of a partition from left to right in the tree. Throws std::invalid_argument if there is no such
  /// partition, std::runtime_error if the boxes list more than 10^8 levels and sides of oblique splits.
  std::vector<Leaf> leaves(Eigen::Index partition) const;

  /// The model as it was when each partition had at most `max_leaves` leaves: inner nodes' local models, not fitted
  /// anew. Throws std::invalid_argument if max_leaves < 1.
  Model prefix(Eigen::Index max_leaves) const;

  /// The same model with other names of columns and, if there are any, of the levels of each input (empty for numbers
  /// and codes).
  /// Throws std::invalid_argument if their numbers differ, or two inputs, outputs or levels of an input have one name.
  Model named(const std::vector<std::string>& inputs, const std::vector<std::string>& outputs,
              const std::vector<std::vector<std::string>>& levels = {}) const;

 private:
  std::vector<InputColumn> inputs_;
  std::vector<OutputColumn> outputs_;
  std::vector<Regressor> regressors_;
  std::vector<Partition> partitions_;
  std::shared_ptr<const std::vector<Evaluator>> evaluators_;  // one per partition
};

/// True for each input that a split or the local model of a leaf uses.
std::vector<bool> used_inputs(const Model& model);

/// The model as JSON text; docs/file-formats.md describes it. Format version 2, or 3 if there is an output_range, which
/// readers of version 2 do not know, or 4 if an input has codes, which those of version 3 do not. Numbers are written
/// so that they read back exactly. Throws std::runtime_error for a model that from_json() or load() would refuse
/// because of its size: more than 16 777 216 values, containers counted, or 256 MiB.
std::string to_json(const Model& model);

/// Reads what to_json() wrote. The text may be of any origin. Throws std::runtime_error, starting with `name` and the
/// JSON pointer to the place, that says which member is missing, has the wrong type or shape, or holds a number that
/// Model does not accept; for another format or version; and for JSON that is nested deeper than 32 levels, has a
/// number beyond the range of a double or more than 16 777 216 values.
Model from_json(const std::string& text, const std::string& name = "model");

/// Writes to_json() to a file, through a temporary file beside it that is renamed at the end: a failed write leaves the
/// old file as it was. Throws std::runtime_error naming the path.
void save(const Model& model, const std::string& path);

/// Reads a file that save() wrote, without the intervals that it may hold. Throws std::runtime_error as from_json(),
/// starting with the path, and for more than 256 MiB.
Model load(const std::string& path);

}  // namespace llmt
