#include "study/tasks.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <numbers>
#include <stdexcept>

#include "llmt/random.hpp"
#include "llmt/robotics/calibration.hpp"
#include "llmt/robotics/calibration_problem.hpp"
#include "llmt/robotics/robot_file.hpp"
#include "llmt/robotics/simulation.hpp"
#include "study/study.hpp"
#include "synthetic.hpp"

namespace bench {
namespace {

using Function = std::function<double(const Eigen::VectorXd& x)>;

double cross(const Eigen::VectorXd& x) {
  const double a = x(0) * x(0);
  const double b = x(1) * x(1);
  return std::max({std::exp(-10.0 * a), std::exp(-50.0 * b), 1.25 * std::exp(-5.0 * (a + b))});
}

double friedman(const Eigen::VectorXd& x) {
  return 10.0 * std::sin(std::numbers::pi * x(0) * x(1)) + 20.0 * (x(2) - 0.5) * (x(2) - 0.5) + 10.0 * x(3) +
         5.0 * x(4);
}

double ridge(const Eigen::VectorXd& x) {
  const double along = 0.5 * (x(0) + x(1) - x(2) + x(3));
  const double across = 0.5 * (x(0) - x(1) + x(3) - x(4));
  return std::tanh(4.0 * along) + 0.5 * std::exp(-4.0 * across * across);
}

Eigen::MatrixXd uniform(Eigen::Index rows, Eigen::Index inputs, double low, double high, llmt::Random& random) {
  Eigen::MatrixXd x(rows, inputs);
  for (Eigen::Index i = 0; i < rows; ++i) {
    for (Eigen::Index j = 0; j < inputs; ++j) x(i, j) = low + (high - low) * random.uniform();
  }
  return x;
}

// A grid over [low, 1]^2 with `side` rows along each input.
Eigen::MatrixXd square_grid(int side, double low) {
  Eigen::MatrixXd x(side * side, 2);
  const auto at = [&](int k) { return low + (1.0 - low) * k / (side - 1.0); };
  for (int i = 0; i < x.rows(); ++i) x.row(i) << at(i / side), at(i % side);
  return x;
}

Eigen::VectorXd values(const Function& truth, const Eigen::MatrixXd& x) {
  Eigen::VectorXd y(x.rows());
  for (Eigen::Index i = 0; i < x.rows(); ++i) y(i) = truth(x.row(i).transpose());
  return y;
}

std::vector<std::string> numbered(Eigen::Index inputs) {
  std::vector<std::string> names;
  for (Eigen::Index j = 1; j <= inputs; ++j) names.push_back(fmt::format("x{}", j));
  return names;
}

// Training rows uniform on [low, 1]^inputs; test rows a grid where there are two inputs, else uniform too.
Task known_truth(const std::string& name, Function truth, Eigen::Index rows, Eigen::Index inputs, double low,
                 double noise) {
  const auto trial = [=](int number) {
    llmt::Random random(static_cast<std::uint64_t>(number) + 1);
    Trial result;
    result.train_inputs = uniform(rows, inputs, low, 1.0, random);
    result.train_output = values(truth, result.train_inputs);
    for (double& y : result.train_output) y += noise * random.normal();
    result.test_inputs = inputs == 2 ? square_grid(41, low) : uniform(20000, inputs, low, 1.0, random);
    result.test_output = values(truth, result.test_inputs);
    return result;
  };
  return {name, numbered(inputs), 5, trial};
}

// The flexible planar arm of Benes et al. on its grids: x, or the residual of x that the calibrated rigid arm leaves.
Trial arm(bool residual) {
  namespace robotics = llmt::robotics;
  const robotics::Robot flexible = robotics::read_robot(std::string(LLMT_ROBOTS_DIR) + "/planar_two_link.yaml");
  const robotics::Poses train = robotics::grid(flexible.chain, 0.1);
  const robotics::Poses test = robotics::grid(flexible.chain, 0.05);
  Trial result{train.joints, robotics::positions(flexible, train).col(0), test.joints,
               robotics::positions(flexible, test).col(0)};
  if (residual) {
    robotics::Robot rigid = flexible;
    rigid.effects.clear();
    robotics::Measurements measurements;
    measurements.poses = train;
    measurements.positions_mm = robotics::positions(flexible, train);
    measurements.measured = {true, true, false};
    llmt::discovery::LeastSquaresProblem problem = robotics::calibration_problem(rigid, measurements);
    for (llmt::discovery::Parameter& parameter : problem.parameters) {
      parameter.free = parameter.name == "joint2.a" || parameter.name == "joint2.b" || parameter.name == "tool.x" ||
                       parameter.name == "tool.y";
    }
    const robotics::Robot calibrated =
        robotics::with_values(rigid, llmt::discovery::solve(problem, {.damping = 0.0}).values);
    result.train_output -= robotics::positions(calibrated, train).col(0);
    result.test_output -= robotics::positions(calibrated, test).col(0);
  }
  return result;
}

}  // namespace

std::vector<Task> known_truths() {
  return {known_truth("cross", cross, 500, 2, -1.0, 0.1),
          known_truth("friedman1", friedman, 2000, 10, 0.0, 1.0),
          known_truth("ridge", ridge, 2000, 5, -1.0, 0.05),
          known_truth("jumps", truth, 10000, 10, 0.0, 1.0),
          {"arm residual", numbered(2), 1, [](int) { return arm(true); }},
          {"arm x", numbered(2), 1, [](int) { return arm(false); }}};
}

void add_task_options(CLI::App& command, TaskChoice& choice) {
  command.add_option("tasks", choice.names, "names of known truths, or of data sets with --data; default: all");
  command.add_option("--data", choice.folder, "folder with NAME.csv and NAME.splits.csv")
      ->check(CLI::ExistingDirectory);
  command.add_option("--trials", choice.trials, "largest number of seeds or splits of a task")
      ->check(CLI::PositiveNumber)
      ->capture_default_str();
}

std::vector<Task> chosen_tasks(const TaskChoice& choice) {
  std::vector<Task> tasks;
  if (!choice.folder.empty()) {
    for (const std::string& name : choice.names.empty() ? data_set_names(choice.folder) : choice.names) {
      const auto set = std::make_shared<const DataSet>(read_data_set(choice.folder, name));
      const auto splits = static_cast<int>(set->splits());
      tasks.push_back({name, set->inputs, splits, [set](int split) { return set->trial(split); }});
    }
  } else if (choice.names.empty()) {
    tasks = known_truths();
  } else {
    const std::vector<Task> all = known_truths();
    for (const std::string& name : choice.names) {
      const auto found = std::ranges::find(all, name, &Task::name);
      if (found == all.end()) throw std::invalid_argument(fmt::format("no task '{}'; --data names a folder", name));
      tasks.push_back(*found);
    }
  }
  for (Task& task : tasks) task.trials = std::min(task.trials, choice.trials);
  return tasks;
}

}  // namespace bench
