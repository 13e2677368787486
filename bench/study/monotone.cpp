// What monotone constraints cost in error and time: mean test RMSE over the trials and CPU seconds per fit with default
// options, without constraints, with the signs of slopes alone, with monotone predictions, and with monotone
// predictions by not splitting the constrained inputs. The last column is the largest step against the constraint along
// lines through test rows, one line for each constrained input, 20 % of the training extent beyond both of its ends.
#include <fmt/format.h>

#include <algorithm>
#include <memory>
#include <optional>
#include <stdexcept>

#include "llmt/fit.hpp"
#include "resources.hpp"
#include "study/study.hpp"

namespace bench {
namespace {

// The argument TASK:COLUMN,-COLUMN,...; a minus stands for a prediction that falls.
struct Constrained {
  Task task;
  std::vector<int> signs;  // of the inputs
};

Constrained constrained(const std::string& argument, TaskChoice choice) {
  const std::size_t colon = argument.find(':');
  if (colon == std::string::npos) throw std::invalid_argument(argument + ": no ':' before the names of the columns");
  choice.names = {argument.substr(0, colon)};
  Constrained result{chosen_tasks(choice).front(), {}};
  const std::vector<std::string>& inputs = result.task.inputs;
  result.signs.resize(inputs.size(), 0);
  for (const std::string& column : CLI::detail::split(argument.substr(colon + 1), ',')) {
    const bool falls = column.starts_with('-');
    const auto found = std::ranges::find(inputs, falls ? column.substr(1) : column);
    if (found == inputs.end()) throw std::invalid_argument(fmt::format("{}: no input '{}'", argument, column));
    result.signs[found - inputs.begin()] = falls ? -1 : 1;
  }
  return result;
}

double largest_fall(const Eigen::VectorXd& values) {
  double largest = 0.0, highest = values(0);
  for (const double value : values) {
    highest = std::max(highest, value);
    largest = std::max(largest, highest - value);
  }
  return largest;
}

// Of sign * prediction, along lines through the first 300 rows.
double largest_fall(const llmt::Model& model, const Eigen::MatrixXd& rows, const std::vector<int>& signs) {
  constexpr Eigen::Index steps = 400;
  double largest = 0.0;
  for (Eigen::Index j = 0; j < rows.cols(); ++j) {
    if (signs[j] == 0) continue;
    const llmt::InputColumn& input = model.inputs()[j];
    const double margin = 0.2 * (input.high - input.low);
    for (Eigen::Index row = 0; row < std::min<Eigen::Index>(rows.rows(), 300); ++row) {
      Eigen::MatrixXd line = rows.row(row).replicate(steps, 1);
      line.col(j) = Eigen::VectorXd::LinSpaced(steps, input.low - margin, input.high + margin);
      largest = std::max(largest, largest_fall(Eigen::VectorXd(signs[j] * model.predict(line).col(0))));
    }
  }
  return largest;
}

struct Method {
  const char* name;
  llmt::FitOptions options;
};

std::vector<Method> methods(const std::vector<int>& signs) {
  using llmt::Trend;
  llmt::FitOptions slopes, monotone;
  for (const int sign : signs) {
    slopes.trends.push_back(sign > 0 ? Trend::rising_slopes : sign < 0 ? Trend::falling_slopes : Trend::any);
    monotone.trends.push_back(sign > 0 ? Trend::rising : sign < 0 ? Trend::falling : Trend::any);
  }
  llmt::FitOptions unsplit = monotone;
  for (int j = 0; j < std::ssize(signs); ++j) {
    if (signs[j] == 0) unsplit.split_inputs.push_back(j);
  }
  return {{"none", {}}, {"signs of slopes", slopes}, {"monotone", monotone}, {"monotone, unsplit", unsplit}};
}

void study_method(const Constrained& constrained, const Method& method) {
  const Task& task = constrained.task;
  double rmse = 0.0, seconds = 0.0, leaves = 0.0, fall = 0.0;
  for (int t = 0; t < task.trials; ++t) {
    const Trial trial = task.trial(t);
    std::optional<llmt::FitResult> fit;
    seconds += measure([&] { fit = llmt::fit(trial.train_inputs, trial.train_output, method.options); }).cpu;
    rmse += llmt::rmse(fit->model.predict(trial.test_inputs), trial.test_output)(0);
    leaves += static_cast<double>(fit->summary.partitions[0].leaves);
    fall = std::max(fall, largest_fall(fit->model, trial.test_inputs, constrained.signs));
  }
  const double count = task.trials;
  fmt::print("{:12} {:18} {:12.5g} {:8.1f} {:12.3f} {:14.3g}\n", task.name, method.name, rmse / count, leaves / count,
             seconds / count, fall);
  std::fflush(stdout);
}

}  // namespace

void add_monotone(CLI::App& study) {
  const auto choice = std::make_shared<TaskChoice>();
  CLI::App* command = study.add_subcommand("monotone", "What monotone constraints cost");
  add_task_options(*command, *choice);
  command->get_option("tasks")->required()->description("TASK:COLUMN,-COLUMN,...; -COLUMN: the prediction falls");
  command->callback([choice] {
    fmt::print("{:12} {:18} {:>12} {:>8} {:>12} {:>14}\n", "data", "constraint", "test RMSE", "leaves", "CPU s a fit",
               "largest fall");
    for (const std::string& argument : choice->names) {
      const Constrained task = constrained(argument, *choice);
      for (const Method& method : methods(task.signs)) study_method(task, method);
    }
  });
}

}  // namespace bench
