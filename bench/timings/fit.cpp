// Fit, error beside time. Rival in the same run: least squares (Eigen, column-pivoted QR).
//
// Arguments: rows / inputs / threads. Counters: rmse = of the noise-free truth on 10000 fresh rows (noise of the data:
// 1), leaves.
#include <benchmark/benchmark.h>

#include <Eigen/QR>
#include <optional>

#include "llmt/fit.hpp"
#include "synthetic.hpp"

namespace {

void report(benchmark::State& state, const Eigen::VectorXd& predicted, const bench::Sample& test, double leaves) {
  state.counters["rmse"] = bench::error(predicted, test);
  state.counters["leaves"] = leaves;
}

void fit_tree(benchmark::State& state, int folds) {
  const bench::Sample train = bench::sample(state.range(0), state.range(1), 1);
  const bench::Sample test = bench::sample(10000, state.range(1), 2);
  const llmt::FitOptions options{.folds = {.count = folds}, .max_threads = static_cast<int>(state.range(2))};
  std::optional<llmt::FitResult> result;
  for (auto _ : state) result.emplace(llmt::fit(train.x, train.y, options));
  report(state, result->model.predict(test.x), test, static_cast<double>(result->summary.partitions[0].leaves));
}

void grow(benchmark::State& state) { fit_tree(state, 0); }
void fit_with_cross_validation(benchmark::State& state) { fit_tree(state, 5); }

void least_squares(benchmark::State& state) {
  const bench::Sample train = bench::sample(state.range(0), state.range(1), 1);
  const bench::Sample test = bench::sample(10000, state.range(1), 2);
  const auto with_constant = [](const Eigen::MatrixXd& x) {
    Eigen::MatrixXd regressors(x.rows(), x.cols() + 1);
    regressors << Eigen::VectorXd::Ones(x.rows()), x;
    return regressors;
  };
  Eigen::VectorXd coefficients;
  for (auto _ : state) coefficients = with_constant(train.x).colPivHouseholderQr().solve(train.y);
  report(state, with_constant(test.x) * coefficients, test, 1.0);
}

void sizes(benchmark::internal::Benchmark* benchmark) {
  for (const std::int64_t rows : {1000, 10000, 100000}) {
    for (const std::int64_t inputs : {2, 5, 10}) {
      benchmark->Args({rows, inputs, 1});
    }
  }
  benchmark->Args({100000, 10, 2});
  benchmark->Unit(benchmark::kMillisecond)->MeasureProcessCPUTime()->UseRealTime();
}

BENCHMARK(grow)->Apply(sizes);
BENCHMARK(fit_with_cross_validation)
    ->Args({10000, 10, 1})
    ->Args({10000, 10, 2})
    ->Unit(benchmark::kMillisecond)
    ->UseRealTime();
BENCHMARK(least_squares)->Apply(sizes);

}  // namespace
