#include "dynamics/output_error.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "base/decompositions.hpp"
#include "dynamics/one_step.hpp"
#include "dynamics/sensitivities.hpp"

namespace llmt {
namespace {

// Weight of the square of each parameter in the cost.
Eigen::VectorXd penalties(const DynamicParts& parts, const Eigen::VectorXd& scale, double weight) {
  const std::vector<bool> beyond = are_beyond_linear(parts);
  Eigen::VectorXd penalty = Eigen::VectorXd::Zero(std::ssize(beyond));
  const Eigen::Index per_output = penalty.size() / scale.size();
  for (Eigen::Index k = 0; k < penalty.size(); ++k) {
    const Eigen::Index output = std::min<Eigen::Index>(per_output > 0 ? k / per_output : 0, scale.size() - 1);
    if (beyond[k] && weight > 0.0) penalty(k) = weight / (scale(output) * scale(output));
  }
  return penalty;
}

}  // namespace

OutputErrorResult estimate_on_runs(const DynamicParts& start, const Series& series, const std::vector<Window>& windows,
                                   const Eigen::VectorXd& scale, const OutputErrorOptions& options) {
  OutputErrorResult best{start, std::numeric_limits<double>::infinity(), 0};
  Eigen::VectorXd parameters = parameters_of(start);
  if (parameters.size() == 0) return best;  // too few rows for a tree, and no polynomial
  double rows = 0.0;
  for (const Window& window : windows) rows += static_cast<double>((window.end - window.first) * scale.size());
  const Eigen::VectorXd penalty =
      penalties(start, options.step_scale.size() > 0 ? options.step_scale : scale, options.ridge * rows);
  const auto penalised = [&](double cost, const Eigen::VectorXd& at) {
    return cost + (penalty.array() * at.array().square()).sum();
  };
  RunEquations equations = run_equations(start, series, windows, scale);
  best.cost = equations.cost;
  if (!std::isfinite(equations.cost)) return best;
  double cost = penalised(equations.cost, parameters);
  double damping = 1e-4;
  for (int iteration = 0; iteration < options.iterations; ++iteration) {
    Eigen::MatrixXd normal = equations.normal;
    normal.diagonal() += penalty;
    const Eigen::VectorXd gradient = equations.gradient - (penalty.array() * parameters.array()).matrix();
    const double largest = normal.diagonal().maxCoeff();
    if (!(largest > 0.0)) break;
    // Parameters that move nothing stay: their scale is that of the smallest that counts.
    const Eigen::VectorXd units = normal.diagonal().cwiseMax(1e-14 * largest).cwiseSqrt();
    const Eigen::MatrixXd scaled = units.cwiseInverse().asDiagonal() * normal * units.cwiseInverse().asDiagonal();
    bool improved = false;
    double before = cost;
    while (damping < 1e12) {
      Eigen::MatrixXd damped = scaled;
      damped.diagonal().array() += damping;
      const Eigen::LDLT<Eigen::MatrixXd> solver(damped);
      const Eigen::VectorXd move = solver.solve((gradient.array() / units.array()).matrix()).cwiseQuotient(units);
      const Eigen::VectorXd tried = parameters + move;
      if (!tried.allFinite()) {
        damping = std::max(10.0 * damping, 1e-10);
        continue;
      }
      const DynamicParts parts = with_parameters(best.parts, tried);
      const double run = run_cost(parts, series, windows, scale);
      const double now = penalised(run, tried);
      if (now < cost) {
        best.parts = parts;
        best.cost = run;
        parameters = tried;
        cost = now;
        damping = std::max(damping * 0.1, 1e-14);
        improved = true;
        break;
      }
      damping = std::max(10.0 * damping, 1e-10);
    }
    ++best.iterations;
    if (!improved || before - cost <= options.enough * before) break;
    equations = run_equations(best.parts, series, windows, scale);
    if (!std::isfinite(equations.cost)) break;
  }
  return best;
}

}  // namespace llmt
