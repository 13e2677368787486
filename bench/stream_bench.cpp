// What llmt::Stream learns from the synthetic function of bench/synthetic.hpp, and what it costs.
//
// stream_bench scaling [ROWS...]       error to the truth on 100000 fresh rows, time and memory after one pass
// stream_bench rules [ROWS]            streams beside the batch fit of the reservoir's number of rows
// stream_bench drift [SEEDS]           recovery after the function has changed, beside a fresh stream
// stream_bench spread [ROWS] [SEEDS]   mean and spread of that error over streams, no snapshot
// stream_bench alarms [SEEDS] [ROWS]   alarms where nothing changes
// stream_bench sets FOLDER [PASSES] [SPLITS]  test R2 on data sets with given splits, see regression_sets.cpp
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <numeric>
#include <set>
#include <string>

#include "llmt/csv.hpp"
#include "llmt/stream.hpp"
#include "resources.hpp"
#include "synthetic.hpp"

namespace {

constexpr Eigen::Index block = 10000;
constexpr Eigen::Index num_inputs = 10;

double rmse_to_truth(const llmt::Model& model, const bench::Sample& test) {
  return std::sqrt((model.predict(test.x) - test.truth).squaredNorm() / static_cast<double>(test.truth.size()));
}

/// Fresh rows in blocks, so that memory is that of the stream.
struct Pass {
  double seconds = 0.0;
  void run(llmt::Stream& stream, Eigen::Index rows, std::uint64_t seed) {
    for (Eigen::Index done = 0; done < rows; done += block) {
      const bench::Sample sample = bench::sample(std::min(block, rows - done), num_inputs,
                                                 seed + 1000003ULL * static_cast<std::uint64_t>(done / block));
      seconds += bench::measure([&] { stream.add(sample.x, sample.y); }).cpu;
    }
  }
};

void report(const std::string& name, Eigen::Index rows, const llmt::StreamOptions& options, const bench::Sample& test) {
  llmt::Stream stream(num_inputs, 1, options);
  Pass pass;
  pass.run(stream, rows, 1);
  const llmt::StreamCounts counts = stream.counts();
  double crisp = 0.0;
  double chosen = 0.0;
  std::ptrdiff_t leaves = 0;
  const bench::Cost cost = bench::measure([&] {
    const llmt::Model model = stream.snapshot();
    leaves = model.partitions().front().num_leaves();
    chosen = rmse_to_truth(model, test);
  });
  crisp = rmse_to_truth(stream.snapshot(llmt::ValidityChoice::crisp), test);
  fmt::print("{:8} {:>9} {:10.4f} {:10.4f} {:12.4f} {:7} {:7} {:7} {:7} {:7} {:9.0f} {:9.2f} {:10.1f} {:10.1f}\n", name,
             rows, chosen, crisp, stream.prequential_rmse()(0), leaves, counts.leaves, counts.splits, counts.prunes,
             counts.drifts, 1e9 * pass.seconds / static_cast<double>(rows), cost.cpu,
             static_cast<double>(counts.bytes) / 1048576.0, bench::peak_memory() / 1048576.0);
}

void header() {
  fmt::print("{:8} {:>9} {:>10} {:>10} {:>12} {:>7} {:>7} {:>7} {:>7} {:>7} {:>9} {:>9} {:>10} {:>10}\n", "rule",
             "rows", "snapshot", "crisp", "prequential", "leaves", "grown", "splits", "prunes", "drifts", "ns/row",
             "snap. s", "own MiB", "peak MiB");
}

void scaling(const std::vector<Eigen::Index>& sizes) {
  const bench::Sample test = bench::sample(100000, num_inputs, 999);
  header();
  for (const Eigen::Index rows : sizes) {
    report("rd", rows, {}, test);
  }
}

void rules(Eigen::Index rows) {
  const bench::Sample test = bench::sample(100000, num_inputs, 999);
  header();
  for (const Eigen::Index n : {rows / 100, rows / 10, rows}) {
    report("rd", n, {}, test);
  }
  const bench::Sample train = bench::sample(20000, num_inputs, 1);
  const bench::Cost cost = bench::measure(
      [&] { fmt::print("fit() on 20000 rows: {:.4f}", rmse_to_truth(llmt::fit(train.x, train.y).model, test)); });
  fmt::print(", {:.1f} CPU s\n", cost.cpu);
}

/// Ways in which the function changes.
enum class Change { permuted, negated, half, shifted };
constexpr std::array<const char*, 4> change_names = {"permuted", "negated", "half", "shifted"};

double changed_truth(const Eigen::VectorXd& x, Change change) {
  switch (change) {
    case Change::permuted:
      return bench::truth(x.reverse());
    case Change::negated:
      return -bench::truth(x);
    case Change::half:
      return x(0) < 0.4 ? bench::truth(x) : 4.0 - bench::truth(x);
    case Change::shifted:
      return bench::truth(x) + 5.0;
  }
  return 0.0;
}

void change_outputs(bench::Sample& sample, Change change) {
  for (Eigen::Index i = 0; i < sample.y.size(); ++i) {
    const double truth = changed_truth(sample.x.row(i).transpose(), change);
    sample.y(i) += truth - sample.truth(i);
    sample.truth(i) = truth;
  }
}

double error_of(const llmt::Stream& stream, const bench::Sample& test) {
  return std::sqrt((stream.predict(test.x) - test.truth).squaredNorm() / static_cast<double>(test.truth.size()));
}

/// How many rows after the change until the error to the truth is within 5 % of what a fresh stream has after N rows,
/// as a multiple of N.
void drift(int seeds) {
  const std::vector<Eigen::Index> levels = {1000, 5000, 20000, 100000};
  const std::vector<Eigen::Index> changes_at = {20000, 200000};
  const Eigen::Index horizon = 2 * levels.back();
  fmt::print("{:9} {:>8} {:>5} {:>7} {:>8} |", "change", "at row", "seed", "alarms", "replaced");
  for (const Eigen::Index level : levels) {
    fmt::print(" {:>8} {:>8} {:>6} |", fmt::format("N={}", level), "stream", "rows/N");
  }
  fmt::print("   (errors: fresh after N rows, stream after N rows; rows until within 5 % / N)\n");
  for (const Change change : {Change::permuted, Change::negated, Change::half, Change::shifted}) {
    bench::Sample test = bench::sample(10000, num_inputs, 999);
    change_outputs(test, change);
    for (const Eigen::Index at : changes_at) {
      Eigen::VectorXd mean_stream;
      Eigen::VectorXd mean_fresh;
      std::vector<Eigen::Index> rows;
      for (int seed = 1; seed <= seeds; ++seed) {
        llmt::Stream stream(num_inputs, 1);
        llmt::Stream fresh(num_inputs, 1);
        Pass pass;
        pass.run(stream, at, static_cast<std::uint64_t>(seed));
        const std::ptrdiff_t before = stream.counts().drifts;
        rows.clear();
        std::vector<double> of_stream;
        std::vector<double> of_fresh;
        Eigen::Index done = 0;
        for (Eigen::Index next = 500; done < horizon; next = std::max(next + 500, next * 11 / 10)) {
          // Every level is a point of the curve.
          for (const Eigen::Index level : levels) {
            next = done < level && next > level ? level : next;
          }
          next = std::min(next, horizon);
          bench::Sample sample = bench::sample(next - done, num_inputs, static_cast<std::uint64_t>(7777 * seed + next));
          change_outputs(sample, change);
          stream.add(sample.x, sample.y);
          fresh.add(sample.x, sample.y);
          done = next;
          rows.push_back(done);
          of_stream.push_back(error_of(stream, test));
          of_fresh.push_back(error_of(fresh, test));
        }
        const llmt::StreamCounts counts = stream.counts();
        fmt::print("{:9} {:>8} {:>5} {:>7} {:>8} |", change_names[static_cast<std::size_t>(change)], at, seed,
                   counts.drifts - before, counts.replacements);
        const Eigen::Map<const Eigen::VectorXd> stream_curve(of_stream.data(), std::ssize(of_stream));
        const Eigen::Map<const Eigen::VectorXd> fresh_curve(of_fresh.data(), std::ssize(of_fresh));
        if (seed == 1) {
          mean_stream = mean_fresh = Eigen::VectorXd::Zero(std::ssize(of_stream));
        }
        mean_stream += stream_curve / seeds;
        mean_fresh += fresh_curve / seeds;
        for (const Eigen::Index level : levels) {
          const std::size_t k = static_cast<std::size_t>(std::find(rows.begin(), rows.end(), level) - rows.begin());
          const auto reached = std::find_if(of_stream.begin(), of_stream.end(),
                                            [&](double error) { return error <= 1.05 * of_fresh[k]; });
          fmt::print(" {:8.4f} {:8.4f} {:>6} |", of_fresh[k], of_stream[k],
                     reached == of_stream.end()
                         ? fmt::format(">{:.0f}", static_cast<double>(horizon) / static_cast<double>(level))
                         : fmt::format("{:.2f}", static_cast<double>(
                                                     rows[static_cast<std::size_t>(reached - of_stream.begin())]) /
                                                     static_cast<double>(level)));
        }
        fmt::print("\n");
      }
      fmt::print("{:9} {:>8} {:>5} {:>16} |", change_names[static_cast<std::size_t>(change)], at, "mean", "");
      for (const Eigen::Index level : levels) {
        const Eigen::Index k = std::find(rows.begin(), rows.end(), level) - rows.begin();
        Eigen::Index reached = 0;
        while (reached < mean_stream.size() && mean_stream(reached) > 1.05 * mean_fresh(k)) {
          ++reached;
        }
        fmt::print(" {:8.4f} {:8.4f} {:>6} |", mean_fresh(k), mean_stream(k),
                   reached == mean_stream.size()
                       ? fmt::format(">{:.0f}", static_cast<double>(horizon) / static_cast<double>(level))
                       : fmt::format("{:.2f}", static_cast<double>(rows[static_cast<std::size_t>(reached)]) /
                                                   static_cast<double>(level)));
      }
      fmt::print("\n");
    }
  }
}

/// Error of the live tree to the truth over several streams.
void spread(Eigen::Index rows, int seeds) {
  const bench::Sample test = bench::sample(20000, num_inputs, 999);
  Eigen::VectorXd errors(seeds);
  for (int seed = 1; seed <= seeds; ++seed) {
    llmt::Stream stream(num_inputs, 1);
    Pass pass;
    pass.run(stream, rows, static_cast<std::uint64_t>(seed));
    errors(seed - 1) = error_of(stream, test);
  }
  fmt::print("{} rows, {} streams: error to the truth {:.4f} +- {:.4f}, {:.4f} ... {:.4f}\n", rows, seeds,
             errors.mean(), std::sqrt((errors.array() - errors.mean()).square().mean()), errors.minCoeff(),
             errors.maxCoeff());
}

void alarms(int seeds, Eigen::Index rows) {
  std::ptrdiff_t drifts = 0;
  std::ptrdiff_t streams = 0;
  for (int seed = 1; seed <= seeds; ++seed) {
    llmt::Stream stream(num_inputs, 1);
    Pass pass;
    pass.run(stream, rows, static_cast<std::uint64_t>(100 + seed));
    drifts += stream.counts().drifts;
    streams += stream.counts().drifts > 0 ? 1 : 0;
  }
  fmt::print("{} alarms in {} of {} streams of {} rows without a change\n", drifts, streams, seeds, rows);
}

void sets(const std::string& folder, int passes, int most_splits) {
  std::set<std::string> names;
  for (const auto& entry : std::filesystem::directory_iterator(folder)) {
    const std::string file = entry.path().filename().string();
    if (const std::size_t end = file.find(".splits.csv"); end != std::string::npos) {
      names.insert(file.substr(0, end));
    }
  }
  fmt::print("{:12} {:>9} {:>9} {:>9} {:>7} {:>9} {:>8}\n", "data", "R2", "R2 crisp", "R2 LS", "leaves", "RMSE", "s");
  std::vector<double> all_r2;
  for (const std::string& name : names) {
    const llmt::Csv data = llmt::Csv::read(folder + "/" + name + ".csv");
    const llmt::Csv splits = llmt::Csv::read(folder + "/" + name + ".splits.csv");
    const Eigen::MatrixXd all = data.numbers(data.columns());
    const Eigen::MatrixXd is_test = splits.numbers(splits.columns());
    const Eigen::Index inputs = all.cols() - 1;
    const Eigen::Index count = std::min<Eigen::Index>(is_test.cols(), most_splits);
    double r2 = 0.0;
    double r2_crisp = 0.0;
    double r2_linear = 0.0;
    double leaves = 0.0;
    double error = 0.0;
    double seconds = 0.0;
    for (Eigen::Index split = 0; split < count; ++split) {
      std::vector<Eigen::Index> train;
      std::vector<Eigen::Index> test;
      for (Eigen::Index row = 0; row < all.rows(); ++row) {
        (is_test(row, split) > 0.5 ? test : train).push_back(row);
      }
      const Eigen::MatrixXd test_rows = all(test, Eigen::all);
      llmt::Random random(static_cast<std::uint64_t>(split) + 1);
      llmt::Stream stream(inputs, 1);
      const double part = 1.0 / static_cast<double>(count);
      const auto r2_of = [&](const Eigen::VectorXd& predicted) {
        const Eigen::VectorXd y = test_rows.rightCols(1);
        return 1.0 - (predicted - y).squaredNorm() / (y.array() - y.mean()).square().sum();
      };
      seconds += part * bench::measure([&] {
                          for (int pass = 0; pass < passes; ++pass) {
                            const std::vector<std::ptrdiff_t> order = random.permutation(std::ssize(train));
                            Eigen::MatrixXd rows(std::ssize(train), all.cols());
                            for (std::size_t i = 0; i < train.size(); ++i) {
                              rows.row(static_cast<Eigen::Index>(i)) =
                                  all.row(train[static_cast<std::size_t>(order[i])]);
                            }
                            stream.add(rows.leftCols(inputs), rows.rightCols(1));
                          }
                          const llmt::Model model = stream.snapshot();
                          leaves += part * static_cast<double>(model.partitions().front().num_leaves());
                          const Eigen::VectorXd predicted = model.predict(test_rows.leftCols(inputs));
                          r2 += part * r2_of(predicted);
                          error += part * llmt::rmse(predicted, test_rows.rightCols(1))(0);
                        }).cpu;
      r2_crisp += part * r2_of(stream.snapshot(llmt::ValidityChoice::crisp).predict(test_rows.leftCols(inputs)));
      llmt::FitOptions one_leaf;
      one_leaf.growth.max_leaves = 1;
      one_leaf.selection.folds.count = 0;
      const Eigen::MatrixXd train_rows = all(train, Eigen::all);
      r2_linear += part * r2_of(llmt::fit(train_rows.leftCols(inputs), train_rows.rightCols(1), one_leaf)
                                    .model.predict(test_rows.leftCols(inputs)));
    }
    all_r2.push_back(r2);
    fmt::print("{:12} {:9.4f} {:9.4f} {:9.4f} {:7.1f} {:9.4g} {:8.3f}\n", name, r2, r2_crisp, r2_linear, leaves, error,
               seconds);
  }
  std::sort(all_r2.begin(), all_r2.end());
  fmt::print("median of {} sets: {:.4f}\n", all_r2.size(),
             0.5 * (all_r2[(all_r2.size() - 1) / 2] + all_r2[all_r2.size() / 2]));
}

}  // namespace

int main(int argc, char** argv) {
  const std::string what = argc > 1 ? argv[1] : "";
  const auto number = [&](int at, long otherwise) { return argc > at ? std::stol(argv[at]) : otherwise; };
  if (what == "scaling") {
    std::vector<Eigen::Index> sizes;
    for (int k = 2; k < argc; ++k) {
      sizes.push_back(std::stol(argv[k]));
    }
    scaling(sizes.empty() ? std::vector<Eigen::Index>{100000, 1000000} : sizes);
  } else if (what == "rules") {
    rules(number(2, 1000000));
  } else if (what == "drift") {
    drift(static_cast<int>(number(2, 3)));
  } else if (what == "spread") {
    spread(number(2, 100000), static_cast<int>(number(3, 10)));
  } else if (what == "alarms") {
    alarms(static_cast<int>(number(2, 20)), number(3, 100000));
  } else if (what == "sets" && argc > 2) {
    sets(argv[2], static_cast<int>(number(3, 1)), static_cast<int>(number(4, 5)));
  } else {
    fmt::print(stderr, "usage: stream_bench scaling|rules|drift|alarms|sets ...\n");
    return 2;
  }
  return 0;
}
