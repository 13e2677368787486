/// \file
/// How long a model is, written down as an expression.
///
///     const Eigen::Index length = llmt::expression_size(model);
#pragma once

#include <Eigen/Core>

#include "llmt/abi.hpp"
#include "llmt/model.hpp"

namespace llmt {

/// Number of operators, constants and variables in the expressions of all outputs of the model, the measure of size of
/// SRBench (La Cava et al. 2021). A number with its sign is one constant. What occurs twice counts twice.
///
/// A local model is written as `llmt inspect` prints it, c + c_1 r_1 + c_2 r_2 + ..., without the regressors whose
/// slope is 0: 1 for the constant, and for each regressor 3 (+, c_k, *) and the size of r_k:
/// - a number x: 1; the indicator of a level, x = level: 3;
/// - a product: each factor x - centre counts 3, or 1 where the centre is 0. factor * factor adds 1; factor ^ 2 has one
///   factor and adds 2.
///
/// A split makes the expressions L of the left and R of the right child into one. Let s be what it compares, of size 1
/// for a number x and 4 k - 1 for an oblique split with k inputs, w_1 x_1 + ... + w_k x_k. The split adds
/// - 3 + s where it jumps: if(s <= threshold, L, R);
/// - 3 + n for a categorical input with n levels on the left: if(x in {a, b, ...}, L, R); 3 for a split into rows with
///   and without a value: if(x is missing, R, L);
/// - 51 + 4 s for the transition of a blend: (1 - q) * L + q * R with q = v ^ 2 * (3 - 2 * v) and
///   v = min(1, max(0, (s - a) / b)), a = threshold - half width, b = 2 * half width (for smoothness 2: 73 + 6 s,
///   q = v ^ 3 * (10 - v * (15 - 6 * v)));
/// - 23 + 2 s for a logistic gate: g * L + (1 - g) * R with g = 1 / (1 + exp((s - threshold) / half width)).
/// A blend is therefore counted as the nested form of its sum of validity times local model, which is the shorter one.
/// Normalised Gaussians, (mu_1 * f_1 + ...) / (mu_1 + ...), have no such form: with d inputs that splits use, each
/// mu = exp(-0.5 * (((x - c) / sigma) ^ 2 + ...)) has the size 8 d + 2.
///
/// Guards (docs/algorithms/guards.md) and the treatment of missing values are not counted.
Eigen::Index expression_size(const Model& model);

}  // namespace llmt
