// Reading tables: bytes of text per second of CPU time summed over the threads (that is, per core), and per second of
// wall time. Rivals in the same run: a bare loop of fast_float::from_chars over the same text, which knows where every
// number begins and checks nothing (upper bound); strtod; std::istream.
//
// Arguments: 0 = 17 significant digits, 1 = 5 significant digits, 2 = 17 digits in quotes / threads.
#include <benchmark/benchmark.h>
#include <fast_float/fast_float.h>
#include <fmt/format.h>

#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <map>
#include <sstream>
#include <string>

#include "llmt/csv.hpp"
#include "llmt/files.hpp"
#include "llmt/random.hpp"

namespace {

constexpr Eigen::Index rows = 1'000'000;
constexpr Eigen::Index columns = 11;

enum Style : std::int64_t { long_numbers, short_numbers, quoted_numbers };

std::string make_table(std::int64_t style) {
  std::string text;
  for (Eigen::Index column = 0; column < columns; ++column) {
    text += fmt::format("{}c{}", column == 0 ? "" : ",", column);
  }
  text += '\n';
  llmt::Random random(1);
  for (Eigen::Index row = 0; row < rows; ++row) {
    for (Eigen::Index column = 0; column < columns; ++column) {
      text += column == 0 ? "" : ",";
      const double value = 10.0 * random.normal();
      const auto out = std::back_inserter(text);
      if (style == long_numbers) {
        fmt::format_to(out, "{:.17g}", value);
      } else if (style == short_numbers) {
        fmt::format_to(out, "{:.5g}", value);
      } else {
        fmt::format_to(out, "\"{:.17g}\"", value);
      }
    }
    text += '\n';
  }
  return text;
}

const std::string& table(std::int64_t style) {
  static std::map<std::int64_t, std::string> tables;
  std::string& text = tables[style];
  if (text.empty()) text = make_table(style);
  return text;
}

void report(benchmark::State& state) {
  const std::int64_t bytes = std::ssize(table(state.range(0)));
  state.SetBytesProcessed(state.iterations() * bytes);
  state.counters["MB"] = 1e-6 * static_cast<double>(bytes);
}

// Finds where rows begin and checks that each has the number of fields of the header.
void find_rows(benchmark::State& state) {
  for (auto _ : state) {
    state.PauseTiming();
    std::string text = table(state.range(0));
    state.ResumeTiming();
    const llmt::Csv csv = llmt::Csv::parse(std::move(text), "table");
    benchmark::DoNotOptimize(csv.rows());
  }
  report(state);
}

// All columns as numbers, from rows that are known.
void numbers(benchmark::State& state) {
  const llmt::Csv csv = llmt::Csv::parse(table(state.range(0)), "table");
  for (auto _ : state) benchmark::DoNotOptimize(csv.numbers(csv.columns(), static_cast<int>(state.range(1))));
  report(state);
}

// Both of the above, from text in memory.
void rows_and_numbers(benchmark::State& state) {
  for (auto _ : state) {
    state.PauseTiming();
    std::string text = table(state.range(0));
    state.ResumeTiming();
    const llmt::Csv csv = llmt::Csv::parse(std::move(text), "table");
    benchmark::DoNotOptimize(csv.numbers(csv.columns(), static_cast<int>(state.range(1))));
  }
  report(state);
}

// The same from a file that is in the page cache.
void file_to_numbers(benchmark::State& state) {
  const std::string path = (std::filesystem::temp_directory_path() / "llmt_csv_bench.csv").string();
  llmt::write_file(path, table(state.range(0)));
  for (auto _ : state) {
    const llmt::Csv csv = llmt::Csv::read(path);
    benchmark::DoNotOptimize(csv.numbers(csv.columns(), static_cast<int>(state.range(1))));
  }
  std::filesystem::remove(path);
  report(state);
}

// One of eleven columns: the others are only skipped.
void last_column(benchmark::State& state) {
  const llmt::Csv csv = llmt::Csv::parse(table(state.range(0)), "table");
  for (auto _ : state) {
    benchmark::DoNotOptimize(
        csv.numbers(std::vector<std::string>{csv.columns().back()}, static_cast<int>(state.range(1))));
  }
  report(state);
}

// The first character of the first row, which begins a number.
const char* first_number(const std::string& text) { return text.data() + text.find('\n') + 1; }

void bare_from_chars(benchmark::State& state) {
  const std::string& text = table(state.range(0));
  const char* const end = text.data() + text.size();
  const Eigen::Index around = state.range(0) == quoted_numbers ? 1 : 0;
  Eigen::VectorXd values(rows * columns);
  for (auto _ : state) {
    const char* cursor = first_number(text);
    for (double& value : values) cursor = fast_float::from_chars(cursor + around, end, value).ptr + around + 1;
    benchmark::DoNotOptimize(values.data());
  }
  report(state);
}

void bare_strtod(benchmark::State& state) {
  const std::string& text = table(state.range(0));
  Eigen::VectorXd values(rows * columns);
  for (auto _ : state) {
    const char* cursor = first_number(text);
    for (double& value : values) {
      char* behind = nullptr;
      value = std::strtod(cursor, &behind);
      cursor = behind + 1;
    }
    benchmark::DoNotOptimize(values.data());
  }
  report(state);
}

void stream(benchmark::State& state) {
  std::istringstream in(table(state.range(0)).substr(table(state.range(0)).find('\n') + 1));
  Eigen::VectorXd values(rows * columns);
  for (auto _ : state) {
    in.clear();
    in.seekg(0);
    for (double& value : values) {
      in >> value;
      in.get();
    }
    benchmark::DoNotOptimize(values.data());
  }
  report(state);
}

void all_styles(benchmark::internal::Benchmark* benchmark) {
  for (const std::int64_t style : {long_numbers, short_numbers, quoted_numbers}) {
    benchmark->Args({style, 1});
  }
  benchmark->Unit(benchmark::kMillisecond)->MeasureProcessCPUTime();
}

void one_and_two_threads(benchmark::internal::Benchmark* benchmark) {
  for (const std::int64_t style : {long_numbers, short_numbers, quoted_numbers}) {
    benchmark->Args({style, 1})->Args({style, 2});
  }
  benchmark->Unit(benchmark::kMillisecond)->MeasureProcessCPUTime();
}

void without_quotes(benchmark::internal::Benchmark* benchmark) {
  benchmark->Args({long_numbers, 1})->Args({short_numbers, 1});
  benchmark->Unit(benchmark::kMillisecond)->MeasureProcessCPUTime();
}

BENCHMARK(bare_from_chars)->Apply(all_styles);
BENCHMARK(find_rows)->Apply(all_styles);
BENCHMARK(numbers)->Apply(one_and_two_threads);
BENCHMARK(rows_and_numbers)->Apply(one_and_two_threads);
BENCHMARK(file_to_numbers)->Apply(one_and_two_threads);
BENCHMARK(last_column)->Apply(all_styles);
BENCHMARK(bare_strtod)->Apply(without_quotes);
BENCHMARK(stream)->Apply(without_quotes);

}  // namespace
