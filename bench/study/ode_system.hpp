/// \file
/// Ordinary differential equations as a file lists them, and their right-hand sides term by term.
#pragma once

#include <Eigen/Core>
#include <string>
#include <vector>

#include "expressions/expression.hpp"

namespace bench {

/// The summands of an expression, brackets that hold a sum multiplied out: `a * (b - c) / d` has `a*(b)/d` and
/// `-a*(c)/d`. Sums below a fraction bar, in a power or in a function stay as they are.
std::vector<std::string> summands(const std::string& expression);

/// A function of the states x_0, x_1, ...
class StateFunction {
 public:
  StateFunction(const std::string& text, const std::map<std::string, double>& constants);
  double at(const Eigen::VectorXd& state);

 private:
  llmt::Expression expression_;
  std::vector<Eigen::Index> states_;  // of the variables
  std::vector<double> values_;
};

struct OdeTerm {
  std::string text;
  StateFunction function;
};

/// dx_i/dt = sum of the terms of component i.
struct OdeSystem {
  int id = 0;
  std::vector<std::vector<OdeTerm>> components;
  std::vector<Eigen::VectorXd> starts;

  Eigen::VectorXd derivative(const Eigen::VectorXd& state);
};

/// The systems of a JSON file: a list of objects with `id`, `eq` (components separated by |, states x_0 ..., constants
/// c_0 ...), `consts` (of which the first set is taken) and `init`. Throws std::runtime_error naming the file and the
/// system.
std::vector<OdeSystem> read_odes(const std::string& file);

/// States at the times 0, step, ... 10 from each start, one a row; a trajectory ends where it is not finite.
Eigen::MatrixXd trajectories(OdeSystem& system);

}  // namespace bench
