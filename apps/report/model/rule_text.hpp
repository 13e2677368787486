/// \file
/// The parts of a tree in the words of a person: conditions and equations.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "llmt/model.hpp"

namespace llmt::report {

/// The number with as few digits as say it to within `tolerance`; without one as it is in the file, up to rounding.
/// Five digits where more than twelve would be needed.
std::string decimal(double value, std::optional<double> tolerance = {});

/// Categories, separated by commas; one with a comma or a quote stands in quotes, as in a CSV file.
std::string quoted_levels(const InputColumn& input, const std::vector<int>& levels);

/// "colour = blue", "colour in {blue, red}"; "colour not in {green}" where that is shorter.
std::string levels_text(const InputColumn& input, const std::vector<int>& levels);

/// What is compared, and how: "age", "<= 21".
struct Condition {
  std::string what;
  std::string how;

  std::string text() const { return what + " " + how; }
};

/// The condition of the left or the right side of a split. `tolerance`: how far the threshold may be rounded, for a
/// picture; of an oblique split weights then have two digits and the threshold three.
Condition condition(const std::vector<InputColumn>& inputs, const Node& node, bool left,
                    std::optional<double> tolerance = {});

/// The conditions of a leaf, those on one input joined: "3 < age <= 21".
std::vector<std::string> conditions_of(const std::vector<InputColumn>& inputs, const Partition& partition,
                                       const Leaf& leaf);

/// The terms of the equation intercept + slope . regressors with their signs: "12.3", "+ 0.45 cement", "- 1.2 water". A
/// product's factors stand about their means: "- 0.3 (x - 2)*(y + 1)", and so does an input whose values lie more than
/// three of their ranges from 0: "+ 0.62 (year - 2015)".
std::vector<std::string> equation(const std::vector<InputColumn>& inputs, const std::vector<Regressor>& regressors,
                                  double intercept, const Eigen::RowVectorXd& slope);

/// The equation of a leaf for an output of its partition.
std::vector<std::string> equation(const Model& model, const Leaf& leaf, Eigen::Index output);

/// The name of a column of the local models, as it stands in an equation.
std::string regressor_name(const std::vector<InputColumn>& inputs, const Regressor& regressor);

}  // namespace llmt::report
