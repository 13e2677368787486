#include "distributed/top_model.hpp"

#include <algorithm>
#include <map>
#include <utility>
#include <vector>

#include "estimation/leaf_statistics.hpp"
#include "numerics/gram.hpp"
#include "partition/tree.hpp"
#include "stream/sums.hpp"

namespace llmt::distributed {
namespace {

// The regressors of the model: the numbers, which come first, and the indicators that branches have.
struct Columns {
  std::vector<Regressor> all;
  std::map<std::pair<int, int>, Eigen::Index> places;  // of an input and its level, -1: a number

  Eigen::Index size() const { return std::ssize(all); }
  Eigen::Index place(const Regressor& regressor) const { return places.at({regressor.input, regressor.level}); }
};

Columns columns_of(const StateData& data, const std::map<std::size_t, Model>& branches) {
  Columns columns;
  const auto add = [&](int input, int level, double centre) {
    if (!columns.places.try_emplace({input, level}, columns.size()).second) return;
    columns.all.push_back({.input = input, .level = level, .centre = centre});
  };
  for (const Eigen::Index j : data.numbers()) add(static_cast<int>(j), -1, data.mean(j));
  for (const auto& [at, branch] : branches) {
    for (const Regressor& regressor : branch.regressors()) {
      if (regressor.level < 0) continue;
      add(regressor.input, regressor.level, data.level_weight[regressor.input][regressor.level] / data.weight);
    }
  }
  return columns;
}

// A node of the top with the local model of its sums, which has numbers alone.
Node node_of_sums(const StateData& data, const Columns& columns, const TopNode& from) {
  const GramShape shape = data.shape();
  const std::vector<Eigen::Index> numbers = data.numbers();
  const Eigen::Index count = std::ssize(numbers);
  const Eigen::VectorXd scale = data.scale(numbers);
  const double unit = data.scale(data.inputs());
  Node node;
  const Eigen::VectorXd model = model_of(data, from, node.rank);
  const Eigen::VectorXd change = model - from.base;
  node.samples = from.rows;
  node.rss = Eigen::VectorXd::Constant(1, unit * unit * remaining(shape, from.gram.data(), change));
  node.value = Eigen::VectorXd::Constant(1, data.mean(data.inputs()) + unit * model(0));
  node.slope = Eigen::MatrixXd::Zero(1, columns.size());
  node.slope.leftCols(count) = (unit * model.tail(count).cwiseQuotient(scale)).transpose();
  node.mean = node.low = node.high = Eigen::VectorXd::Zero(columns.size());
  for (Eigen::Index k = 0; k < count; ++k) {
    node.mean(k) = scale(k) * std::clamp(from.gram[shape.at(k + 1, 0)] / from.gram[0], from.low(k), from.high(k));
  }
  node.low.head(count) = scale.cwiseProduct(from.low);
  node.high.head(count) = scale.cwiseProduct(from.high);
  if (from.fate == Fate::inner) {
    node.split_input = static_cast<int>(from.input);
    node.threshold = from.threshold;
    node.level_side.assign(from.level_side.begin(), from.level_side.end());
  } else {
    const Eigen::MatrixXd gram = matrix_of(shape, from.gram.data()).topLeftCorner(count + 1, count + 1);
    // A regressor that does not vary is 0 in all rows.
    const Eigen::VectorXd roots = (gram.diagonal().array() > 0.0).select(gram.diagonal(), gram(0, 0)).cwiseSqrt();
    Eigen::VectorXd units(count + 1);
    units << 1.0, scale.cwiseInverse();
    node.inverse_gram = Eigen::MatrixXd::Zero(columns.size() + 1, columns.size() + 1);
    node.inverse_gram.topLeftCorner(count + 1, count + 1) =
        units.asDiagonal() * inverse_gram(gram, roots) * units.asDiagonal();
  }
  return node;
}

// The nodes of a branch's model about the means of the whole table: deviations of the branch are those of the table
// plus `shift`.
void append_branch(const StateData& data, const Columns& columns, const Model& model, std::size_t root,
                   std::vector<Node>& nodes) {
  const std::vector<Regressor>& regressors = model.regressors();
  const Eigen::Index own = std::ssize(regressors);
  const int offset = static_cast<int>(nodes.size()) - 1;  // node k > 0 of the branch becomes k + offset
  const std::vector<Node>& branch = model.partitions().front().nodes;
  for (std::size_t k = 0; k < branch.size(); ++k) {
    Node node = branch[k];
    const Node& from = branch[k];
    node.slope = Eigen::MatrixXd::Zero(1, columns.size());
    node.mean = node.low = node.high = Eigen::VectorXd::Zero(columns.size());
    Eigen::MatrixXd change = Eigen::MatrixXd::Zero(own + 1, columns.size() + 1);  // [1, deviations] of the branch
    change(0, 0) = 1.0;
    for (Eigen::Index r = 0; r < own; ++r) {
      const Eigen::Index at = columns.place(regressors[r]);
      const double shift = regressors[r].centre - columns.all[at].centre;
      node.value(0) -= from.slope(0, r) * shift;
      node.slope(0, at) = from.slope(0, r);
      node.mean(at) = from.mean(r) + shift;
      node.low(at) = from.low(r) + shift;
      node.high(at) = from.high(r) + shift;
      change(r + 1, 0) = -shift;
      change(r + 1, at + 1) = 1.0;
    }
    if (from.inverse_gram.size() > 0) node.inverse_gram = change.transpose() * from.inverse_gram * change;
    if (!node.is_leaf()) {
      node.left += offset;
      node.right += offset;
      // The last levels may have no row in the branch.
      if (!node.level_side.empty()) node.level_side.resize(data.levels[node.split_input].size(), 0);
    }
    if (k == 0) {
      nodes[root] = std::move(node);
    } else {
      nodes.push_back(std::move(node));
    }
  }
}

std::vector<InputColumn> inputs_of(const StateData& data) {
  std::vector<InputColumn> inputs;
  for (Eigen::Index j = 0; j < data.inputs(); ++j) {
    inputs.push_back({.name = to_string(data.input_names[j]),
                      .low = data.range[j].low,
                      .high = data.range[j].high,
                      .centre = data.mean(j),
                      .levels = to_strings(data.levels[j])});
  }
  return inputs;
}

}  // namespace

Model assemble(const StateData& data) {
  std::map<std::size_t, Model> branches;
  for (std::size_t at = 0; at < data.nodes.size(); ++at) {
    if (data.nodes[at].fate != Fate::done) continue;
    branches.emplace(at, from_json(to_string(data.nodes[at].branch), "a branch"));
  }
  const Columns columns = columns_of(data, branches);
  Partition partition;
  partition.outputs = {0};
  partition.nodes.resize(data.nodes.size());
  for (std::size_t at = 0; at < data.nodes.size(); ++at) {
    const TopNode& from = data.nodes[at];
    if (from.fate == Fate::done) {
      const Model& branch = branches.at(at);
      const Validity validity = branch.partitions().front().validity;
      if (validity.kind != ValidityKind::crisp) {
        partition.validity = {validity.kind, std::max(partition.validity.width, validity.width)};
      }
      append_branch(data, columns, branch, at, partition.nodes);
      continue;
    }
    partition.nodes[at] = node_of_sums(data, columns, from);
    if (from.fate == Fate::inner) {
      partition.nodes[at].left = static_cast<int>(from.left);
      partition.nodes[at].right = static_cast<int>(from.right);
      partition.nodes[at].missing_left = data.nodes[from.left].weight / from.weight;
    }
  }
  // fit() may count equal rows as one, or a row as its weight.
  for (std::size_t at = data.nodes.size(); at-- > 0;) {
    const TopNode& from = data.nodes[at];
    if (from.fate != Fate::inner) continue;
    partition.nodes[at].samples = partition.nodes[from.left].samples + partition.nodes[from.right].samples;
  }
  partition.outer_slope = agreed_slope(partition, partition.num_leaves());
  if (data.root_residual.low <= data.root_residual.high) {
    partition.residual_range = Eigen::RowVector2d(data.root_residual.low, data.root_residual.high);
  }
  const Extent& range = data.range[data.inputs()];
  return Model(inputs_of(data), {{to_string(data.output_name), range.low, range.high}}, columns.all,
               {std::move(partition)});
}

}  // namespace llmt::distributed
