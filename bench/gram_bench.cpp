// The two kernels of growth: Gram matrices of rows of features, and eight factorisations at once.
//
// gram/INPUTS/ROWS/ORDER: ROWS at a time out of 100000, ORDER 0: one after the other, 1: scattered, as the rows of a
// node sorted by an input are. flops: multiplications and additions of the lower triangle, what fills up vectors not
// counted. of_peak: flops as a part of what the machine does in multiply-then-add; bytes: of the features read.
// factor/INPUTS: residual sums of squares per second. Error beside time: of_sum, the largest difference from Eigen's.
#include <benchmark/benchmark.h>

#include <algorithm>
#include <numeric>
#include <vector>

#include "llmt/random.hpp"
#include "machine_peak.hpp"
#include "numerics/gram.hpp"

namespace {

constexpr std::ptrdiff_t all_rows = 100000;

llmt::Features features(std::ptrdiff_t inputs) {
  llmt::Random random(1);
  llmt::Features result(all_rows, inputs + 1, 1);
  for (std::ptrdiff_t i = 0; i < all_rows; ++i) {
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
  for (std::ptrdiff_t i = 0; i < rows.columns(); ++i) {
    for (std::ptrdiff_t j = 0; j <= i; ++j) {
      largest = std::max(largest, std::abs(expected(i, j) - gram[static_cast<std::size_t>(shape.at(i, j))]));
    }
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
    sums.assign(static_cast<std::size_t>(shape.size()), 0.0);
    for (std::ptrdiff_t begin = 0; begin < all_rows; begin += state.range(1)) {
      llmt::add_rows(rows, order.data() + begin, std::min<std::ptrdiff_t>(state.range(1), all_rows - begin),
                     sums.data());
    }
    benchmark::DoNotOptimize(sums.data());
  }
  const double work = static_cast<double>(state.iterations()) * static_cast<double>(all_rows);
  const double columns = static_cast<double>(rows.columns());
  state.SetBytesProcessed(static_cast<std::int64_t>(work * columns * 8.0));
  state.counters["flops"] = benchmark::Counter(work * columns * (columns + 1.0), benchmark::Counter::kIsRate);
  state.counters["of_peak"] = benchmark::Counter(work * columns * (columns + 1.0) / peak, benchmark::Counter::kIsRate);
  state.counters["of_sum"] = difference_from_eigen(rows, shape, sums);
}

void factor(benchmark::State& state) {
  const llmt::Features rows = features(state.range(0));
  const llmt::GramShape shape(rows);
  constexpr std::size_t count = 256;
  std::vector<std::vector<double>> grams(count, std::vector<double>(static_cast<std::size_t>(shape.size()), 0.0));
  std::vector<const double*> at;
  for (std::size_t k = 0; k < count; ++k) {
    std::vector<int> some(200);
    std::iota(some.begin(), some.end(), static_cast<int>(200 * k));
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
  state.SetItemsProcessed(state.iterations() * static_cast<std::int64_t>(count));
}

BENCHMARK(gram)->ArgsProduct({{2, 5, 10, 20, 32}, {16, 256}, {0, 1}})->Unit(benchmark::kMillisecond);
BENCHMARK(factor)->Arg(2)->Arg(5)->Arg(10)->Arg(20)->Arg(32)->Unit(benchmark::kMicrosecond);

}  // namespace
