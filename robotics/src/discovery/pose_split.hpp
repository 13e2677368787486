// Which poses are searched, which are set aside, and which belong together.
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "llmt/robotics/measurements.hpp"

namespace llmt::robotics {

/// How repeats of a pose are taken: as independent measurements unless the file says that the arm stood still, or each
/// pose as one.
enum class Repeats { as_marked, averaged };

struct PoseSplit {
  Measurements searched;
  Measurements test;     ///< no poses: nothing was set aside
  Measurements samples;  ///< what is searched: `searched` with readings of an arm that stood still averaged
  std::vector<std::vector<Eigen::Index>> rows;  ///< of the file, behind every sample
};

/// Sets a share aside, repeats of a pose together; or takes the test measurements as given. Readings taken while the
/// arm stood still are one measurement of that pose (`pose` with `dwelled` = 1 or `returned` = 0): their scatter is the
/// instrument's, not the arm's.
PoseSplit set_aside(const Measurements& measurements, const std::optional<Measurements>& test, double share,
                    std::uint64_t seed, Repeats repeats);

/// Numbers that are equal for repeats of a pose, or nothing.
std::vector<Eigen::Index> repeats_of(const Poses& poses);

/// The measurements but those of the given numbers.
Measurements without_rows(const Measurements& measurements, const std::vector<std::size_t>& left_out);

}  // namespace llmt::robotics
