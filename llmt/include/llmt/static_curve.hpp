/// \file
/// Where a system that moves comes to rest: the steady outputs over a steady input.
///
///     const llmt::StaticCurve curve = llmt::static_curve(llmt::load_dynamic("drive.json"), 0);
///     const llmt::RestPoint& first = curve.points.front();  // first.input, first.outputs, first.is_stable
#pragma once

#include <Eigen/Core>
#include <vector>

#include "llmt/abi.hpp"
#include "llmt/dynamic_model.hpp"

namespace llmt {

/// A state of rest: the model gives these outputs for ever if they and the inputs have been there for its whole memory.
struct RestPoint {
  double input = 0.0;
  Eigen::VectorXd outputs;
  bool is_stable = true;    ///< the outputs come back after a small push: no pole outside of the unit circle
  bool is_inside = true;    ///< all outputs lie in their training ranges
  bool is_at_stop = false;  ///< an output stands at a stop
};

struct StaticCurve {
  Eigen::Index input = 0;         ///< the one that is varied
  Eigen::VectorXd others;         ///< one an input: where those that stay are
  std::vector<RestPoint> points;  ///< by input, then by the first output; several may have the same input
  std::vector<double> none;       ///< values of the input at which no state of rest was found
};

/// States of rest y = f(y, ..., y, u, ..., u) for `count` values of an input over its training range, the other inputs
/// at `others`, one value an input; empty: in the middle of their training ranges. Of one output all states are found
/// that change the sign of f(y) - y between 401 values from one training range below to one above the training range;
/// of several outputs those that Newton's method finds from the corners and the middle of the ranges and from the
/// states before. Where an output adds up its changes it rests anywhere or nowhere: then there are no points, and
/// `none` has all values. Throws std::invalid_argument if there is no such input, the count is below 2, or `others`
/// does not fit.
StaticCurve static_curve(const DynamicModel& model, Eigen::Index input, Eigen::Index count = 41,
                         const Eigen::VectorXd& others = {});

}  // namespace llmt
