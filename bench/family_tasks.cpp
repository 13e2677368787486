#include "family_tasks.hpp"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <memory>
#include <numbers>

#include "llmt/csv.hpp"
#include "llmt/random.hpp"
#include "llmt/robotics/calibration.hpp"
#include "llmt/robotics/robot_file.hpp"
#include "llmt/robotics/simulation.hpp"
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
    for (Eigen::Index j = 0; j < inputs; ++j) {
      x(i, j) = low + (high - low) * random.uniform();
    }
  }
  return x;
}

Eigen::VectorXd values(const Function& truth, const Eigen::MatrixXd& x) {
  Eigen::VectorXd y(x.rows());
  for (Eigen::Index i = 0; i < x.rows(); ++i) {
    y(i) = truth(x.row(i).transpose());
  }
  return y;
}

/// Rows uniform on [low, high]^inputs; the test rows a grid where there are two inputs.
Task task(const std::string& name, Function truth, Eigen::Index rows, Eigen::Index inputs, double low, double noise) {
  const auto trial = [=](int seed) {
    llmt::Random random(static_cast<std::uint64_t>(seed) + 1);
    Trial result;
    result.train_inputs = uniform(rows, inputs, low, 1.0, random);
    result.train_output = values(truth, result.train_inputs);
    for (double& y : result.train_output) {
      y += noise * random.normal();
    }
    if (inputs == 2) {
      constexpr int side = 41;
      result.test_inputs.resize(side * side, 2);
      for (Eigen::Index i = 0; i < side * side; ++i) {
        result.test_inputs.row(i) << low + (1.0 - low) * static_cast<double>(i / side) / (side - 1.0),
            low + (1.0 - low) * static_cast<double>(i % side) / (side - 1.0);
      }
    } else {
      result.test_inputs = uniform(20000, inputs, low, 1.0, random);
    }
    result.test_output = values(truth, result.test_inputs);
    return result;
  };
  return {name, 5, trial};
}

/// The flexible planar arm of Benes et al. on its grids: what the calibrated rigid arm leaves of x, or x itself.
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
  std::vector<Task> tasks = {task("cross", cross, 500, 2, -1.0, 0.1), task("friedman1", friedman, 2000, 10, 0.0, 1.0),
                             task("ridge", ridge, 2000, 5, -1.0, 0.05), task("jumps", truth, 10000, 10, 0.0, 1.0)};
  tasks.push_back({"arm residual", 1, [](int) { return arm(true); }});
  tasks.push_back({"arm x", 1, [](int) { return arm(false); }});
  return tasks;
}

std::vector<Task> given_sets(const std::string& folder) {
  std::vector<Task> tasks;
  for (const auto& entry : std::filesystem::directory_iterator(folder)) {
    const std::string file = entry.path().filename().string();
    const std::size_t end = file.find(".splits.csv");
    if (end == std::string::npos) {
      continue;
    }
    const std::string name = file.substr(0, end);
    const llmt::Csv data = llmt::Csv::read(folder + "/" + name + ".csv");
    const llmt::Csv splits = llmt::Csv::read(folder + "/" + file);
    const auto all = std::make_shared<Eigen::MatrixXd>(data.numbers(data.columns()));
    const auto is_test = std::make_shared<Eigen::MatrixXd>(splits.numbers(splits.columns()));
    const auto trial = [all, is_test](int split) {
      std::vector<Eigen::Index> train;
      std::vector<Eigen::Index> test;
      for (Eigen::Index row = 0; row < all->rows(); ++row) {
        ((*is_test)(row, split) > 0.5 ? test : train).push_back(row);
      }
      const Eigen::Index inputs = all->cols() - 1;
      return Trial{(*all)(train, Eigen::seqN(0, inputs)), (*all)(train, inputs), (*all)(test, Eigen::seqN(0, inputs)),
                   (*all)(test, inputs)};
    };
    tasks.push_back({name, static_cast<int>(is_test->cols()), trial});
  }
  std::sort(tasks.begin(), tasks.end(), [](const Task& a, const Task& b) { return a.name < b.name; });
  return tasks;
}

}  // namespace bench
