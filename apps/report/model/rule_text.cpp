#include "report/model/rule_text.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <limits>
#include <numeric>

#include "llmt/csv.hpp"
#include "report/text/text.hpp"

namespace llmt::report {
namespace {

constexpr double any_value = std::numeric_limits<double>::max();  // a split into rows with and without a value

// Significant digits of a number that was not rounded.
constexpr int usual_digits = 5;
constexpr int most_digits = 12;

// Without an exponent where that is short.
std::string with_digits(double value, int digits) {
  const double magnitude = std::abs(value);
  if (magnitude < 1e-5 || magnitude >= 1e9) return fmt::format("{:.{}g}", value, digits);
  const int before_point = 1 + static_cast<int>(std::floor(std::log10(magnitude)));
  std::string text = fmt::format("{:.{}f}", value, std::max(0, digits - before_point));
  if (text.find('.') != std::string::npos) {
    text.erase(text.find_last_not_of('0') + 1);
    if (text.back() == '.') text.pop_back();
  }
  return text;
}

// The number with as few digits as say it to within `tolerance`; `usual_digits` of them if many would be needed.
std::string decimal_within(double value, double tolerance) {
  if (!std::isfinite(value)) return fmt::format("{}", value);
  if (std::abs(value) <= tolerance) return "0";
  for (int digits = 1; digits <= most_digits; ++digits) {
    const std::string text = with_digits(value, digits);
    double read = 0.0;
    std::from_chars(text.data(), text.data() + text.size(), read);
    if (std::abs(read - value) <= tolerance) return text;
  }
  return with_digits(value, usual_digits);
}

// An oblique split: "0.8 x1 - 0.3 x2", "<= 1.5".
Condition oblique(const std::vector<InputColumn>& inputs, const Node& node, const std::string& sign, bool rounded) {
  std::string text;
  double threshold = node.threshold;
  for (Eigen::Index j = 0; j < node.direction.size(); ++j) {
    const double weight = node.direction(j);
    if (weight == 0.0) continue;
    threshold += weight * inputs[j].centre;
    const double size = std::abs(weight);
    const std::string term = fmt::format("{} {}", rounded ? number(size, 2) : decimal(size), inputs[j].name);
    text += text.empty() ? (weight < 0.0 ? "-" : "") + term : (weight < 0.0 ? " - " : " + ") + term;
  }
  return {text, sign + (rounded ? number(threshold, 3) : decimal(threshold))};
}

std::string about(const std::string& name, double centre) {
  if (centre == 0.0) return name;
  return fmt::format("({} {} {})", name, centre < 0.0 ? "+" : "-", decimal(std::abs(centre)));
}

std::string factor(const InputColumn& input) { return about(input.name, input.centre); }

// Where an equation begins to count an input: 0, but near the mean, at a number of few digits, of an input whose values
// lie far from 0, such as years. There the constant says what is predicted for a usual value, and not for year 0.
double centre_in_print(const InputColumn& input) {
  constexpr double far = 3.0;  // ranges
  const double range = input.high - input.low;
  if (!(range > 0.0 && std::isfinite(range)) || std::min(std::abs(input.low), std::abs(input.high)) <= far * range ||
      (input.low < 0.0) != (input.high < 0.0))
    return 0.0;
  const double unit = std::pow(10.0, std::floor(std::log10(0.1 * range)));
  const double centre = unit < 1.0 ? std::round(input.centre * std::round(1.0 / unit)) / std::round(1.0 / unit)
                                   : std::round(input.centre / unit) * unit;
  return std::isfinite(centre) ? centre : 0.0;
}

// "in {blue, red}", "= blue"
std::string among(const InputColumn& input, const std::vector<int>& levels) {
  if (levels.empty()) return "is no known category";
  if (levels.size() == 1) return "= " + quoted_levels(input, levels);
  std::vector<int> others(input.levels.size());
  std::iota(others.begin(), others.end(), 0);
  std::erase_if(others, [&](int level) { return std::ranges::find(levels, level) != levels.end(); });
  const std::string in = fmt::format("in {{{}}}", quoted_levels(input, levels));
  const std::string not_in = fmt::format("not in {{{}}}", quoted_levels(input, others));
  return !others.empty() && not_in.size() < in.size() ? not_in : in;
}

}  // namespace

std::string quoted_levels(const InputColumn& input, const std::vector<int>& levels) {
  std::vector<std::string> names;
  for (const int level : levels) names.push_back(csv_field(input.shown_level(level)));
  return fmt::format("{}", fmt::join(names, ", "));
}

std::string levels_text(const InputColumn& input, const std::vector<int>& levels) {
  return input.name + " " + among(input, levels);
}

std::string regressor_name(const std::vector<InputColumn>& inputs, const Regressor& regressor) {
  const InputColumn& input = inputs[regressor.input];
  if (regressor.second_input == regressor.input) return factor(input) + "^2";
  if (regressor.second_input >= 0) return factor(input) + "*" + factor(inputs[regressor.second_input]);
  return regressor.level < 0 ? input.name : fmt::format("[{} = {}]", input.name, input.shown_level(regressor.level));
}

std::string decimal(double value, std::optional<double> tolerance) {
  return decimal_within(value, tolerance.value_or(1e-13 * std::abs(value)));
}

Condition condition(const std::vector<InputColumn>& inputs, const Node& node, bool left,
                    std::optional<double> tolerance) {
  const InputColumn& input = inputs[node.split_input];
  const std::string sign = left ? "<= " : "> ";
  if (!node.level_side.empty()) {
    std::vector<int> levels;
    for (int level = 0; level < static_cast<int>(node.level_side.size()); ++level) {
      if (node.level_side[level] == (left ? -1 : 1)) levels.push_back(level);
    }
    return {input.name, among(input, levels)};
  }
  if (node.is_oblique()) return oblique(inputs, node, sign, tolerance.has_value());
  if (node.threshold == any_value) return {input.name, left ? "is known" : "is missing"};
  return {input.name, sign + decimal(node.threshold, tolerance)};
}

std::vector<std::string> conditions_of(const std::vector<InputColumn>& inputs, const Partition& partition,
                                       const Leaf& leaf) {
  std::vector<std::string> parts;
  for (const ObliqueSide& side : leaf.sides) {
    parts.push_back(condition(inputs, partition.nodes[side.node], side.left).text());
  }
  for (Eigen::Index j = 0; j < std::ssize(inputs); ++j) {
    const InputColumn& input = inputs[j];
    if (!leaf.levels[j].empty()) parts.push_back(levels_text(input, leaf.levels[j]));
    if (leaf.low(j) == any_value) {
      parts.push_back(input.name + " is missing");
      continue;
    }
    if (leaf.high(j) == any_value) parts.push_back(input.name + " is known");
    const bool below = leaf.high(j) < any_value;
    const bool above = std::isfinite(leaf.low(j));
    if (below && above) {
      parts.push_back(fmt::format("{} < {} <= {}", decimal(leaf.low(j)), input.name, decimal(leaf.high(j))));
    } else if (below) {
      parts.push_back(fmt::format("{} <= {}", input.name, decimal(leaf.high(j))));
    } else if (above) {
      parts.push_back(fmt::format("{} > {}", input.name, decimal(leaf.low(j))));
    }
  }
  return parts;
}

std::vector<std::string> equation(const std::vector<InputColumn>& inputs, const std::vector<Regressor>& regressors,
                                  double intercept, const Eigen::RowVectorXd& slope) {
  // The constant was computed from the value at the centres, and has the rounding of that sum.
  double magnitude = std::abs(intercept);
  std::vector<std::string> parts(1);
  for (std::size_t k = 0; k < regressors.size(); ++k) {
    if (slope(k) == 0.0) continue;
    magnitude += std::abs(slope(k) * regressors[k].centre);
    const InputColumn& input = inputs[regressors[k].input];
    const bool is_number = regressors[k].level < 0 && regressors[k].second_input < 0;
    const double centre = is_number ? centre_in_print(input) : 0.0;
    intercept += slope(k) * centre;
    parts.push_back(fmt::format("{} {} {}", slope(k) < 0.0 ? "-" : "+", decimal(std::abs(slope(k))),
                                is_number ? about(input.name, centre) : regressor_name(inputs, regressors[k])));
  }
  parts[0] = decimal_within(intercept, 1e-13 * magnitude);
  return parts;
}

std::vector<std::string> equation(const Model& model, const Leaf& leaf, Eigen::Index output) {
  return equation(model.inputs(), model.regressors(), leaf.intercept(output), leaf.slope.row(output));
}

}  // namespace llmt::report
