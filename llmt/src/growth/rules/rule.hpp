/// \file
/// What the library must know of a growth rule.
#pragma once

#include <string_view>
#include <vector>

#include "growth/problem.hpp"

namespace llmt {

/// One row of the table of growth rules (rows.hpp). A new rule is a folder with its grower and a row.
struct Rule {
  std::string_view name;     ///< on the command line, in JSON and in messages
  std::string_view title;    ///< for people
  std::string_view summary;  ///< one phrase for help
  GrownPartition (*grow)(const GrowthProblem& problem) = nullptr;

  /// Choices of FitOptions::validity that fit() does not refuse.
  std::vector<ValidityChoice> validities = {ValidityChoice::automatic, ValidityChoice::crisp, ValidityChoice::blend,
                                            ValidityChoice::gaussian};
  /// The leaves that overlap, if the model has such. crisp: never. gaussian: always, whatever FitOptions::validity
  /// says. blend: blend, or Gaussians where these are asked for.
  ValidityKind overlapping = ValidityKind::blend;

  Eigen::Index fewest_rows = 0;  ///< default of FitOptions::min_leaf_samples; 0: the general one
  Eigen::Index most_leaves = 0;  ///< default of FitOptions::max_leaves; 0: the general one
  /// Whether most_leaves holds only where there are no folds.
  bool most_leaves_without_folds = false;

  /// Weakest-link pruning begins with a tree larger than asked for.
  bool grows_larger_to_be_pruned = true;
  /// Thresholds on single inputs, whose two sides can be kept in the order that FitOptions::monotone asks for.
  bool splits_on_monotone_inputs = true;
  /// The grower keeps the signs of slopes. Else they are imposed on the grown tree.
  bool keeps_signs = false;
  /// The grower prunes, drops inputs and smooths. Its local models are not estimated anew.
  bool has_own_models = false;

  std::string_view usual_method = {};  ///< its name in usual_methods(); empty: it is not among them
  /// compare() prefers the crisp tree of this rule if its error is level with the best.
  bool is_read_most_easily = false;
};

/// All rules, in the order of GrowthRule.
const std::vector<Rule>& rule_table();

/// Throws std::invalid_argument for a number that is no rule.
const Rule& rule_of(GrowthRule rule);

}  // namespace llmt
