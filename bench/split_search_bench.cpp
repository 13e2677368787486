// The search for the best split of one node, all inputs: exact by bounds against every split compared (prefix sums and
// a Cholesky factorisation each), one thread, same split found. CPU milliseconds, the least of some repetitions.
//
// split_search_bench [ROWS]
#include <fmt/format.h>

#include <chrono>
#include <cstdlib>
#include <ctime>
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

  llmt::SearchNode search() const { return {features, weights, rss}; }
};

Node make_node(const Eigen::MatrixXd& x, const Eigen::VectorXd& y) {
  Node node;
  llmt::NodeFit fit = llmt::fit_node(x, y, Eigen::VectorXd::Ones(x.rows()));
  node.rss = fit.rss(0);
  node.features = std::move(fit.features);
  for (Eigen::Index j = 0; j < x.cols(); ++j) {
    std::vector<int> order(static_cast<std::size_t>(x.rows()));
    std::iota(order.begin(), order.end(), 0);
    std::stable_sort(order.begin(), order.end(), [&](int a, int b) { return x(a, j) < x(b, j); });
    const Eigen::VectorXd sorted = x.col(j)(order);
    node.orders.push_back(std::move(order));
    node.values.emplace_back(sorted.begin(), sorted.end());
  }
  return node;
}

double cpu_milliseconds() { return 1e3 * static_cast<double>(std::clock()) / CLOCKS_PER_SEC; }

template <class Work>
double least_time(int repetitions, const Work& work) {
  double least = std::numeric_limits<double>::infinity();
  for (int k = 0; k < repetitions; ++k) {
    const double start = cpu_milliseconds();
    work();
    least = std::min(least, cpu_milliseconds() - start);
  }
  return least;
}

struct Found {
  int input = -1;
  std::ptrdiff_t left = 0;
  double rss = 0.0;
  std::ptrdiff_t evaluations = 0;
};

Found search(const Node& node, std::ptrdiff_t min_leaf_samples) {
  std::vector<llmt::InputSearch> inputs;
  inputs.reserve(node.orders.size());
  double limit = std::numeric_limits<double>::infinity();
  for (std::size_t j = 0; j < node.orders.size(); ++j) {
    inputs.emplace_back(node.search(), node.values[j], node.orders[j], min_leaf_samples).search_edges();
    limit = std::min(limit, inputs.back().smallest());
  }
  Found best;
  for (std::size_t j = 0; j < inputs.size(); ++j) {
    inputs[j].refine(limit);
    const llmt::SplitCandidate split = inputs[j].best();
    best.evaluations += split.evaluations;
    if (split.input >= 0 && (best.input < 0 || split.rss < best.rss)) {
      best = {static_cast<int>(j), split.left, split.rss, best.evaluations};
    }
  }
  return best;
}

template <int Inputs>
void compare(Eigen::Index rows, bool signal) {
  bench::Sample data = bench::sample(rows, Inputs, 1);
  if (!signal) {
    data.y -= data.truth;
  }
  const Node node = make_node(data.x, data.y);
  oracle::BruteForceSplit brute;
  Found found;
  const double slow =
      least_time(2, [&] { brute = oracle::search<Inputs + 1>(node.search(), node.orders, node.values, Inputs + 1); });
  const double fast = least_time(5, [&] { found = search(node, Inputs + 1); });
  const bool same = brute.input == found.input && brute.left == found.left;
  fmt::print("{:8} {:3} {:>7} {:12.2f} {:12.2f} {:8.1f} {:12} {:12} {:>6} {:10.1e}\n", rows, Inputs,
             signal ? "signal" : "noise", slow, fast, slow / fast, brute.evaluations, found.evaluations,
             same ? "yes" : "NO", (found.rss - brute.rss) / node.rss);
}

}  // namespace

int main(int argc, char** argv) {
  const Eigen::Index rows = argc > 1 ? std::atol(argv[1]) : 100000;
  fmt::print("{:>8} {:>3} {:>7} {:>12} {:>12} {:>8} {:>12} {:>12} {:>6} {:>10}\n", "rows", "d", "target", "all splits",
             "by bounds", "ratio", "evaluated", "evaluated", "same", "RSS apart");
  for (const bool signal : {true, false}) {
    compare<2>(rows, signal);
    compare<5>(rows, signal);
    compare<10>(rows, signal);
    compare<16>(rows, signal);
    compare<32>(rows, signal);
  }
  return 0;
}
