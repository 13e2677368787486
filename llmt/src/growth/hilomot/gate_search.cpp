#include "growth/hilomot/gate_search.hpp"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "base/parallel.hpp"

namespace llmt {
namespace {

// Half widths in standard deviations of the node's rows along the direction (docs/algorithms/hilomot.md, "Half
// widths"). Local models have the fixed one of Nelles: a twentieth of the distance of the two centres, which are
// sqrt(3) standard deviations apart if evenly spread rows are halved. For joint models it is optimised between bounds.
constexpr double local_width = 0.087;
constexpr double joint_width = 0.4;
constexpr double least_joint_width = 0.05;
constexpr double most_joint_width = 1.0;

// A direction is no start if the part of its unit vector that varies in the node is shorter than this.
constexpr double least_direction = 1e-6;

// Number of axis-orthogonal splits from which the optimisation starts.
constexpr Eigen::Index axes_to_start_from = 2;

}  // namespace

GateFit best_gate(const GateProblem& problem, const Eigen::MatrixXd& directions, Eigen::Index axes, int max_threads) {
  const bool joint = problem.models == GateModels::joint;
  std::vector<GateFit> fits(directions.cols());
  parallel_for(std::ssize(fits), max_threads, [&](Eigen::Index k) {
    GateFit& fit = fits[k];
    fit.loss = std::numeric_limits<double>::infinity();
    if (directions.col(k).norm() > least_direction) {
      fit = best_threshold(problem, directions.col(k), joint ? joint_width : local_width);
    }
  });
  const auto less = [](const GateFit& a, const GateFit& b) { return a.loss < b.loss; };
  std::stable_sort(fits.begin(), fits.begin() + axes, less);
  fits.erase(fits.begin() + std::min(axes, axes_to_start_from), fits.begin() + axes);
  std::erase_if(fits, [](const GateFit& fit) { return !std::isfinite(fit.loss); });
  parallel_for(std::ssize(fits), max_threads, [&](Eigen::Index k) {
    GateFit& fit = fits[k];
    fit = optimise_gate(problem, fit, joint ? least_joint_width : local_width, joint ? most_joint_width : local_width);
  });
  GateFit best{{}, std::numeric_limits<double>::infinity()};
  int evaluations = 0;
  for (const GateFit& fit : fits) {
    evaluations += fit.evaluations;
    best = fit.loss < best.loss ? fit : best;
  }
  best.evaluations = evaluations;
  return best;
}

Eigen::VectorXd most_curved(const GateProblem& problem) {
  const Eigen::VectorXd residual = problem.y * problem.output_weights.cwiseSqrt();
  const auto z = problem.z.leftCols(problem.z.cols() - 1);
  const Eigen::MatrixXd hessian = z.transpose() * (problem.weights.cwiseProduct(residual).asDiagonal() * z);
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> eigen(hessian);
  Eigen::Index largest = 0;
  eigen.eigenvalues().cwiseAbs().maxCoeff(&largest);
  return eigen.eigenvectors().col(largest);
}

}  // namespace llmt
