/// \file
/// The best plane and logistic gate for two local models of weighted rows (docs/algorithms/hilomot.md, H.3). This is
/// separable nonlinear least squares: the local models are fitted anew for every gate (variable projection, Golub &
/// Pereyra 1973).
#pragma once

#include <Eigen/Core>

#include "numerics/node_fit.hpp"

namespace llmt {

/// How the two local models of a gate are fitted. With g the share of the left one:
enum class GateModels {
  local,  ///< each for itself, weighted with g and with 1 - g, as in Nelles' local estimation
  joint   ///< both at once, so that g f_1 + (1 - g) f_2 fits best
};

/// The rows of a local model that is to be split.
struct GateProblem {
  RowMajor a;                      ///< rows x coefficients: orthogonal columns of weighted mean square 1
  RowMajor z;                      ///< rows x inputs of the gate: of weighted mean 0 and covariance 1, and a last 1
  RowMajor y;                      ///< rows x outputs, orthogonal to `a`
  Eigen::VectorXd weights;         ///< of the rows
  Eigen::VectorXd output_weights;  ///< of the outputs' squared errors
  double least_weight = 0.0;       ///< that either side must have in sum
  GateModels models = GateModels::local;
};

/// Share of the left model 1 / (1 + exp(z' u)). Since z is white, 1 / |u without its last entry| is the half width in
/// standard deviations along the direction.
using Gate = Eigen::VectorXd;

/// Share of the left model in each row.
Eigen::VectorXd gate_shares(const GateProblem& problem, const Gate& gate);

/// sum_n weights_n (y_n - g_n f_1 - (1 - g_n) f_2)^2 for given shares g of the left model, the local models fitted;
/// infinity where a side has too little weight.
double share_loss(const GateProblem& problem, const Eigen::VectorXd& shares);

/// Derivatives of share_loss() with respect to the entries of a gate, at that gate's shares.
Eigen::VectorXd gate_gradient(const GateProblem& problem, const Gate& gate);

struct GateFit {
  Gate gate;
  double loss = 0.0;
  int evaluations = 0;
};

/// The best of a few thresholds along a direction, with a given half width.
GateFit best_threshold(const GateProblem& problem, const Eigen::VectorXd& direction, double half_width);

/// Downhill from `start` by the method of Levenberg and Marquardt, half widths held between the two; they may be equal.
GateFit optimise_gate(const GateProblem& problem, const GateFit& start, double least_width, double most_width);

}  // namespace llmt
