/// \file
/// Where a straight line through the input space meets the splits and guards of a partition
/// (docs/algorithms/explanation.md).
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <vector>

#include "llmt/model.hpp"
#include "model/evaluator.hpp"

namespace llmt {

/// Positions on a line that differ by less count as one.
inline constexpr double same_position = 1e-12;

/// The line from a reference at position 0 to a point at position 1. Inputs that cannot move, because they are
/// categorical or missing at one end, are switched in the middle.
struct StraightLine {
  StraightLine(const Model& model, const Eigen::Ref<const Eigen::VectorXd>& reference,
               const Eigen::Ref<const Eigen::VectorXd>& point);

  /// The inputs at a position; those that do not move as in `row`.
  Eigen::VectorXd at(double position, const Eigen::VectorXd& row) const;

  Eigen::VectorXd reference;
  Eigen::VectorXd point;
  Eigen::VectorXd way;                 ///< point - reference where an input moves, else 0
  std::vector<Eigen::Index> moving;    ///< inputs
  std::vector<Eigen::Index> switched;  ///< inputs that change at the middle of the line
};

/// A place on the line where a threshold without transition is passed.
struct Crossing {
  double position = 0.0;
  int input = 0;
  double before = 0.0;  ///< values of the input on the two sides
  double after = 0.0;
  /// Oblique split: the part of what the split compares that each input moves. Empty: all is the input's.
  Eigen::VectorXd parts = {};
};

struct Pieces {
  std::vector<double> cuts;         ///< ends of pieces, ascending, the last one 1
  std::vector<Crossing> crossings;  ///< ascending
};

/// Cuts the line at jumps. `at_kinks`: also where a transition or a guard sets in or ends.
Pieces cut_line(const Model& model, const Partition& partition, const Evaluator& evaluator, const StraightLine& line,
                bool at_kinks);

}  // namespace llmt
