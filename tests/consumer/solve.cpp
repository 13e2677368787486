// Fits the slope of y = 3 t from 20 points by llmt::discovery.
#include <cmath>
#include <iostream>

#include "llmt/discovery/least_squares.hpp"

int main() {
  const Eigen::VectorXd t = Eigen::VectorXd::LinSpaced(20, 0.0, 1.0);
  llmt::discovery::LeastSquaresProblem problem;
  problem.parameters = {{.name = "slope", .unit = "1"}};
  problem.residual = [&](const Eigen::VectorXd& slope) -> Eigen::VectorXd { return (slope(0) - 3.0) * t; };
  problem.jacobian = [&](const Eigen::VectorXd&) -> Eigen::MatrixXd { return t; };
  const llmt::discovery::SolverResult result = llmt::discovery::solve(problem);
  std::cout << "slope " << result.values(0) << '\n';
  const bool right = std::abs(result.values(0) - 3.0) < 1e-9;
  std::cout << (right ? "consumer ok" : "wrong slope") << '\n';
  return right ? 0 : 1;
}
