// The split of poses into those searched and those set aside for verification; repeats of a pose.
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "llmt/robotics/measurements.hpp"

namespace llmt::robotics {

/// The weight of repeats of a pose. as_marked: they are independent measurements, unless the file says that the arm
/// stood still. averaged: every pose is one measurement.
enum class Repeats { as_marked, averaged };

struct PoseSplit {
  Measurements searched;
  Measurements test;                            ///< no poses: nothing was set aside
  std::vector<Eigen::Index> aside;              ///< rows of the file that `test` holds, ascending; none if it was given
  Measurements samples;                         ///< `searched` with readings of an arm that stood still averaged
  std::vector<std::vector<Eigen::Index>> rows;  ///< of the file, behind every sample
};

/// Sets a share of the poses aside, repeats of a pose together; if test measurements are given, takes those instead.
/// Readings taken while the arm stood still (`pose` with `dwelled` = 1 or `returned` = 0) count as one measurement of
/// that pose, because their scatter is that of the instrument alone.
PoseSplit set_aside(const Measurements& measurements, const std::optional<Measurements>& test, double share,
                    std::uint64_t seed, Repeats repeats);

/// Numbers that are equal for repeats of a pose, or nothing.
std::vector<Eigen::Index> repeats_of(const Poses& poses);

/// The given ones of the coordinates of the points, which are numbered pose by pose.
Eigen::VectorXd stacked(const Eigen::MatrixXd& points, const std::vector<Eigen::Index>& coordinates);

}  // namespace llmt::robotics
