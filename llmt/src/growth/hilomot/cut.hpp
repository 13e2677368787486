/// \file
/// The best split of one local model of HILOMOT: a plane with a gate, or sets of levels.
#pragma once

#include <Eigen/Core>
#include <limits>
#include <optional>
#include <vector>

#include "growth/growth_data.hpp"
#include "growth/hilomot/oblique_split.hpp"

namespace llmt {

/// Inputs of HILOMOT in the form that planes are sought in. `data` must live as long as this.
struct HilomotInputs {
  explicit HilomotInputs(const GrowthData& data);

  Eigen::MatrixXd deviations;    ///< of the regressors, rows x regressors; a missing value is 0, the mean
  std::vector<int> numeric;      ///< split inputs that are numbers and vary: directions are made of these
  std::vector<double> spreads;   ///< their standard deviations, in their units
  Eigen::MatrixXd standardised;  ///< rows x numeric: about the mean, in standard deviations; a missing value is 0
  std::vector<int> categorical;  ///< split inputs that are categories
};

/// A local model that has not been split.
struct HilomotLeaf {
  int node = 0;
  std::vector<int> rows;     ///< where its validity is not negligible
  Eigen::VectorXd validity;  ///< in these rows
  Eigen::VectorXd normal;    ///< of the split above it, in standardised inputs; empty: there is none
  double effective = 0.0;    ///< effective number of parameters (docs/algorithms/lolimot.md, L.2), for one output
  bool splittable = true;
};

/// How a leaf may be split.
struct HilomotCut {
  double loss = std::numeric_limits<double>::infinity();  ///< weighted squared error that is left (hilomot.md, H.3)
  Eigen::VectorXd normal;       ///< of length 1 in standardised inputs; empty: the split is by levels
  double threshold = 0.0;       ///< of a plane, in standard deviations
  double half_width = 0.0;      ///< of a plane's gate, in standard deviations
  int input = -1;               ///< of a split by levels
  std::vector<int> level_side;  ///< of a split by levels: see Node::level_side
  double missing_left = 0.5;    ///< of a split by levels: see Node::missing_left
  Eigen::VectorXd share;        ///< validity of the left child by this split, in the leaf's rows
};

/// The split of a leaf that leaves the smallest error; none if no split is admissible or lowers the error. The two new
/// local models are fitted as `models` says. Adds the number of gates that were tried to `evaluations`.
std::optional<HilomotCut> best_cut(const GrowthData& data, const HilomotInputs& inputs, const HilomotLeaf& leaf,
                                   GateModels models, Eigen::Index& evaluations);

}  // namespace llmt
