#include "llmt/rules.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <limits>
#include <stdexcept>
#include <vector>

#include "llmt/size.hpp"
#include "shared/cli.hpp"

namespace llmt::apps {
namespace {

constexpr std::size_t line_width = 100;
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
std::string decimal(double value, double tolerance) {
  if (std::abs(value) <= tolerance) return "0";
  for (int digits = 1; digits <= most_digits; ++digits) {
    const std::string text = with_digits(value, digits);
    double read = 0.0;
    std::from_chars(text.data(), text.data() + text.size(), read);
    if (std::abs(read - value) <= tolerance) return text;
  }
  return with_digits(value, usual_digits);
}

// As it is in the file, up to rounding.
std::string decimal(double value) { return decimal(value, 1e-13 * std::abs(value)); }

// `parts` with `between` them, in lines that begin with `indent` from the second on.
std::string wrapped(std::string line, const std::vector<std::string>& parts, const std::string& between,
                    const std::string& indent) {
  std::string text;
  for (std::size_t i = 0; i < parts.size(); ++i) {
    const std::string part = (i == 0 ? "" : between) + parts[i];
    if (i > 0 && line.size() + part.size() > line_width) {
      text += line + "\n";
      line = indent + part.substr(part.find_first_not_of(' '));
    } else {
      line += part;
    }
  }
  return text + line + "\n";
}

std::string levels_text(const InputColumn& input, const std::vector<int>& levels) {
  std::vector<std::string> names;
  for (const int level : levels) names.push_back(input.levels[level]);
  return fmt::format("{} in {{{}}}", input.name, fmt::join(names, ", "));
}

// What an oblique split compares: "0.8 x1 - 0.3 x2".
std::string direction(const Model& model, const Node& node, double& threshold) {
  std::string text;
  threshold = node.threshold;
  for (Eigen::Index j = 0; j < node.direction.size(); ++j) {
    const double weight = node.direction(j);
    if (weight == 0.0) continue;
    threshold += weight * model.inputs()[j].centre;
    const std::string term = fmt::format("{} {}", decimal(std::abs(weight)), model.inputs()[j].name);
    text += text.empty() ? (weight < 0.0 ? "-" : "") + term : (weight < 0.0 ? " - " : " + ") + term;
  }
  return text;
}

// The condition of the left or the right side of a split.
std::string condition(const Model& model, const Node& node, bool left) {
  const InputColumn& input = model.inputs()[node.split_input];
  if (!node.level_side.empty()) {
    std::vector<int> levels;
    for (int level = 0; level < static_cast<int>(node.level_side.size()); ++level) {
      if (node.level_side[level] == (left ? -1 : 1)) levels.push_back(level);
    }
    return levels_text(input, levels);
  }
  if (node.is_oblique()) {
    double threshold = 0.0;
    const std::string side = direction(model, node, threshold);
    return fmt::format("{} {} {}", side, left ? "<=" : ">", decimal(threshold));
  }
  if (node.threshold == any_value) return fmt::format("{} is {}", input.name, left ? "known" : "missing");
  return fmt::format("{} {} {}", input.name, left ? "<=" : ">", decimal(node.threshold));
}

// The conditions of a leaf, those on one input joined: "3 < age <= 21".
std::vector<std::string> conditions_of(const Model& model, const Partition& partition, const Leaf& leaf) {
  std::vector<std::string> parts;
  for (const ObliqueSide& side : leaf.sides) parts.push_back(condition(model, partition.nodes[side.node], side.left));
  for (Eigen::Index j = 0; j < model.num_inputs(); ++j) {
    const InputColumn& input = model.inputs()[j];
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

std::string factor(const InputColumn& input) {
  if (input.centre == 0.0) return input.name;
  return fmt::format("({} {} {})", input.name, input.centre < 0.0 ? "+" : "-", decimal(std::abs(input.centre)));
}

std::string regressor_name(const Model& model, const Regressor& regressor) {
  const InputColumn& input = model.inputs()[regressor.input];
  if (regressor.second_input == regressor.input) return factor(input) + "^2";
  if (regressor.second_input >= 0) return factor(input) + "*" + factor(model.inputs()[regressor.second_input]);
  return regressor.level < 0 ? input.name : fmt::format("[{} = {}]", input.name, input.levels[regressor.level]);
}

// The terms of an equation, with their signs: "12.3", "+ 0.45 cement", "- 1.2 water".
std::vector<std::string> equation(const Model& model, const Leaf& leaf, Eigen::Index output) {
  // The constant was computed from the value at the centres, and has the rounding of that sum.
  double magnitude = std::abs(leaf.intercept(output));
  std::vector<std::string> parts(1);
  for (std::size_t k = 0; k < model.regressors().size(); ++k) {
    const double slope = leaf.slope(output, k);
    if (slope == 0.0) continue;
    magnitude += std::abs(slope * model.regressors()[k].centre);
    parts.push_back(fmt::format("{} {} {}", slope < 0.0 ? "-" : "+", decimal(std::abs(slope)),
                                regressor_name(model, model.regressors()[k])));
  }
  parts[0] = decimal(leaf.intercept(output), 1e-13 * magnitude);
  return parts;
}

std::vector<int> positions_of(const Partition& partition, const std::vector<Leaf>& leaves) {
  std::vector<int> position(partition.nodes.size(), -1);
  for (int k = 0; k < static_cast<int>(leaves.size()); ++k) position[leaves[k].node] = k;
  return position;
}

std::string tree_text(const Model& model, const Partition& partition, const std::vector<Leaf>& leaves) {
  const std::vector<int> position = positions_of(partition, leaves);
  struct Open {
    int node;
    std::string text;  // its condition
    std::size_t depth;
  };
  std::string text;
  std::vector<Open> open = {{0, "", 0}};
  while (!open.empty()) {
    const Open at = open.back();
    open.pop_back();
    const Node& node = partition.nodes[at.node];
    std::string indent;
    for (std::size_t d = 1; d < at.depth; ++d) indent += "|  ";
    if (at.depth > 0) {
      text += indent + at.text + (node.is_leaf() ? fmt::format(": rule {}", position[at.node] + 1) : "") + "\n";
    }
    if (node.is_leaf()) continue;
    open.push_back({node.right, condition(model, node, false), at.depth + 1});
    open.push_back({node.left, condition(model, node, true), at.depth + 1});
  }
  return text;
}

std::string partition_text(const Model& model, Eigen::Index p) {
  const Partition& partition = model.partitions()[p];
  const std::vector<Leaf> leaves = model.leaves(p);
  std::string text;
  for (std::size_t k = 0; k < leaves.size(); ++k) {
    const Leaf& leaf = leaves[k];
    std::vector<std::string> errors;
    for (const double rmse : leaf.rmse) errors.push_back(number(rmse, 3));
    const std::string head = fmt::format("Rule {} ({} rows, RMSE {})", k + 1, leaf.samples, fmt::join(errors, ", "));
    const std::vector<std::string> when = conditions_of(model, partition, leaf);
    text += when.empty() ? head + ": everywhere\n" : wrapped(head + ": if ", when, " and ", "    ");
    for (std::size_t o = 0; o < partition.outputs.size(); ++o) {
      const std::string left = fmt::format("  {} = ", model.outputs()[partition.outputs[o]].name);
      text += wrapped(left, equation(model, leaf, static_cast<Eigen::Index>(o)), " ", "      ");
    }
    text += "\n";
  }
  if (leaves.size() > 1) text += "As a tree:\n" + tree_text(model, partition, leaves) + "\n";
  return text;
}

std::vector<bool> used_inputs(const Model& model) {
  std::vector<bool> used(model.num_inputs(), false);
  for (const Partition& partition : model.partitions()) {
    for (const Node& node : partition.nodes) {
      if (!node.is_leaf()) {
        used[node.split_input] = true;
        for (Eigen::Index j = 0; j < node.direction.size(); ++j) used[j] = used[j] || node.direction(j) != 0.0;
        continue;
      }
      for (Eigen::Index k = 0; k < node.slope.cols(); ++k) {
        if (node.slope.col(k).isZero(0.0)) continue;
        const Regressor& regressor = model.regressors()[k];
        used[regressor.input] = true;
        if (regressor.second_input >= 0) used[regressor.second_input] = true;
      }
    }
  }
  return used;
}

std::string inputs_text(const Model& model) {
  const std::vector<bool> used = used_inputs(model);
  Table table({"input", "smallest", "largest", "mean"});
  std::vector<std::string> unused;
  for (Eigen::Index j = 0; j < model.num_inputs(); ++j) {
    const InputColumn& input = model.inputs()[j];
    if (!used[j]) {
      unused.push_back(input.name);
    } else if (input.is_categorical()) {
      table.add({input.name, fmt::format("{} categories", input.levels.size()), "", ""});
    } else {
      table.add({input.name, decimal(input.low), decimal(input.high), decimal(input.centre)});
    }
  }
  std::string text = table.text();
  if (!unused.empty()) text += wrapped("Not used: ", unused, ", ", "  ");
  return text;
}

// Whether between the smallest and the largest value of each input no guard acts, and a missing value counts as the
// mean: the model is what the rules say.
bool says_all(const Model& model) {
  for (const Partition& partition : model.partitions()) {
    if (partition.residual_range.size() > 0) return partition.num_leaves() == 1 && partition.outer_slope.size() == 0;
    for (const Node& node : partition.nodes) {
      for (std::size_t k = 0; k < model.regressors().size(); ++k) {
        const Regressor& regressor = model.regressors()[k];
        if (regressor.level >= 0 || regressor.second_input >= 0) continue;
        const InputColumn& input = model.inputs()[regressor.input];
        if (node.low(k) > input.low - regressor.centre || node.high(k) < input.high - regressor.centre) return false;
      }
    }
  }
  return true;
}

std::string notes(const Model& model) {
  const bool one_rule =
      std::ranges::all_of(model.partitions(), [](const Partition& partition) { return partition.num_leaves() == 1; });
  if (!says_all(model)) {
    return "The model follows a rule within the range of the rule's rows. Beyond it the slopes of larger regions take\n"
           "over, and predictions are held near the root's model; a missing value counts as the mean of the rule's\n"
           "rows. `llmt fit --readable` writes a tree without such guards.\n";
  }
  return std::string(
             one_rule ? ""
                      : "Between the smallest and the largest value of each input the model is what the rules say. An "
                        "input\nbeyond is held near that end. ") +
         "A missing value counts in an equation as the mean above,\nan unknown category as a missing one; at a split "
         "it goes the way of most rows.\n";
}

}  // namespace

std::string rules_text(const Model& model, const std::string& path) {
  std::string text = fmt::format("{}: size {} (operators, constants and variables)\n", path, expression_size(model));
  for (Eigen::Index p = 0; p < std::ssize(model.partitions()); ++p) {
    const Partition& partition = model.partitions()[p];
    std::vector<std::string> names;
    for (const int output : partition.outputs) names.push_back(model.outputs()[output].name);
    if (partition.validity.kind != ValidityKind::crisp && partition.num_leaves() > 1) {
      throw std::runtime_error(fmt::format(
          "{}: the {} leaves of {} are blended: a prediction is a mean of several equations, so rules would not be the "
          "model. `llmt fit --readable` writes a tree that is its rules; `llmt inspect` lists the leaves",
          path, partition.num_leaves(), fmt::join(names, ", ")));
    }
    text += fmt::format("\n{}: {} rule{}\n\n", fmt::join(names, ", "), partition.num_leaves(),
                        partition.num_leaves() == 1 ? "" : "s");
    text += partition_text(model, p);
  }
  return text + inputs_text(model) + notes(model);
}

}  // namespace llmt::apps
