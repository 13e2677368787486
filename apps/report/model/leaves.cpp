#include "report/model/leaves.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <vector>

#include "report/model/rule_text.hpp"

namespace llmt::report {
namespace {

// What the oblique split of a node compares, without its constant: "0.8 x1 - 0.3 x2".
std::string direction(const Model& model, const Node& node) {
  std::string text;
  for (Eigen::Index j = 0; j < node.direction.size(); ++j) {
    if (const double weight = node.direction(j); weight != 0.0) {
      const char* sign = weight < 0.0 ? "-" : text.empty() ? "" : "+";
      text += fmt::format("{}{}{}{} {}", text.empty() ? "" : " ", sign, text.empty() ? "" : " ",
                          number(std::abs(weight)), model.inputs()[j].name);
    }
  }
  return text;
}

// The threshold of that.
double threshold(const Model& model, const Node& node) {
  double value = node.threshold;
  for (Eigen::Index j = 0; j < node.direction.size(); ++j) {
    value += node.direction(j) * model.inputs()[j].centre;
  }
  return value;
}

// "x1 <= 3, -1 < x2 <= 4"; "everywhere" for a single leaf; "s2 > 0.5" for the side of the second split of growth.
std::string conditions(const Model& model, const Partition& partition, const Leaf& leaf) {
  std::vector<std::string> parts;
  for (const ObliqueSide& side : leaf.sides) {
    const Node& node = partition.nodes[side.node];
    parts.push_back(fmt::format("s{} {} {}", node.right / 2, side.left ? "<=" : ">", number(threshold(model, node))));
  }
  for (Eigen::Index j = 0; j < model.num_inputs(); ++j) {
    const InputColumn& input = model.inputs()[j];
    const std::string& name = input.name;
    if (const std::vector<int>& levels = leaf.levels[j]; !levels.empty()) {
      parts.push_back(levels_text(input, levels));
    }
    constexpr double any_value = std::numeric_limits<double>::max();  // a split into rows with and without a value
    if (leaf.low(j) == any_value) {
      parts.push_back(fmt::format("{} missing", name));
      continue;
    }
    if (leaf.high(j) == any_value) {
      parts.push_back(fmt::format("{} there", name));
    }
    const bool below = leaf.high(j) < any_value;
    const bool above = std::isfinite(leaf.low(j));
    if (below && above) {
      parts.push_back(fmt::format("{} < {} <= {}", number(leaf.low(j)), name, number(leaf.high(j))));
    } else if (below) {
      parts.push_back(fmt::format("{} <= {}", name, number(leaf.high(j))));
    } else if (above) {
      parts.push_back(fmt::format("{} > {}", name, number(leaf.low(j))));
    }
  }
  return parts.empty() ? "everywhere" : fmt::format("{}", fmt::join(parts, ", "));
}

// "x1", "[colour = red]" for the indicator of a category, or "(x1 - 0.5)*(x2 + 3)", "(x1 - 0.5)^2" for a product.
std::string short_name(const Model& model, std::size_t k) {
  const Regressor& regressor = model.regressors()[k];
  const InputColumn& input = model.inputs()[regressor.input];
  if (regressor.second_input >= 0) {
    const auto factor = [](const InputColumn& of) {
      return of.centre == 0.0
                 ? of.name
                 : fmt::format("({} {} {})", of.name, of.centre < 0.0 ? "+" : "-", number(std::abs(of.centre), 6));
    };
    const InputColumn& second = model.inputs()[regressor.second_input];
    return regressor.second_input == regressor.input ? factor(input) + "^2" : factor(input) + "*" + factor(second);
  }
  return regressor.level < 0 ? input.name : fmt::format("[{} = {}]", input.name, input.shown_level(regressor.level));
}

// "1.5 + 2 x1 - 0.3 x2".
std::string formula(const Model& model, const Leaf& leaf, Eigen::Index output) {
  std::string text = number(leaf.intercept(output));
  for (std::size_t k = 0; k < model.regressors().size(); ++k) {
    const double slope = leaf.slope(output, k);
    if (slope != 0.0) {
      text += fmt::format(" {} {} {}", slope < 0.0 ? "-" : "+", number(std::abs(slope)), short_name(model, k));
    }
  }
  return text;
}

// How the leaves share the input space, in words.
std::string validity_text(const Validity& validity) {
  switch (validity.kind) {
    case ValidityKind::crisp:
      return "each holds in its box alone";
    case ValidityKind::blend:
      return fmt::format(
          "blended over the splits, width {}: between boxes the formulas are averaged, and a leaf's "
          "formula alone says little where others reach it",
          number(validity.width, 3));
    case ValidityKind::gaussian:
      return fmt::format("blended by Gaussians, k_sigma {}", number(validity.width, 3));
    case ValidityKind::logistic:
      return fmt::format(
          "blended by logistic gates, width {}: at a half width from a threshold the other side has 27 %",
          number(validity.width, 3));
  }
  return "";
}

// Where a blend jumps all the same: "x1 = 0.4, x3 = 7".
std::string jumps_text(const Model& model, const Partition& partition) {
  std::vector<std::string> places;
  for (const Node& node : partition.nodes) {
    const bool on_number = !node.is_leaf() && !node.is_oblique() && node.level_side.empty() &&
                           node.threshold < std::numeric_limits<double>::max();
    if (partition.validity.kind == ValidityKind::blend && on_number && node.half_width == 0.0) {
      const std::string place = fmt::format("{} = {}", model.inputs()[node.split_input].name, number(node.threshold));
      if (std::ranges::find(places, place) == places.end()) {
        places.push_back(place);
      }
    }
  }
  return fmt::format("{}", fmt::join(places, ", "));
}

// Whether predictions of an output of the partition are clamped.
bool is_clamped(const Partition& partition, Eigen::Index output) {
  return partition.output_range.size() > 0 && partition.output_range.row(output).allFinite();
}

std::string directions_text(const Model& model, const Partition& partition, std::size_t width) {
  Table table({"oblique split", "compares", "half width"});
  bool any = false;
  for (const Node& node : partition.nodes) {
    if (node.is_oblique()) {
      any = true;
      table.add({fmt::format("s{}", node.right / 2), direction(model, node), number(node.half_width, 3)});
    }
  }
  return any ? "\n" + table.text(width) : "";
}

}  // namespace

std::string leaves_text(const Model& model, const std::string& name, std::size_t width) {
  std::string text =
      fmt::format("{}: {} input{}, {} output{}\n\n", name, model.num_inputs(), model.num_inputs() == 1 ? "" : "s",
                  model.num_outputs(), model.num_outputs() == 1 ? "" : "s");
  constexpr std::size_t most_columns = 100;
  constexpr std::size_t indent = 2;
  std::string categories;
  Table inputs({"input", "smallest", "largest", "mean"});
  for (const InputColumn& input : model.inputs()) {
    if (input.is_categorical()) {
      std::vector<int> all(input.levels.size());
      std::iota(all.begin(), all.end(), 0);
      categories += wrapped(fmt::format("{}: {} categories: {}\n", input.name, all.size(), quoted_levels(input, all)),
                            std::min(width, most_columns), indent);
      continue;
    }
    inputs.add({input.name, number(input.low), number(input.high), number(input.centre)});
  }
  text += inputs.text(width) + categories;
  for (Eigen::Index p = 0; p < std::ssize(model.partitions()); ++p) {
    const Partition& partition = model.partitions()[p];
    for (Eigen::Index output = 0; output < std::ssize(partition.outputs); ++output) {
      const std::string& target = model.outputs()[partition.outputs[output]].name;
      const bool one = partition.num_leaves() == 1;
      text +=
          one ? fmt::format("\n{}: 1 leaf\n", target)
              : fmt::format("\n{}: {} leaves, {}\n", target, partition.num_leaves(), validity_text(partition.validity));
      Table table({"leaf", "rows", "RMSE", "where", target + " ="});
      const std::vector<Leaf> leaves = model.leaves(p);
      for (std::size_t k = 0; k < leaves.size(); ++k) {
        table.add({fmt::format("{}", k + 1), fmt::format("{}", leaves[k].samples), number(leaves[k].rmse(output), 3),
                   conditions(model, partition, leaves[k]), formula(model, leaves[k], output)});
      }
      text += table.text(width);
      if (is_clamped(partition, output)) {
        text += fmt::format("Predictions are kept between {} and {}, the range of the training rows\n",
                            number(partition.output_range(output, 0)), number(partition.output_range(output, 1)));
      }
    }
    text += directions_text(model, partition, width);
    if (const std::string jumps = jumps_text(model, partition); !jumps.empty()) {
      text += fmt::format("Jumps, not blended: {}\n", jumps);
    }
  }
  return text;
}

namespace {

Json list_of(const Eigen::VectorXd& values) {
  Json json = Json::array();
  for (const double value : values) json.push_back(finite_or_null(value));
  return json;
}

}  // namespace

Json leaves_json(const Model& model) {
  Json json;
  for (const InputColumn& input : model.inputs()) {
    json["inputs"].push_back(
        {{"name", input.name}, {"low", input.low}, {"high", input.high}, {"centre", input.centre}});
    if (input.is_categorical()) {
      json["inputs"].back()["levels"] = input.levels;
    }
  }
  json["regressors"] = Json::array();
  for (std::size_t k = 0; k < model.regressors().size(); ++k) {
    json["regressors"].push_back(short_name(model, k));
  }
  for (Eigen::Index p = 0; p < std::ssize(model.partitions()); ++p) {
    const Partition& partition = model.partitions()[p];
    Json entry;
    entry["validity"] = {
        {"kind", name_of(partition.validity.kind)}, {"width", partition.validity.width}, {"smoothness", 1}};
    for (const int output : partition.outputs) {
      const Eigen::Index position = std::ssize(entry["targets"]);
      entry["targets"].push_back(model.outputs()[output].name);
      entry["output_range"].push_back(is_clamped(partition, position) ? Json({partition.output_range(position, 0),
                                                                              partition.output_range(position, 1)})
                                                                      : Json(nullptr));
    }
    for (std::size_t i = 0; i < partition.nodes.size(); ++i) {
      if (const Node& node = partition.nodes[i]; node.is_oblique()) {
        entry["oblique_splits"].push_back({{"node", i},
                                           {"direction", list_of(node.direction)},
                                           {"threshold", threshold(model, node)},
                                           {"half_width", node.half_width}});
      }
    }
    for (const Leaf& leaf : model.leaves(p)) {
      Json sides = Json::array();
      for (const ObliqueSide& side : leaf.sides) {
        sides.push_back({{"node", side.node}, {"side", side.left ? "left" : "right"}});
      }
      Json slopes = Json::array();
      for (Eigen::Index o = 0; o < leaf.slope.rows(); ++o) {
        slopes.push_back(list_of(leaf.slope.row(o)));
      }
      entry["leaves"].push_back({{"rows", leaf.samples},
                                 {"rank", leaf.rank},
                                 {"local_model", entry["leaves"].size()},  // one each, counted from left to right
                                 {"low", list_of(leaf.low)},
                                 {"high", list_of(leaf.high)},
                                 {"levels", leaf.levels},
                                 {"sides", std::move(sides)},
                                 {"rmse", list_of(leaf.rmse)},
                                 {"intercept", list_of(leaf.intercept)},
                                 {"slope", std::move(slopes)}});
    }
    json["partitions"].push_back(std::move(entry));
  }
  return json;
}

}  // namespace llmt::report
