// Growth of the top of the tree on sums.
#include "distributed/growth.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <stdexcept>

#include "growth/search/adjusted_rss.hpp"
#include "stream/sums.hpp"

namespace llmt::distributed {
namespace {

// Bins of a number; 256 rows of the sample in each give a bin's share of the rows to 6 %.
constexpr std::size_t most_bins = 64;

// The bins of the nodes of a pass take at most this many doubles, 32 MiB, or those of one node.
constexpr Eigen::Index largest_sums = Eigen::Index{1} << 22;

// A child has at least this part of the rows wherever there is such a split, so that few passes reach branches.
constexpr Eigen::Index smallest_part = 8;

// At most most_bins - 1 thresholds that each lie between two neighbouring values of the sample.
std::vector<double> edges_of(std::vector<double> values) {
  std::ranges::sort(values);
  const auto between = [](double low, double high) {
    return std::min(low + 0.5 * (high - low), std::nextafter(high, low));
  };
  std::vector<double> edges;
  for (std::size_t bin = 1; bin < most_bins; ++bin) {
    const auto next = std::ranges::upper_bound(values, values[bin * values.size() / most_bins]);
    if (next == values.end() || next == values.begin()) continue;
    const double edge = between(*std::prev(next), *next);
    if (edges.empty() || edges.back() < edge) edges.push_back(edge);
  }
  return edges;
}

// The least-squares model of the sample, near which the root's model lies.
Eigen::VectorXd model_of_sample(const StateData& data, const Sample& sample) {
  const Eigen::Index inputs = data.inputs();
  RowProducts products(data.shape());
  const Basis basis{Eigen::VectorXd::Zero(inputs), Eigen::VectorXd::Zero(inputs + 1)};
  std::vector<double> gram(data.shape().size(), 0.0);
  for (std::size_t row = 0; row < sample.hashes.size(); ++row) {
    const Eigen::Map<const Eigen::VectorXd> values(sample.values.data() + row * (inputs + 1), inputs + 1);
    const Eigen::VectorXd scaled = (values - data.mean).cwiseQuotient(data.scale);
    products.set(basis, scaled.data(), scaled(inputs), 1.0);
    products.add_to(gram.data());
  }
  int rank = 0;
  return solve(data.shape(), gram.data(), 0.0, rank);
}

double standard_deviation(const std::vector<double>& values) {
  const double mean = std::accumulate(values.begin(), values.end(), 0.0) / static_cast<double>(values.size());
  double squares = 0.0;
  for (const double value : values) squares += (value - mean) * (value - mean);
  return std::sqrt(squares / static_cast<double>(values.size()));
}

// A split at an edge between two bins.
struct TopSplit {
  Eigen::Index input = -1;
  Eigen::Index edge = 0;
  Eigen::Index left = 0;  // rows
  double adjusted = std::numeric_limits<double>::infinity();
};

// The sums of a node's rows on one side of every edge of an input.
std::vector<double> sums_of_side(const GramShape& shape, const double* grams, Eigen::Index bins, bool from_left) {
  std::vector<double> sides((bins - 1) * shape.size(), 0.0);
  for (Eigen::Index step = 0; step + 1 < bins; ++step) {
    const Eigen::Index edge = from_left ? step : bins - 2 - step;
    double* const side = sides.data() + edge * shape.size();
    const double* const nearer = from_left ? side - shape.size() : side + shape.size();
    if (step > 0) std::copy(nearer, nearer + shape.size(), side);
    add(shape, grams + (from_left ? edge : edge + 1) * shape.size(), side);
  }
  return sides;
}

struct Sides {
  std::vector<double> rss;
  std::vector<int> rank;
};

Sides evaluate(const GramShape& shape, const std::vector<double>& grams) {
  std::vector<const double*> each;
  for (std::size_t at = 0; at < grams.size(); at += shape.size()) each.push_back(grams.data() + at);
  Sides sides{std::vector<double>(each.size()), std::vector<int>(each.size())};
  ResidualSums(shape, Eigen::VectorXd::Ones(1))
      .evaluate(each.data(), std::ssize(each), sides.rss.data(), sides.rank.data());
  return sides;
}

// The edge with the smallest adjusted RSS (G.7) among those that leave `least` rows on either side.
TopSplit best_edge(const StateData& data, const NodeSums& sums, const AdjustedRss& scale, Eigen::Index rows,
                   Eigen::Index least) {
  const GramShape shape = data.shape();
  const std::vector<Eigen::Index> first = first_bins(data);
  TopSplit best;
  for (Eigen::Index j = 0; j < data.inputs(); ++j) {
    const Eigen::Index bins = bins_of(data, j);
    if (bins < 2) continue;
    const double* const grams = sums.grams.data() + first[j] * shape.size();
    const Sides left = evaluate(shape, sums_of_side(shape, grams, bins, true));
    const Sides right = evaluate(shape, sums_of_side(shape, grams, bins, false));
    Eigen::Index before = 0;
    for (Eigen::Index edge = 0; edge + 1 < bins; ++edge) {
      before += sums.counts[first[j] + edge];
      if (std::min(before, rows - before) < least) continue;
      const int ranks = scale.counted(left.rank[edge], before) + scale.counted(right.rank[edge], rows - before);
      const double adjusted = scale.of(left.rss[edge] + right.rss[edge], ranks);
      if (adjusted < best.adjusted) best = {j, edge, before, adjusted};
    }
  }
  return best;
}

// The rows of the smaller child of the most even split.
Eigen::Index most_even(const StateData& data, const NodeSums& sums, Eigen::Index rows) {
  const std::vector<Eigen::Index> first = first_bins(data);
  Eigen::Index most = 0;
  for (Eigen::Index j = 0; j < data.inputs(); ++j) {
    Eigen::Index before = 0;
    for (Eigen::Index bin = first[j]; bin + 1 < first[j + 1]; ++bin) {
      before += sums.counts[bin];
      most = std::max(most, std::min(before, rows - before));
    }
  }
  return most;
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
  node.low.resize(data.inputs());
  node.high.resize(data.inputs());
  for (Eigen::Index j = 0; j < data.inputs(); ++j) {
    node.low(j) = sums.range[j].low;
    node.high(j) = sums.range[j].high;
  }
  const Sides own = evaluate(shape, node.gram);
  const AdjustedRss scale(static_cast<double>(node.rows), own.rank[0], own.rss[0]);
  const Eigen::Index least = std::min(node.rows / smallest_part, most_even(data, sums, node.rows));
  const TopSplit split = least >= scale.enough_rows() ? best_edge(data, sums, scale, node.rows, least) : TopSplit{};
  node.fate = split.input < 0 ? Fate::leaf : Fate::inner;
  if (node.fate == Fate::inner) {
    int rank = 0;
    const Eigen::VectorXd model = model_of(data, node, rank);
    node.input = split.input;
    node.threshold = data.edges[split.input][split.edge];
    node.left = std::ssize(data.nodes);
    node.right = node.left + 1;
    for (const Eigen::Index rows : {split.left, node.rows - split.left}) {
      TopNode child;
      child.rows = rows;
      child.fate = fate_of(data, rows);
      child.base = model;
      data.nodes.push_back(std::move(child));
    }
  }
  data.nodes[at] = std::move(node);
}

}  // namespace

void take_description(StateData& data, Description description) {
  data.rows = description.rows;
  if (data.rows == 0) throw std::runtime_error("llmt::distributed::advance: there are no rows");
  const Eigen::Index columns = data.inputs() + 1;
  data.range = std::move(description.range);
  data.mean = Eigen::Map<const Eigen::VectorXd>(description.total.data(), columns) / static_cast<double>(data.rows);
  data.scale = Eigen::VectorXd::Ones(columns);
  data.edges.resize(data.inputs());
  const bool is_small = data.rows <= data.options.branch_rows;
  for (Eigen::Index j = 0; j < columns && !is_small; ++j) {
    if (j < data.inputs() && description.missing[j] > 0) {
      throw std::runtime_error(fmt::format(
          "llmt::distributed::advance: input \"{}\" has {} missing values, which is not possible beyond one memory "
          "({} rows, branch_rows is {}); leave the column or these rows out, or fill them",
          to_string(data.input_names[j]), description.missing[j], data.rows, data.options.branch_rows));
    }
    std::vector<double> values;
    for (std::size_t at = j; at < description.sample.values.size(); at += columns) {
      values.push_back(description.sample.values[at]);
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
  root.fate = fate_of(data, data.rows);
  root.base = is_small ? Eigen::VectorXd(Eigen::VectorXd::Zero(columns)) : model_of_sample(data, description.sample);
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
