/// \file
/// A model of a system that moves: the next outputs from earlier outputs and inputs.
///
///     const llmt::DynamicModel model = llmt::load_dynamic("drive.json");
///     const llmt::Run run = llmt::simulate(model, inputs, outputs.topRows(model.memory()));
#pragma once

#include <Eigen/Core>
#include <limits>
#include <string>
#include <variant>
#include <vector>

#include "llmt/abi.hpp"
#include "llmt/boosted_model.hpp"
#include "llmt/lags.hpp"
#include "llmt/model.hpp"

namespace llmt {

/// An input or output of the system.
struct Signal {
  std::string name;
  std::string unit = {};
  double low = 0.0;   ///< smallest value in the records that the model was learned from
  double high = 0.0;  ///< largest value there
  /// Stops of an output: the system cannot leave them, as a tank that overflows or a slide at its end. Beyond them the
  /// output is held, while its speed goes on, see DynamicModel.
  double lower_stop = -std::numeric_limits<double>::infinity();
  double upper_stop = std::numeric_limits<double>::infinity();
};

/// p_o(x) = sum_k coefficients(o, k) prod_{j in terms[k]} z_j,  z_j = (x_j - centre_j) / scale_j
/// If it is held, the factors of products of two and more are held to the training range of their regressor, rounded
/// off as in docs/algorithms/guards.md, B.1: beyond the range the polynomial goes on as its linear part.
struct Polynomial {
  Eigen::VectorXd centre = {};               ///< one a regressor
  Eigen::VectorXd scale = {};                ///< one a regressor, positive
  Eigen::VectorXd low = {};                  ///< smallest training value of each regressor
  Eigen::VectorXd high = {};                 ///< largest
  std::vector<std::vector<int>> terms = {};  ///< regressors of each product, ascending, repeated for powers
  Eigen::MatrixXd coefficients = {};         ///< outputs x terms
  bool is_held = false;
};

/// Factors of a product of a polynomial at most.
inline constexpr int most_degree = 3;
/// Products of a polynomial at most.
inline constexpr Eigen::Index most_terms = 10'000;

/// What the polynomial leaves, learnt by a tree or a sum of trees from the same regressors; or nothing.
using Rest = std::variant<std::monostate, Model, BoostedModel>;

/// Errors of an output in free runs over stretches that were held out, some rows after the runs began.
struct HeldOutErrors {
  double rows = 1.0;                ///< since the last measured row: the mean of those that are pooled here
  std::vector<double> errors = {};  ///< |measured - simulated| in the unit of the output, ascending, at most 200
};

/// What run_bounds() needs.
struct RunBand {
  std::vector<std::vector<HeldOutErrors>> outputs = {};  ///< one list an output, by rows; empty: nothing is known
  Eigen::Index longest = 0;                              ///< rows of the longest held-out run
};

/// The parts of a DynamicModel.
struct DynamicParts {
  std::vector<Signal> inputs;
  std::vector<Signal> outputs;
  double sample_time = 1.0;
  std::string time_unit = "s";
  Lags lags;
  Polynomial polynomial;
  Rest rest = {};
  bool is_stable = true;  ///< false: a run on held-out stretches left the bounds, see DynamicModel::lower()
  RunBand band = {};
};

/// y(t) = p(x(t)) + r(x(t)), where x are the regressors (columns_of()), p is a polynomial and r a tree, a sum of trees
/// or nothing. A polynomial of degree 1 without a rest is the linear ARX model (Ljung 1999, ch. 4). Far from the
/// training rows the guards of the rest let it end (docs/algorithms/guards.md), and the polynomial goes on.
///
/// An output with stops is y(t) = min(max(v(t), lower stop), upper stop), where v(t) is the right side above, and its
/// changes among the regressors are v(t-1) - y(t-2), ...: what drives the output against the stop is not lost.
///
/// Immutable, safe to use from many threads.
class DynamicModel {
 public:
  /// Throws std::invalid_argument naming the part that does not fit.
  explicit DynamicModel(DynamicParts parts);

  const DynamicParts& parts() const { return parts_; }
  const std::vector<LaggedColumn>& columns() const { return columns_; }
  Eigen::Index num_inputs() const { return std::ssize(parts_.inputs); }
  Eigen::Index num_outputs() const { return std::ssize(parts_.outputs); }
  /// Rows of the past that a step needs: the longest lag.
  Eigen::Index memory() const { return memory_; }
  /// A run has left its bounds where an output is more than 10 of its ranges outside of its range in training.
  double lower(Eigen::Index output) const;
  double upper(Eigen::Index output) const;

 private:
  DynamicParts parts_;
  std::vector<LaggedColumn> columns_;
  Eigen::Index memory_ = 0;
};

/// The model as JSON text (docs/file-formats.md). Throws std::runtime_error as to_json() of a Model.
std::string to_json(const DynamicModel& model);

/// Reads what to_json() wrote; the text may be of any origin. Throws std::runtime_error with `name` and the JSON
/// pointer to the place.
DynamicModel dynamic_from_json(const std::string& text, const std::string& name = "model");

/// Writes to_json() to a file as save() of a Model does. Throws std::runtime_error naming the path.
void save(const DynamicModel& model, const std::string& path);

/// Reads a file that save() wrote. Throws std::runtime_error as dynamic_from_json(), and for more than 256 MiB.
DynamicModel load_dynamic(const std::string& path);

}  // namespace llmt
