// Prediction, error beside time. Rivals in the same run: the equations row by row (naive) and, as the least that any
// linear model costs, the product of the inputs with one column of coefficients (product).
//
// Arguments: leaves / inputs / threads. Counters: items_per_second = rows per second of CPU time of all threads
// together, which a busy machine disturbs less than wall time; rmse = of the noise-free truth (noise of the data: 1);
// reach = mean number of leaves that reach a row.
#include <benchmark/benchmark.h>

#include <Eigen/Core>
#include <map>
#include <tuple>

#include "methods.hpp"
#include "oracles/predict_oracle.hpp"
#include "synthetic.hpp"

namespace {

constexpr Eigen::Index query_rows = 100000;

// Each model is grown once, for all benchmarks that use it.
const llmt::Model& model_of(llmt::ValidityChoice validity, std::int64_t leaves, std::int64_t inputs) {
  static std::map<std::tuple<llmt::ValidityChoice, std::int64_t, std::int64_t>, llmt::Model> models;
  const auto key = std::make_tuple(validity, leaves, inputs);
  if (const auto found = models.find(key); found != models.end()) return found->second;
  const bench::Sample train = bench::sample(20000, inputs, 1);
  llmt::FitOptions options = bench::with_leaves(leaves);
  options.min_leaf_samples = 20;
  for (int j = 0; j < std::min<std::int64_t>(inputs, 8); ++j) options.split_inputs.push_back(j);
  // Prediction takes the same time whatever the estimation. Joint estimation of more coefficients than this takes too
  // long; local estimation of wide blends is far from the truth.
  const bool joint = leaves * (inputs + 1) <= 1500;
  options.validity = validity;
  options.expert.estimation = joint ? llmt::Estimation::joint : llmt::Estimation::local;
  options.expert.widths = {1.0};
  options.expert.ridges = {1e-4};
  return models.emplace(key, llmt::fit(train.x, train.y, options).model).first->second;
}

const bench::Sample& queries(std::int64_t inputs) {
  static std::map<std::int64_t, bench::Sample> samples;
  if (!samples.contains(inputs)) samples.emplace(inputs, bench::sample(query_rows, inputs, 2));
  return samples.at(inputs);
}

void report(benchmark::State& state, const llmt::Model& model, const Eigen::VectorXd& predicted,
            const bench::Sample& test) {
  const Eigen::Index rows = predicted.size();
  state.counters["rmse"] = llmt::rmse(predicted, test.truth.head(rows))(0);
  state.counters["reach"] = (model.validities(test.x.topRows(1000), 0).array() > 0.0).cast<double>().sum() / 1000.0;
  state.SetItemsProcessed(state.iterations() * rows);
}

void predict(benchmark::State& state, llmt::ValidityChoice validity) {
  const llmt::Model& model = model_of(validity, state.range(0), state.range(1));
  const bench::Sample& test = queries(state.range(1));
  Eigen::VectorXd predicted;
  for (auto _ : state) predicted = model.predict(test.x, static_cast<int>(state.range(2)));
  report(state, model, predicted, test);
}

void naive(benchmark::State& state, llmt::ValidityChoice validity) {
  const llmt::Model& model = model_of(validity, state.range(0), state.range(1));
  const bench::Sample& test = queries(state.range(1));
  const Eigen::MatrixXd x = test.x.topRows(1000);
  Eigen::VectorXd predicted;
  for (auto _ : state) predicted = oracle::predict_rows(model, x);
  report(state, model, predicted, test);
  state.counters["difference"] = (predicted - model.predict(x)).cwiseAbs().maxCoeff();
}

void single_row(benchmark::State& state, llmt::ValidityChoice validity) {
  const llmt::Model& model = model_of(validity, state.range(0), state.range(1));
  const Eigen::MatrixXd rows = queries(state.range(1)).x.topRows(1024).transpose();
  Eigen::Index i = 0;
  for (auto _ : state) {
    benchmark::DoNotOptimize(model.predict(rows.col(i).transpose()).data());
    i = (i + 1) % rows.cols();
  }
}

void jacobian_of_row(benchmark::State& state, llmt::ValidityChoice validity) {
  const llmt::Model& model = model_of(validity, state.range(0), state.range(1));
  const Eigen::MatrixXd rows = queries(state.range(1)).x.topRows(1024).transpose();
  Eigen::Index i = 0;
  for (auto _ : state) {
    benchmark::DoNotOptimize(model.jacobian(rows.col(i)).data());
    i = (i + 1) % rows.cols();
  }
}

void leverages(benchmark::State& state, llmt::ValidityChoice validity) {
  const llmt::Model& model = model_of(validity, state.range(0), state.range(1));
  const bench::Sample& test = queries(state.range(1));
  for (auto _ : state) benchmark::DoNotOptimize(model.extrapolation(test.x).data());
  state.SetItemsProcessed(state.iterations() * query_rows);
}

// The lower bound: one linear model.
void product(benchmark::State& state) {
  const bench::Sample& test = queries(state.range(1));
  const Eigen::VectorXd slope = Eigen::VectorXd::LinSpaced(state.range(1), -1.0, 1.0);
  Eigen::VectorXd predicted;
  for (auto _ : state) {
    predicted = (test.x * slope).array() + 0.5;
    benchmark::DoNotOptimize(predicted.data());
  }
  state.SetItemsProcessed(state.iterations() * query_rows);
}

void predict_crisp(benchmark::State& state) { predict(state, llmt::ValidityChoice::crisp); }
void predict_blend(benchmark::State& state) { predict(state, llmt::ValidityChoice::blend); }
void naive_crisp(benchmark::State& state) { naive(state, llmt::ValidityChoice::crisp); }
void naive_blend(benchmark::State& state) { naive(state, llmt::ValidityChoice::blend); }
void single_row_crisp(benchmark::State& state) { single_row(state, llmt::ValidityChoice::crisp); }
void single_row_blend(benchmark::State& state) { single_row(state, llmt::ValidityChoice::blend); }
void jacobian_crisp(benchmark::State& state) { jacobian_of_row(state, llmt::ValidityChoice::crisp); }
void jacobian_blend(benchmark::State& state) { jacobian_of_row(state, llmt::ValidityChoice::blend); }
void leverages_crisp(benchmark::State& state) { leverages(state, llmt::ValidityChoice::crisp); }
void leverages_blend(benchmark::State& state) { leverages(state, llmt::ValidityChoice::blend); }

void sizes(benchmark::internal::Benchmark* benchmark) {
  for (const std::int64_t inputs : {2, 10, 32}) {
    for (const std::int64_t leaves : {10, 100, 400}) {
      benchmark->Args({leaves, inputs, 1});
    }
    benchmark->Args({100, inputs, 2});
  }
  benchmark->Unit(benchmark::kMillisecond)->MeasureProcessCPUTime();
}

void one_size(benchmark::internal::Benchmark* benchmark) { benchmark->Args({100, 10, 1}); }

BENCHMARK(predict_crisp)->Apply(sizes);
BENCHMARK(predict_blend)->Apply(sizes);
BENCHMARK(product)->Args({1, 2, 1})->Args({1, 10, 1})->Args({1, 32, 1})->Unit(benchmark::kMillisecond);
BENCHMARK(naive_crisp)->Apply(one_size)->Unit(benchmark::kMillisecond);
BENCHMARK(naive_blend)->Apply(one_size)->Unit(benchmark::kMillisecond);
BENCHMARK(single_row_crisp)->Apply(one_size);
BENCHMARK(single_row_blend)->Apply(one_size);
BENCHMARK(jacobian_crisp)->Apply(one_size);
BENCHMARK(jacobian_blend)->Apply(one_size);
BENCHMARK(leverages_crisp)->Apply(one_size)->Unit(benchmark::kMillisecond)->MeasureProcessCPUTime();
BENCHMARK(leverages_blend)->Apply(one_size)->Unit(benchmark::kMillisecond)->MeasureProcessCPUTime();

}  // namespace
