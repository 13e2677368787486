// Growth of the top of the tree on sums.
#include "distributed/growth.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numeric>
#include <stdexcept>

#include "base/between.hpp"
#include "distributed/top_split.hpp"
#include "stream/sums.hpp"

namespace llmt::distributed {
namespace {

// Bins of a number; 256 rows of the sample in each give a bin's share of the rows to 6 %.
constexpr std::size_t most_bins = 64;

// The bins of the nodes of a pass take at most this many doubles, 32 MiB, or those of one node.
constexpr Eigen::Index largest_sums = Eigen::Index{1} << 22;

// A value of the sample, and the weight of its row.
struct Weighted {
  double value;
  double weight;
};

// At most most_bins - 1 thresholds that each lie between two neighbouring values of the sample: at its quantiles.
std::vector<double> edges_of(std::vector<Weighted> values) {
  std::ranges::sort(values, {}, &Weighted::value);
  double all = 0.0;
  for (const Weighted& each : values) all += each.weight;
  std::vector<double> edges;
  double before = 0.0;
  std::size_t at = 0;
  for (std::size_t bin = 1; bin < most_bins; ++bin) {
    const double wanted = std::floor(static_cast<double>(bin) * all / static_cast<double>(most_bins));
    while (at + 1 < values.size() && before + values[at].weight <= wanted) before += values[at++].weight;
    const auto next = std::ranges::upper_bound(values, values[at].value, {}, &Weighted::value);
    if (next == values.end() || next == values.begin()) continue;
    const double edge = between(std::prev(next)->value, next->value);
    if (edges.empty() || edges.back() < edge) edges.push_back(edge);
  }
  return edges;
}

// The least-squares model of the sample, near which the root's model lies.
Eigen::VectorXd model_of_sample(const StateData& data, const Sample& sample) {
  const std::vector<Eigen::Index> numbers = data.numbers();
  const Eigen::Index count = std::ssize(numbers);
  const Eigen::Index columns = data.row_columns();
  RowProducts products(data.shape());
  const Basis basis{Eigen::VectorXd::Zero(count), Eigen::VectorXd::Zero(count + 1)};
  std::vector<double> gram(data.shape().size(), 0.0);
  Eigen::VectorXd z(count);
  for (std::size_t row = 0; row < sample.hashes.size(); ++row) {
    const double* const values = sample.values.data() + row * columns;
    const auto scaled = [&](Eigen::Index column) { return (values[column] - data.mean(column)) / data.scale(column); };
    for (Eigen::Index k = 0; k < count; ++k) z(k) = scaled(numbers[k]);
    const double weight = data.is_weighted() ? data.weight_scale * values[columns - 1] : 1.0;
    products.set(basis, z.data(), scaled(data.inputs()), weight);
    products.add_to(gram.data());
  }
  int rank = 0;
  return solve(data.shape(), gram.data(), 0.0, rank);
}

double standard_deviation(const std::vector<Weighted>& values) {
  double weight = 0.0;
  double sum = 0.0;
  for (const Weighted& each : values) {
    weight += each.weight;
    sum += each.weight * each.value;
  }
  const double mean = sum / weight;
  double squares = 0.0;
  for (const Weighted& each : values) squares += each.weight * (each.value - mean) * (each.value - mean);
  return std::sqrt(squares / weight);
}

// The weights of the levels of every category, from the bins of the root.
std::vector<std::vector<double>> level_weights(const StateData& data, const NodeSums& sums) {
  const std::vector<Eigen::Index> first = first_bins(data);
  std::vector<std::vector<double>> weights(data.inputs());
  for (Eigen::Index j = 0; j < data.inputs(); ++j) {
    if (!data.is_category(j)) continue;
    for (Eigen::Index bin = first[j]; bin < first[j + 1]; ++bin) {
      weights[j].push_back(sums.grams[bin * data.shape().size()]);
    }
  }
  return weights;
}

Fate fate_of(const StateData& data, Eigen::Index rows) {
  return rows <= data.options.branch_rows ? Fate::branch : Fate::open;
}

void take_node(StateData& data, Eigen::Index at, NodeSums sums) {
  const GramShape shape = data.shape();
  TopNode node = data.nodes[at];
  const Eigen::Index bins_of_first = bins_of(data, 0);
  node.gram.assign(shape.size(), 0.0);
  for (Eigen::Index bin = 0; bin < bins_of_first; ++bin) {
    add(shape, sums.grams.data() + bin * shape.size(), node.gram.data());
  }
  const Eigen::Index counted =
      std::accumulate(sums.counts.begin(), sums.counts.begin() + bins_of_first, Eigen::Index{0});
  if (counted != node.rows) {
    throw std::runtime_error(fmt::format(
        "llmt::distributed::advance: a node has {} rows, and had {}: the table changed", counted, node.rows));
  }
  node.held_out = std::move(sums.held_out);
  node.low.resize(std::ssize(sums.range));
  node.high.resize(std::ssize(sums.range));
  for (Eigen::Index k = 0; k < std::ssize(sums.range); ++k) {
    node.low(k) = sums.range[k].low;
    node.high(k) = sums.range[k].high;
  }
  if (at == 0) data.level_weight = level_weights(data, sums);
  int rank = 0;
  const Eigen::VectorXd change = solve(shape, node.gram.data(), 0.0, rank);
  TopSplit split = best_split(data, sums, node, change, rank);
  node.fate = split.input < 0 ? Fate::leaf : Fate::inner;
  if (node.fate == Fate::inner) {
    node.input = split.input;
    node.level_side = std::move(split.level_side);
    node.threshold = data.is_category(split.input) ? 0.0 : data.edges[split.input][split.edge];
    node.left = std::ssize(data.nodes);
    node.right = node.left + 1;
    for (const bool is_left : {true, false}) {
      TopNode child;
      child.rows = is_left ? split.left_rows : node.rows - split.left_rows;
      child.weight = is_left ? split.left_weight : node.weight - split.left_weight;
      child.fate = fate_of(data, child.rows);
      child.base = node.base + change;
      data.nodes.push_back(std::move(child));
    }
  }
  data.nodes[at] = std::move(node);
}

void refuse_missing(const StateData& data, const Description& description) {
  for (Eigen::Index j = 0; j < data.inputs(); ++j) {
    if (description.missing[j] == 0) continue;
    throw std::runtime_error(fmt::format(
        "llmt::distributed::advance: input \"{}\" has {} missing values, which is not possible beyond one memory "
        "({} rows, branch_rows is {}); leave the column or these rows out, or fill them",
        to_string(data.input_names[j]), description.missing[j], data.rows, data.options.branch_rows));
  }
}

// Whether weights are counts, as TrainingData::weights has it; others are scaled to mean 1.
void take_weights(StateData& data, const Description& description) {
  constexpr double largest_mean_count = 10.0;
  const auto rows = static_cast<double>(data.rows);
  const bool are_counts = description.fractional == 0 && description.weight <= largest_mean_count * rows;
  data.weight_scale = are_counts ? 1.0 : rows / description.weight;
  data.weight = are_counts ? description.weight : rows;
}

}  // namespace

void take_description(StateData& data, Description description) {
  data.rows = description.rows;
  if (data.rows == 0) {
    throw std::runtime_error(fmt::format("llmt::distributed::advance: there are no rows{}",
                                         data.is_weighted() ? " with a weight above 0" : ""));
  }
  const Eigen::Index columns = data.inputs() + 1;
  take_weights(data, description);
  data.range = std::move(description.range);
  data.mean = Eigen::Map<const Eigen::VectorXd>(description.total.data(), columns) / description.weight;
  data.scale = Eigen::VectorXd::Ones(columns);
  data.edges.resize(data.inputs());
  const bool is_small = data.rows <= data.options.branch_rows;
  if (!is_small) refuse_missing(data, description);
  const Eigen::Index stored = data.row_columns();
  for (Eigen::Index j = 0; j < columns && !is_small; ++j) {
    if (data.is_category(j)) continue;
    std::vector<Weighted> values;
    for (std::size_t row = 0; row < description.sample.hashes.size(); ++row) {
      const double* const of_row = description.sample.values.data() + row * stored;
      values.push_back({of_row[j], data.is_weighted() ? data.weight_scale * of_row[stored - 1] : 1.0});
    }
    const double deviation = standard_deviation(values);
    if (std::isnormal(deviation)) data.scale(j) = deviation;
    if (j < data.inputs()) data.edges[j] = edges_of(std::move(values));
  }
  for (Eigen::Index j = 0; j < columns; ++j) {  // a column without any value
    if (!(data.range[j].low <= data.range[j].high)) data.range[j] = {0.0, 0.0};
  }
  TopNode root;
  root.rows = data.rows;
  root.weight = data.weight;
  root.fate = fate_of(data, data.rows);
  root.base =
      is_small ? Eigen::VectorXd::Zero(data.shape().coefficients()).eval() : model_of_sample(data, description.sample);
  data.nodes.push_back(std::move(root));
}

void take_nodes(StateData& data, std::map<Eigen::Index, NodeSums> sums) {
  for (const Eigen::Index node : data.asked) {
    const auto found = sums.find(node);
    if (found == sums.end()) {
      throw std::runtime_error("llmt::distributed::advance: a node has lost its rows: the table changed");
    }
    take_node(data, node, std::move(found->second));
  }
}

void ask(StateData& data) {
  data.asked.clear();
  const Eigen::Index size = first_bins(data).back() * data.shape().size();
  const auto most = static_cast<std::size_t>(std::max<Eigen::Index>(1, largest_sums / std::max<Eigen::Index>(1, size)));
  for (Eigen::Index at = 0; at < std::ssize(data.nodes) && data.asked.size() < most; ++at) {
    if (data.nodes[at].fate == Fate::open) data.asked.push_back(at);
  }
  data.step = Step::grow;
  if (!data.asked.empty()) return;
  Eigen::Index rows = 0;
  for (Eigen::Index at = 0; at < std::ssize(data.nodes); ++at) {
    const TopNode& node = data.nodes[at];
    if (node.fate != Fate::branch || rows + node.rows > data.options.branch_rows) continue;
    rows += node.rows;
    data.asked.push_back(at);
  }
  data.step = data.asked.empty() ? Step::finished : Step::gather;
}

}  // namespace llmt::distributed
