/// \file
/// The parts of a tree in the words of a person: conditions and equations.
#pragma once

#include <string>
#include <vector>

#include "llmt/model.hpp"

namespace llmt::report {

/// The number as it is in the file, up to rounding, with as few digits as say it.
std::string decimal(double value);

/// Categories, separated by commas; one with a comma or a quote stands in quotes, as in a CSV file.
std::string quoted_levels(const InputColumn& input, const std::vector<int>& levels);

/// "colour in {blue, red}"; "colour not in {green}" where at least four times as many categories are in as not.
std::string levels_text(const InputColumn& input, const std::vector<int>& levels);

/// The condition of the left or the right side of a split.
std::string condition(const Model& model, const Node& node, bool left);

/// The conditions of a leaf, those on one input joined: "3 < age <= 21".
std::vector<std::string> conditions_of(const Model& model, const Partition& partition, const Leaf& leaf);

/// The terms of an equation, with their signs: "12.3", "+ 0.45 cement", "- 1.2 water". A product's factors stand about
/// their means: "- 0.3 (x - 2)*(y + 1)".
std::vector<std::string> equation(const Model& model, const Leaf& leaf, Eigen::Index output);

/// The name of a column of the local models, as it stands in an equation.
std::string regressor_name(const Model& model, const Regressor& regressor);

}  // namespace llmt::report
