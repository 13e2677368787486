// The search of a split: on small tables it finds what refitting every split finds, on large ones the search by bins
// finds what the exact search finds, as far as it promises.
#include <cmath>
#include <vector>

#include "fuzz/table.hpp"
#include "llmt/fit.hpp"
#include "llmt/random.hpp"
#include "oracles/oracles.hpp"

namespace fuzz_split_search {
namespace {

llmt::FitResult split_once(const fuzz::Table& table, llmt::SplitSearch search, Eigen::Index min_leaf) {
  llmt::FitOptions options;
  options.significance = llmt::every_split;
  options.expert.search = search;
  options.expert.shrinkages = {0.0};
  options.max_leaves = 2;
  options.min_leaf_samples = min_leaf;
  options.validity = llmt::ValidityChoice::crisp;
  options.folds.count = 0;
  options.max_threads = 1;
  return llmt::fit(table.inputs, table.outputs, options);
}

// Adjusted, of the two straight lines through the rows on either side of the split that was found, or of one if none
// was. Not Node::rss, which is that of the guarded model.
double rss_of(const llmt::FitResult& result, const fuzz::Table& table) {
  const llmt::Node& root = result.model.partitions().front().nodes.front();
  std::vector<Eigen::Index> left;
  std::vector<Eigen::Index> right;
  for (Eigen::Index i = 0; i < table.inputs.rows(); ++i) {
    const bool is_left = root.is_leaf() || table.inputs(i, root.split_input) <= root.threshold;
    (is_left ? left : right).push_back(i);
  }
  const oracle::WholeNode node{static_cast<double>(table.inputs.rows()), oracle::rank(table.inputs),
                               oracle::rss(table.inputs, table.outputs)};
  if (left.empty() || right.empty()) return static_cast<double>(node.rss);
  const auto side_of = [&](const std::vector<Eigen::Index>& rows) {
    return oracle::Side{std::ssize(rows), oracle::rank(table.inputs(rows, Eigen::all))};
  };
  long double sum = 0.0L;
  for (const std::vector<Eigen::Index>& side : {left, right}) {
    sum += oracle::rss(table.inputs(side, Eigen::all), table.outputs(side, Eigen::all));
  }
  return static_cast<double>(oracle::adjusted_rss(node, sum, side_of(left), side_of(right)));
}

bool is_split(const llmt::FitResult& result) { return result.model.partitions().front().nodes.size() > 1; }

void against_brute_force(fuzz::Bytes& bytes) {
  const fuzz::Table table = fuzz::table_of(bytes, 40, 2, 1, false);
  const Eigen::Index min_leaf = 4 + bytes.below(4);
  const llmt::FitResult result = split_once(table, llmt::SplitSearch::exact, min_leaf);
  const oracle::Split best = oracle::best_split(table.inputs, table.outputs, min_leaf, 0.0L);
  if (!is_split(result) || best.input < 0) return;
  const auto expected = static_cast<double>(best.adjusted);
  const auto without = static_cast<double>(oracle::rss(table.inputs, table.outputs));
  const double found = rss_of(result, table);
  fuzz::require(found <= expected * (1.0 + 1e-6) + 1e-9 * without + 1e-12 * table.outputs.squaredNorm(),
                fmt::format("the split found has {}, the best one {}, without a split {}", found, expected, without));
}

// From 2000 rows on a node is searched by bins.
void against_bins(fuzz::Bytes& bytes) {
  const Eigen::Index rows = 2000 + bytes.below(200);
  const Eigen::Index inputs = 1 + bytes.below(2);
  const int kind = bytes.below(6);
  llmt::Random random(bytes.below(65536));
  fuzz::Table table{Eigen::MatrixXd(rows, inputs), Eigen::MatrixXd(rows, 1)};
  const double step = static_cast<double>(1 + bytes.below(300));
  const double offset = bytes.one_of(std::vector<double>{0.0, 0.0, 1e6});
  const double noise = bytes.one_of(std::vector<double>{0.0, 0.01, 1.0});
  for (Eigen::Index i = 0; i < rows; ++i) {
    for (double& value : table.inputs.row(i)) {
      value = random.uniform(-1.0, 1.0);
      if (kind == 0) value = std::round(value * step) / step;
      if (kind == 1) value = std::exp(8.0 * value);
      if (kind == 2 && random.below(3) > 0) value = 0.25;
    }
    const double x = table.inputs(i, 0);
    table.outputs(i, 0) = (kind == 3 ? std::sin(9.0 * x) : std::abs(x - 0.3)) + noise * random.normal();
    table.inputs.row(i).array() += offset;
  }
  const Eigen::Index min_leaf = 4 + bytes.below(100);
  const llmt::FitResult exact = split_once(table, llmt::SplitSearch::exact, min_leaf);
  const llmt::FitResult binned = split_once(table, llmt::SplitSearch::binned, min_leaf);
  if (!is_split(exact) || !is_split(binned)) return;
  const double excess = binned.summary.partitions.front().search.largest_excess;
  const auto without = static_cast<double>(oracle::rss(table.inputs, table.outputs));
  const double tolerance = 1e-6 * without + 1e-12 * table.outputs.squaredNorm();
  const double best = rss_of(exact, table);
  const double found = rss_of(binned, table);
  fuzz::require(best <= found + tolerance, fmt::format("exact {} is not above binned {}", best, found));
  fuzz::require(found <= best + excess * without + tolerance,
                fmt::format("binned {} is above exact {} by at most {} of {}", found, best, excess, without));
}

}  // namespace

FUZZ_TARGET(split_search) {
  fuzz::Bytes bytes(data, size);
  if (bytes.byte() % 8 == 0) {
    against_bins(bytes);
  } else {
    against_brute_force(bytes);
  }
  return 0;
}

}  // namespace fuzz_split_search
