#include "report/model/rules.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>
#include <vector>

#include "llmt/size.hpp"
#include "report/model/rule_text.hpp"

namespace llmt::report {
namespace {

constexpr std::size_t line_width = 100;
// `parts` with `between` them, in lines that begin with `indent` from the second on.
std::string wrapped_list(std::string line, const std::vector<std::string>& parts, const std::string& between,
                         const std::string& indent) {
  std::string text;
  for (std::size_t i = 0; i < parts.size(); ++i) {
    const std::string part = (i == 0 ? "" : between) + parts[i];
    if (i > 0 && line.size() + part.size() > line_width) {
      const bool by_comma = between.starts_with(",");  // it ends a line, and begins none
      text += line + (by_comma ? ",\n" : "\n");
      line = indent + (by_comma ? parts[i] : part.substr(part.find_first_not_of(' ')));
    } else {
      line += part;
    }
  }
  return text + line + "\n";
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
    // The bars of a deep tree would be more than all the rest.
    constexpr std::size_t most_bars = 30;
    const std::size_t bars = at.depth > 0 ? at.depth - 1 : 0;
    std::string indent = bars > most_bars ? fmt::format("{} x | ", bars) : "";
    for (std::size_t d = 0; d < bars && bars <= most_bars; ++d) indent += "|  ";
    if (at.depth > 0) {
      text += indent + at.text + (node.is_leaf() ? fmt::format(": rule {}", position[at.node] + 1) : "") + "\n";
    }
    if (node.is_leaf()) continue;
    open.push_back({node.right, condition(model.inputs(), node, false).text(), at.depth + 1});
    open.push_back({node.left, condition(model.inputs(), node, true).text(), at.depth + 1});
  }
  return text;
}

std::size_t count_in(const std::string& text, const std::string& part) {
  std::size_t count = 0;
  for (std::size_t at = text.find(part); at != std::string::npos; at = text.find(part, at + part.size())) ++count;
  return count;
}

// The text with a name in the place of each long set of categories that occurs several times, and what the names mean
// before it.
std::string with_named_sets(const Model& model, const Partition& partition, const std::vector<Leaf>& leaves,
                            std::string text) {
  constexpr std::size_t long_set = 30;
  std::vector<std::string> sets;
  const auto offer = [&](const std::string& condition) {
    const std::size_t begin = condition.find('{');
    if (begin == std::string::npos || condition.size() - begin < long_set) return;
    const std::string set = condition.substr(begin);
    if (std::ranges::find(sets, set) == sets.end() && count_in(text, set) > 1) sets.push_back(set);
  };
  for (const Leaf& leaf : leaves) {
    for (std::size_t j = 0; j < leaf.levels.size(); ++j) {
      if (!leaf.levels[j].empty())
        offer(levels_text(model.inputs()[j], leaf.levels[j]).substr(model.inputs()[j].name.size()));
    }
  }
  for (const Node& node : partition.nodes) {
    if (node.is_leaf() || node.level_side.empty()) continue;
    for (const bool left : {true, false}) offer(condition(model.inputs(), node, left).how);
  }
  std::string meanings;
  for (std::size_t k = 0; k < sets.size(); ++k) {
    const std::string name = fmt::format("set {}", k + 1);
    for (std::size_t at = text.find(sets[k]); at != std::string::npos; at = text.find(sets[k], at + name.size()))
      text.replace(at, sets[k].size(), name);
    meanings += fmt::format("{} = {}\n", name, sets[k]);
  }
  return meanings.empty() ? text : meanings + "\n" + text;
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
    const std::vector<std::string> when = conditions_of(model.inputs(), partition, leaf);
    text += when.empty() ? head + ": everywhere\n" : wrapped_list(head + ": if ", when, " and ", "    ");
    for (std::size_t o = 0; o < partition.outputs.size(); ++o) {
      const std::string left = fmt::format("  {} = ", model.outputs()[partition.outputs[o]].name);
      text += wrapped_list(left, equation(model, leaf, static_cast<Eigen::Index>(o)), " ", "      ");
    }
    text += "\n";
  }
  if (leaves.size() > 1) text += "As a tree:\n" + tree_text(model, partition, leaves) + "\n";
  return with_named_sets(model, partition, leaves, std::move(text));
}

std::string inputs_text(const Model& model, std::size_t width) {
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
  std::string text = table.text(width);
  if (!unused.empty()) text += wrapped_list("Not used: ", unused, ", ", "  ");
  return text;
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

bool says_all(const Model& model) {
  for (const Partition& partition : model.partitions()) {
    if (partition.num_leaves() > 1 && partition.validity.kind != ValidityKind::crisp) return false;
    if (partition.output_range.size() > 0) return false;
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

std::string rules_text(const Model& model, const std::string& name, std::size_t width) {
  std::string text = fmt::format("{}: size {} (operators, constants and variables)\n", name, expression_size(model));
  for (Eigen::Index p = 0; p < std::ssize(model.partitions()); ++p) {
    const Partition& partition = model.partitions()[p];
    std::vector<std::string> names;
    for (const int output : partition.outputs) names.push_back(model.outputs()[output].name);
    if (partition.validity.kind != ValidityKind::crisp && partition.num_leaves() > 1) {
      throw std::runtime_error(fmt::format(
          "{}: the {} leaves of {} are blended: a prediction is a mean of several equations, so rules would not be the "
          "model. `llmt fit --readable` writes a tree that is its rules; `llmt inspect` lists the leaves",
          name, partition.num_leaves(), fmt::join(names, ", ")));
    }
    text += fmt::format("\n{}: {} rule{}\n\n", fmt::join(names, ", "), partition.num_leaves(),
                        partition.num_leaves() == 1 ? "" : "s");
    text += partition_text(model, p);
  }
  return text + inputs_text(model, width) + notes(model);
}

}  // namespace llmt::report
