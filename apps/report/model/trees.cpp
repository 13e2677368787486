#include "report/model/trees.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <set>

#include "llmt/explain.hpp"
#include "report/document/figures.hpp"
#include "report/model/rule_text.hpp"
#include "report/text/text.hpp"

namespace llmt::report {
namespace {

constexpr std::size_t most_slopes = 8;

// The value of a regressor at a row; NaN where it is missing.
double value_of(const Model& model, const Regressor& regressor, const Eigen::MatrixXd& inputs, Eigen::Index row) {
  const double value = inputs(row, regressor.input);
  if (regressor.second_input < 0) return value;
  return (value - model.inputs()[regressor.input].centre) *
         (inputs(row, regressor.second_input) - model.inputs()[regressor.second_input].centre);
}

// How far each regressor moves between its quartiles; 1 for indicators.
Numbers spreads(const Model& model, const Eigen::MatrixXd& inputs) {
  Numbers result;
  for (const Regressor& regressor : model.regressors()) {
    if (regressor.level >= 0) {
      result.push_back(1.0);
      continue;
    }
    Numbers values;
    for (Eigen::Index row = 0; row < inputs.rows(); ++row) {
      const double value = value_of(model, regressor, inputs, row);
      if (!std::isnan(value)) values.push_back(value);
    }
    result.push_back(values.empty() ? 0.0 : quantile(values, 0.75) - quantile(values, 0.25));
  }
  return result;
}

Json leaf_json(const Model& model, const Partition& partition, const Leaf& leaf, const Numbers& spread) {
  Json json = {{"equations", Json::array()}, {"slopes", Json::array()}};
  for (std::size_t o = 0; o < partition.outputs.size(); ++o) {
    json["equations"].push_back(fmt::format("{} = {}", model.outputs()[partition.outputs[o]].name,
                                            fmt::join(equation(model, leaf, static_cast<Eigen::Index>(o)), " ")));
  }
  std::vector<std::pair<double, std::size_t>> effects;
  for (std::size_t k = 0; k < spread.size(); ++k) {
    if (leaf.slope(0, k) != 0.0) effects.emplace_back(leaf.slope(0, k) * spread[k], k);
  }
  std::ranges::stable_sort(effects, std::greater{}, [](const auto& effect) { return std::abs(effect.first); });
  if (effects.size() > most_slopes) effects.resize(most_slopes);
  for (const auto& [effect, k] : effects) {
    json["slopes"].push_back({{"name", regressor_name(model.inputs(), model.regressors()[k])}, {"effect", effect}});
  }
  return json;
}

}  // namespace

Json tree_block(const Model& model, Eigen::Index p, const Eigen::MatrixXd& inputs, const std::string& title,
                const std::string& caption) {
  const Partition& partition = model.partitions()[p];
  const std::vector<Leaf> leaves = model.leaves(p);
  const Numbers spread = spreads(model, inputs);
  std::vector<Json> made(partition.nodes.size());
  for (const Leaf& leaf : leaves) made[leaf.node]["leaf"] = leaf_json(model, partition, leaf, spread);
  // Children come after their parent.
  for (int n = static_cast<int>(partition.nodes.size()) - 1; n >= 0; --n) {
    const Node& node = partition.nodes[n];
    made[n]["rows"] = fmt::format("{} rows", node.samples);
    if (node.is_leaf()) continue;
    for (const bool left : {true, false}) {
      Json& child = made[left ? node.left : node.right];
      child["condition"] = condition(model.inputs(), node, left).text();
      made[n]["children"].push_back(std::move(child));
    }
  }
  made[0]["condition"] = partition.num_leaves() == 1 ? "everywhere" : "all rows";
  return {{"kind", "tree"}, {"title", title}, {"caption", caption}, {"wide", true}, {"root", std::move(made[0])}};
}

std::vector<int> used_numbers(const Model& model) {
  std::set<int> used;
  for (const Partition& partition : model.partitions()) {
    for (const Node& node : partition.nodes) {
      if (!node.is_leaf()) used.insert(node.split_input);
      for (Eigen::Index j = 0; j < node.direction.size(); ++j) {
        if (node.direction(j) != 0.0) used.insert(static_cast<int>(j));
      }
      for (Eigen::Index k = 0; k < node.slope.cols(); ++k) {
        if (node.slope.col(k).isZero(0.0)) continue;
        used.insert(model.regressors()[k].input);
        if (model.regressors()[k].second_input >= 0) used.insert(model.regressors()[k].second_input);
      }
    }
  }
  std::vector<int> result;
  for (const int input : used) {
    if (!model.inputs()[input].is_categorical()) result.push_back(input);
  }
  return result;
}

std::vector<Json> plane_blocks(const Model& model, Eigen::Index output, const Eigen::MatrixXd& inputs,
                               const Eigen::VectorXd& observed) {
  const std::vector<int> used = used_numbers(model);
  const bool has_categories =
      std::ranges::any_of(model.inputs(), [](const InputColumn& input) { return input.is_categorical(); });
  if (used.size() != 2 || has_categories) return {};
  const InputColumn& first = model.inputs()[used[0]];
  const InputColumn& second = model.inputs()[used[1]];
  if (first.low == first.high || second.low == second.high) return {};
  constexpr int places = 81;
  const Numbers xs = steps_between(first.low, first.high, places);
  const Numbers ys = steps_between(second.low, second.high, places);
  Eigen::MatrixXd queries = reference_point(model).transpose().replicate(places * places, 1);
  for (int i = 0; i < places; ++i) {
    for (int j = 0; j < places; ++j) {
      queries(i * places + j, used[0]) = xs[j];
      queries(i * places + j, used[1]) = ys[i];
    }
  }
  const Eigen::VectorXd values = model.predict(queries).col(output);
  const Eigen::MatrixXd z = values.reshaped<Eigen::RowMajor>(places, places);
  const std::string& name = model.outputs()[output].name;
  const std::vector<Eigen::Index> rows = thinned(inputs.rows());
  Map map{
      .title = "The boxes of the tree",
      .caption = "Colour: the prediction. Each box has an equation of its own." + thinning_note(inputs.rows(), "rows"),
      .x = {first.name},
      .y = {second.name},
      .xs = xs,
      .ys = ys,
      .z = z,
      .unit = name};
  Surface surface{.title = "The same as a surface",
                  .caption = "Points: the rows. Drag to turn.",
                  .x = {first.name},
                  .y = {second.name},
                  .z_axis = {name},
                  .xs = xs,
                  .ys = ys,
                  .z = z,
                  .points = Eigen::MatrixXd(std::ssize(rows), 3)};
  for (std::size_t p = 0; p < model.partitions().size(); ++p) {
    const Partition& partition = model.partitions()[p];
    if (std::ranges::find(partition.outputs, static_cast<int>(output)) == partition.outputs.end()) continue;
    int number = 0;
    for (const Leaf& leaf : model.leaves(static_cast<Eigen::Index>(p))) {
      ++number;
      if (!leaf.sides.empty()) continue;
      map.boxes.push_back({std::max(first.low, leaf.low(used[0])), std::min(first.high, leaf.high(used[0])),
                           std::max(second.low, leaf.low(used[1])), std::min(second.high, leaf.high(used[1])),
                           partition.num_leaves() <= 25 ? std::to_string(number) : ""});
    }
  }
  for (std::size_t k = 0; k < rows.size(); ++k) {
    map.points_x.push_back(inputs(rows[k], used[0]));
    map.points_y.push_back(inputs(rows[k], used[1]));
    surface.points.row(k) << inputs(rows[k], used[0]), inputs(rows[k], used[1]), observed(rows[k]);
  }
  return {block(map), block(surface)};
}

}  // namespace llmt::report
