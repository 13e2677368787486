// What monotone constraints cost in error and time on data sets with given splits.
//
// monotone_sets FOLDER SPLITS SET:COLUMN,-COLUMN,...: of every SET.csv in FOLDER (the target is the last column; every
// column of SET.splits.csv is a split, 1 = test, 0 = training) the mean test RMSE over the first SPLITS splits and the
// processor seconds of a fit with default options: without constraints, with the signs of slopes alone, with monotone
// predictions, and with monotone predictions by not splitting those inputs. A minus stands for a prediction that falls.
// Last the largest step against the constraint that lines through test rows, along each such input and beyond its
// extent, show with and without it.
#include <fmt/format.h>

#include <algorithm>
#include <cstdlib>
#include <ctime>
#include <sstream>

#include "llmt/csv.hpp"
#include "llmt/fit.hpp"

namespace {

struct Task {
  std::string name;
  std::vector<int> signs;
  Eigen::MatrixXd all;
  Eigen::MatrixXd is_test;
};

Task read_task(const std::string& folder, const std::string& argument) {
  Task task;
  const std::size_t colon = argument.find(':');
  task.name = argument.substr(0, colon);
  const llmt::Csv data = llmt::Csv::read(folder + "/" + task.name + ".csv");
  const llmt::Csv splits = llmt::Csv::read(folder + "/" + task.name + ".splits.csv");
  task.all = data.numbers(data.columns());
  task.is_test = splits.numbers(splits.columns());
  task.signs.resize(static_cast<std::size_t>(task.all.cols() - 1), 0);
  std::istringstream columns(argument.substr(colon + 1));
  for (std::string column; std::getline(columns, column, ',');) {
    const int sign = column.front() == '-' ? -1 : 1;
    task.signs[static_cast<std::size_t>(data.index_of(sign < 0 ? column.substr(1) : column))] = sign;
  }
  return task;
}

/// The largest fall of sign * prediction along lines through the rows.
double largest_fall(const llmt::Model& model, const Eigen::MatrixXd& rows, const std::vector<int>& signs) {
  constexpr Eigen::Index steps = 400;
  double largest = 0.0;
  for (Eigen::Index j = 0; j < rows.cols(); ++j) {
    const int sign = signs[static_cast<std::size_t>(j)];
    const llmt::InputColumn& input = model.inputs()[static_cast<std::size_t>(j)];
    for (Eigen::Index row = 0; sign != 0 && row < std::min<Eigen::Index>(rows.rows(), 300); ++row) {
      Eigen::MatrixXd line = rows.row(row).replicate(steps, 1);
      const double margin = 0.2 * (input.high - input.low);
      line.col(j) = Eigen::VectorXd::LinSpaced(steps, input.low - margin, input.high + margin);
      const Eigen::VectorXd values = sign * model.predict(line).col(0);
      double highest = values(0);
      for (const double value : values) {
        highest = std::max(highest, value);
        largest = std::max(largest, highest - value);
      }
    }
  }
  return largest;
}

void measure(const Task& task, Eigen::Index splits) {
  std::vector<llmt::FitOptions> methods(4);
  methods[1].slope_signs = methods[2].monotone = methods[3].monotone = task.signs;
  for (std::size_t j = 0; j < task.signs.size(); ++j) {
    if (task.signs[j] == 0) {
      methods[3].growth.split_inputs.push_back(static_cast<int>(j));
    }
  }
  const char* names[] = {"none", "signs of slopes", "monotone", "monotone, unsplit"};
  for (std::size_t m = 0; m < methods.size(); ++m) {
    double rmse = 0.0;
    double seconds = 0.0;
    double leaves = 0.0;
    double fall = 0.0;
    for (Eigen::Index split = 0; split < splits; ++split) {
      std::vector<Eigen::Index> train;
      std::vector<Eigen::Index> test;
      for (Eigen::Index row = 0; row < task.all.rows(); ++row) {
        (task.is_test(row, split) > 0.5 ? test : train).push_back(row);
      }
      const Eigen::Index inputs = task.all.cols() - 1;
      const Eigen::MatrixXd train_rows = task.all(train, Eigen::all);
      const Eigen::MatrixXd test_rows = task.all(test, Eigen::all);
      const std::clock_t start = std::clock();
      const llmt::FitResult fit = llmt::fit(train_rows.leftCols(inputs), train_rows.rightCols(1), methods[m]);
      seconds += static_cast<double>(std::clock() - start) / CLOCKS_PER_SEC;
      rmse += llmt::rmse(fit.model.predict(test_rows.leftCols(inputs)), test_rows.rightCols(1))(0);
      leaves += static_cast<double>(fit.summary.partitions[0].leaves);
      fall = std::max(fall, largest_fall(fit.model, test_rows.leftCols(inputs), task.signs));
    }
    const double count = static_cast<double>(splits);
    fmt::print("{:12} {:18} {:12.5g} {:8.1f} {:12.3f} {:14.3g}\n", task.name, names[m], rmse / count, leaves / count,
               seconds / count, fall);
    std::fflush(stdout);
  }
}

}  // namespace

int main(int argc, char** argv) {
  if (argc < 4) {
    fmt::print(stderr, "usage: monotone_sets FOLDER SPLITS SET:COLUMN,-COLUMN...\n");
    return 2;
  }
  try {
    fmt::print("{:12} {:18} {:>12} {:>8} {:>12} {:>14}\n", "data", "constraint", "test RMSE", "leaves", "CPU s a fit",
               "largest fall");
    for (int a = 3; a < argc; ++a) {
      const Task task = read_task(argv[1], argv[a]);
      measure(task, std::clamp<Eigen::Index>(std::atoi(argv[2]), 1, task.is_test.cols()));
    }
  } catch (const std::exception& error) {
    fmt::print(stderr, "monotone_sets: {}\n", error.what());
    return 1;
  }
  return 0;
}
