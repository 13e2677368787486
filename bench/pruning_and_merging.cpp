// What pruning by the weakest link and merging of leaves do to held-out errors, leaves, local models and time.
//
// pruning_and_merging FOLDER [NAME...]: on NAME.csv of FOLDER with its splits (see regression_sets; of tables with 2000
// rows and more the first one), and on generated data: cross (Schaal & Atkeson 1998, 500 rows, noise 0.1), friedman
// (Friedman 1991, 10 inputs, 2000 rows, noise 1) and synthetic (bench/synthetic.hpp, 10 inputs, 10000 rows, noise 1),
// whose errors are those from the truth on new points, means over 3 samples. Names may be those of generated data too;
// without names generated data alone.
#include <fmt/format.h>

#include <chrono>
#include <cmath>
#include <numbers>
#include <string>
#include <vector>

#include "llmt/csv.hpp"
#include "llmt/fit.hpp"
#include "synthetic.hpp"

namespace {

constexpr Eigen::Index small_table = 2000;

struct Task {
  Eigen::MatrixXd x;
  Eigen::MatrixXd y;
  Eigen::MatrixXd test_x;
  Eigen::MatrixXd test_y;
};

Task cross(std::uint64_t seed) {
  const auto truth = [](double a, double b) {
    return std::max({std::exp(-10.0 * a * a), std::exp(-50.0 * b * b), 1.25 * std::exp(-5.0 * (a * a + b * b))});
  };
  llmt::Random random(seed);
  Task task{Eigen::MatrixXd(500, 2), Eigen::MatrixXd(500, 1), Eigen::MatrixXd(1681, 2), Eigen::MatrixXd(1681, 1)};
  for (Eigen::Index i = 0; i < 500; ++i) {
    task.x.row(i) << random.uniform(-1.0, 1.0), random.uniform(-1.0, 1.0);
    task.y(i, 0) = truth(task.x(i, 0), task.x(i, 1)) + 0.1 * random.normal();
  }
  for (Eigen::Index i = 0; i < 1681; ++i) {
    task.test_x.row(i) << -1.0 + 0.05 * static_cast<double>(i % 41), -1.0 + 0.05 * static_cast<double>(i / 41);
    task.test_y(i, 0) = truth(task.test_x(i, 0), task.test_x(i, 1));
  }
  return task;
}

Task friedman(std::uint64_t seed) {
  const auto truth = [](const Eigen::VectorXd& x) {
    return 10.0 * std::sin(std::numbers::pi * x(0) * x(1)) + 20.0 * (x(2) - 0.5) * (x(2) - 0.5) + 10.0 * x(3) +
           5.0 * x(4);
  };
  llmt::Random random(seed);
  Task task{Eigen::MatrixXd(2000, 10), Eigen::MatrixXd(2000, 1), Eigen::MatrixXd(5000, 10), Eigen::MatrixXd(5000, 1)};
  for (auto* x : {&task.x, &task.test_x}) {
    for (double& value : x->reshaped()) {
      value = random.uniform();
    }
  }
  for (Eigen::Index i = 0; i < 2000; ++i) {
    task.y(i, 0) = truth(task.x.row(i).transpose()) + random.normal();
  }
  for (Eigen::Index i = 0; i < 5000; ++i) {
    task.test_y(i, 0) = truth(task.test_x.row(i).transpose());
  }
  return task;
}

Task synthetic(std::uint64_t seed) {
  bench::Sample train = bench::sample(10000, 10, seed);
  bench::Sample test = bench::sample(10000, 10, seed + 1000);
  return {std::move(train.x), std::move(train.y), std::move(test.x), std::move(test.truth)};
}

std::vector<Task> of_file(const std::string& folder, const std::string& name) {
  const llmt::Csv data = llmt::Csv::read(folder + "/" + name + ".csv");
  const llmt::Csv splits = llmt::Csv::read(folder + "/" + name + ".splits.csv");
  const Eigen::MatrixXd all = data.numbers(data.columns());
  const Eigen::MatrixXd is_test = splits.numbers(splits.columns());
  std::vector<Task> tasks;
  for (Eigen::Index split = 0; split < (all.rows() < small_table ? is_test.cols() : 1); ++split) {
    std::vector<Eigen::Index> train;
    std::vector<Eigen::Index> test;
    for (Eigen::Index row = 0; row < all.rows(); ++row) {
      (is_test(row, split) > 0.5 ? test : train).push_back(row);
    }
    const Eigen::MatrixXd train_rows = all(train, Eigen::all);
    const Eigen::MatrixXd test_rows = all(test, Eigen::all);
    const Eigen::Index inputs = all.cols() - 1;
    tasks.push_back(
        {train_rows.leftCols(inputs), train_rows.rightCols(1), test_rows.leftCols(inputs), test_rows.rightCols(1)});
  }
  return tasks;
}

std::vector<Task> tasks_of(const std::string& folder, const std::string& name) {
  std::vector<Task> tasks;
  for (std::uint64_t seed = 1; seed <= 3; ++seed) {
    if (name == "cross") {
      tasks.push_back(cross(seed));
    } else if (name == "friedman") {
      tasks.push_back(friedman(seed));
    } else if (name == "synthetic") {
      tasks.push_back(synthetic(seed));
    }
  }
  if (tasks.empty()) {
    return of_file(folder, name);
  }
  return tasks;
}

void measure(const std::string& name, const std::vector<Task>& tasks, llmt::ValidityChoice validity,
             llmt::Pruning pruning, bool merge_leaves, double significance) {
  double error = 0.0;
  double held_out = 0.0;
  double leaves = 0.0;
  double models = 0.0;
  double seconds = 0.0;
  for (const Task& task : tasks) {
    llmt::FitOptions options;
    options.blend.validity = validity;
    options.growth.significance = significance;
    options.growth.pruning = pruning;
    options.growth.merge_leaves = merge_leaves;
    options.intervals = false;
    const auto start = std::chrono::steady_clock::now();
    const llmt::FitResult result = llmt::fit(task.x, task.y, options);
    const double part = 1.0 / static_cast<double>(tasks.size());
    seconds += part * std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
    error += part * llmt::rmse(result.model.predict(task.test_x), task.test_y)(0);
    const llmt::PartitionSummary& summary = result.summary.partitions.front();
    held_out += part * summary.chosen.rmse;
    leaves += part * static_cast<double>(summary.leaves);
    models += part * static_cast<double>(summary.local_models);
  }
  const bool is_crisp = validity == llmt::ValidityChoice::crisp;
  fmt::print("{:10} {:6} {:8} {:13} {:7} {:10.5g} {:10.5g} {:8.1f} {:8.1f} {:8.2f}\n", name,
             is_crisp ? "crisp" : "blend",
             is_crisp && significance < 0.0 && pruning == llmt::Pruning::last_splits ? "F test" : "no test",
             pruning == llmt::Pruning::weakest_link ? "weakest link" : "last splits", merge_leaves ? "merged" : "",
             error, held_out, leaves, models, seconds);
  std::fflush(stdout);
}

}  // namespace

int main(int argc, char** argv) {
  if (argc < 2) {
    fmt::print(stderr, "usage: pruning_and_merging FOLDER [NAME...]\n");
    return 2;
  }
  try {
    std::vector<std::string> names(argv + 2, argv + argc);
    if (names.empty()) {
      names = {"cross", "friedman", "synthetic"};
    }
    fmt::print("{:10} {:6} {:8} {:13} {:7} {:>10} {:>10} {:>8} {:>8} {:>8}\n", "data", "", "growth", "pruning", "",
               "test RMSE", "CV RMSE", "leaves", "models", "s");
    for (const std::string& name : names) {
      const std::vector<Task> tasks = tasks_of(argv[1], name);
      using llmt::Pruning;
      using llmt::ValidityChoice;
      for (const bool merge_leaves : {false, true}) {
        measure(name, tasks, ValidityChoice::crisp, Pruning::last_splits, merge_leaves, -1.0);
        if (!merge_leaves) {
          measure(name, tasks, ValidityChoice::crisp, Pruning::last_splits, false, 1.0);
        }
        measure(name, tasks, ValidityChoice::crisp, Pruning::weakest_link, merge_leaves, -1.0);
      }
      for (const bool merge_leaves : {false, true}) {
        measure(name, tasks, ValidityChoice::blend, Pruning::last_splits, merge_leaves, -1.0);
        measure(name, tasks, ValidityChoice::blend, Pruning::weakest_link, merge_leaves, -1.0);
      }
    }
  } catch (const std::exception& error) {
    fmt::print(stderr, "pruning_and_merging: {}\n", error.what());
    return 1;
  }
  return 0;
}
