// The two kernels of growth: Gram matrices of rows of features, and eight factorisations at once.
//
// gram/INPUTS/ROWS/ORDER: ROWS at a time out of 100000; ORDER 0: in the order of memory, 1: scattered, like the rows of
// a node sorted by an input. flops: multiplications and additions of the lower triangle, without those that only fill
// up vectors. of_peak: flops as a fraction of the machine's peak of multiply-then-add; bytes: of the features read.
// of_sum: largest difference from Eigen's sums, relative to the largest sum.
// factor/INPUTS: residual sums of squares per second.
#include <benchmark/benchmark.h>

#include <algorithm>
#include <numeric>
#include <vector>

#include "llmt/random.hpp"
#include "machine_peak.hpp"
#include "numerics/gram.hpp"

namespace {

constexpr Eigen::Index all_rows = 100000;

llmt::Features features(Eigen::Index inputs) {
  llmt::Random random(1);
  llmt::Features result(all_rows, inputs + 1, 1);
  for (Eigen::Index i = 0; i < all_rows; ++i) {
    double* row = result.row(i);
    row[0] = 1.0;
    std::generate(row + 1, row + inputs + 2, [&] { return random.normal(); });
  }
  return result;
}

double difference_from_eigen(const llmt::Features& rows, const llmt::GramShape& shape,
                             const std::vector<double>& gram) {
  using RowMajor = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
  const Eigen::Map<const RowMajor> all(rows.row(0), rows.rows(), rows.columns());
  const Eigen::MatrixXd expected = all.transpose() * all;
  double largest = 0.0;
  for (Eigen::Index i = 0; i < rows.columns(); ++i) {
    for (Eigen::Index j = 0; j <= i; ++j) largest = std::max(largest, std::abs(expected(i, j) - gram[shape.at(i, j)]));
  }
  return largest / expected.cwiseAbs().maxCoeff();
}

void gram(benchmark::State& state) {
  static const double peak = bench::peak_product_flops();
  const llmt::Features rows = features(state.range(0));
  const llmt::GramShape shape(rows);
  std::vector<int> order(all_rows);
  std::iota(order.begin(), order.end(), 0);
  if (state.range(2) == 1) {
    llmt::Random random(2);
    for (std::size_t i = order.size(); i-- > 1;) {
      std::swap(order[i], order[static_cast<std::size_t>(random.uniform() * static_cast<double>(i + 1))]);
    }
  }
  std::vector<double> sums;
  for (auto _ : state) {
    sums.assign(shape.size(), 0.0);
    for (Eigen::Index begin = 0; begin < all_rows; begin += state.range(1)) {
      llmt::add_rows(rows, order.data() + begin, std::min<Eigen::Index>(state.range(1), all_rows - begin), sums.data());
    }
    benchmark::DoNotOptimize(sums.data());
  }
  const double work = static_cast<double>(state.iterations() * all_rows);
  const double columns = static_cast<double>(rows.columns());
  state.SetBytesProcessed(static_cast<std::int64_t>(work * columns * 8.0));
  state.counters["flops"] = benchmark::Counter(work * columns * (columns + 1.0), benchmark::Counter::kIsRate);
  state.counters["of_peak"] = benchmark::Counter(work * columns * (columns + 1.0) / peak, benchmark::Counter::kIsRate);
  state.counters["of_sum"] = difference_from_eigen(rows, shape, sums);
}

void factor(benchmark::State& state) {
  const llmt::Features rows = features(state.range(0));
  const llmt::GramShape shape(rows);
  constexpr int count = 256;
  std::vector<std::vector<double>> grams(count, std::vector<double>(shape.size(), 0.0));
  std::vector<const double*> at;
  for (int k = 0; k < count; ++k) {
    std::vector<int> some(200);
    std::iota(some.begin(), some.end(), 200 * k);
    llmt::add_rows(rows, some.data(), std::ssize(some), grams[k].data());
    at.push_back(grams[k].data());
  }
  llmt::ResidualSums sums(shape, Eigen::VectorXd::Ones(1));
  std::vector<double> rss(count);
  std::vector<int> rank(count);
  for (auto _ : state) {
    sums.evaluate(at.data(), count, rss.data(), rank.data());
    benchmark::DoNotOptimize(rss.data());
  }
  state.SetItemsProcessed(state.iterations() * count);
}

BENCHMARK(gram)->ArgsProduct({{2, 5, 10, 20, 32}, {16, 256}, {0, 1}})->Unit(benchmark::kMillisecond);
BENCHMARK(factor)->Arg(2)->Arg(5)->Arg(10)->Arg(20)->Arg(32)->Unit(benchmark::kMicrosecond);

}  // namespace
