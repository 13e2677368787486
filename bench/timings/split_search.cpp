// The search for the best split of one node over all inputs: exact, by bounds, against every split compared (prefix
// sums and a Cholesky factorisation for each). One thread.
//
// Arguments: rows / 1: the synthetic function with noise, 0: noise alone. Counters: evaluated = splits whose residual
// sum of squares was computed; same = 1 if both searches found the same split; apart = difference of the residual sums
// of squares of the two splits, relative to that of the node.
#include <benchmark/benchmark.h>

#include <algorithm>
#include <limits>
#include <numeric>

#include "numerics/node_fit.hpp"
#include "oracles/brute_force_search.hpp"
#include "synthetic.hpp"

namespace {

struct Node {
  llmt::Features features;
  Eigen::VectorXd weights = Eigen::VectorXd::Ones(1);
  double rss = 0.0;
  std::vector<std::vector<int>> orders;
  std::vector<std::vector<double>> values;

  int rank = 0;

  llmt::SearchNode search() const { return {features, weights, rss, static_cast<double>(features.rows()), rank}; }
};

Node make_node(Eigen::Index rows, Eigen::Index inputs, bool signal) {
  bench::Sample data = bench::sample(rows, inputs, 1);
  if (!signal) data.y -= data.truth;
  Node node;
  llmt::NodeFit fit = llmt::fit_node(data.x, data.y, Eigen::VectorXd::Ones(rows));
  node.rss = fit.rss(0);
  node.rank = fit.rank;
  node.features = std::move(fit.features);
  for (const auto column : data.x.colwise()) {
    std::vector<int> order(rows);
    std::iota(order.begin(), order.end(), 0);
    std::ranges::stable_sort(order, {}, [&](int row) { return column(row); });
    const Eigen::VectorXd sorted = column(order);
    node.orders.push_back(std::move(order));
    node.values.emplace_back(sorted.begin(), sorted.end());
  }
  return node;
}

struct Found {
  int input = -1;
  Eigen::Index left = 0;
  double rss = 0.0;
  Eigen::Index evaluations = 0;
};

Found search_by_bounds(const Node& node, Eigen::Index min_leaf_samples) {
  std::vector<llmt::InputSearch> inputs;
  inputs.reserve(node.orders.size());
  double limit = std::numeric_limits<double>::infinity();
  for (std::size_t j = 0; j < node.orders.size(); ++j) {
    inputs.emplace_back(node.search(), node.values[j], node.orders[j], min_leaf_samples).search_edges();
    limit = std::min(limit, inputs.back().smallest());
  }
  Found best;
  for (int j = 0; j < std::ssize(inputs); ++j) {
    inputs[j].refine(limit);
    const llmt::SplitCandidate split = inputs[j].best();
    best.evaluations += split.evaluations;
    if (split.input >= 0 && (best.input < 0 || split.rss < best.rss))
      best = {j, split.left, split.rss, best.evaluations};
  }
  return best;
}

template <int Inputs>
void all_splits(benchmark::State& state) {
  const Node node = make_node(state.range(0), Inputs, state.range(1) == 1);
  oracle::BruteForceSplit found;
  for (auto _ : state) found = oracle::search<Inputs + 1>(node.search(), node.orders, node.values, Inputs + 1);
  state.counters["evaluated"] = static_cast<double>(found.evaluations);
}

template <int Inputs>
void splits_by_bounds(benchmark::State& state) {
  const Node node = make_node(state.range(0), Inputs, state.range(1) == 1);
  Found found;
  for (auto _ : state) found = search_by_bounds(node, Inputs + 1);
  const auto brute = oracle::search<Inputs + 1>(node.search(), node.orders, node.values, Inputs + 1);
  state.counters["evaluated"] = static_cast<double>(found.evaluations);
  state.counters["same"] = brute.input == found.input && brute.left == found.left ? 1.0 : 0.0;
  state.counters["apart"] = (found.rss - brute.rss) / node.rss;
}

void sizes(benchmark::internal::Benchmark* benchmark) {
  benchmark->Args({100000, 1})->Args({100000, 0})->Unit(benchmark::kMillisecond);
}

#define BENCHMARK_SEARCHES(inputs)             \
  BENCHMARK(all_splits<inputs>)->Apply(sizes); \
  BENCHMARK(splits_by_bounds<inputs>)->Apply(sizes)
BENCHMARK_SEARCHES(2);
BENCHMARK_SEARCHES(5);
BENCHMARK_SEARCHES(10);
BENCHMARK_SEARCHES(16);
BENCHMARK_SEARCHES(32);
#undef BENCHMARK_SEARCHES

}  // namespace
