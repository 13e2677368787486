// Which poses are searched, which are set aside, and which belong together.
#pragma once

#include <optional>
#include <vector>

#include "hypotheses.hpp"

namespace llmt::robotics {

/// How repeats of a pose are taken: as independent measurements unless the file says that the arm stood still, or each
/// pose as one.
enum class Repeats { as_marked, averaged };

struct Split {
  Measurements searched;
  Measurements test;     ///< no poses: nothing was set aside
  Measurements samples;  ///< what is searched: `searched` with readings of an arm that stood still averaged
  std::vector<std::vector<Eigen::Index>> rows;  ///< of the file, behind every sample
};

/// Sets a share aside, repeats of a pose together; or takes the test measurements as given. Readings taken while the
/// arm stood still are one measurement of that pose (`pose` with `dwelled` = 1 or `returned` = 0): their scatter is the
/// instrument's, not the arm's.
Split set_aside(const Measurements& measurements, const std::optional<Measurements>& test,
                const DiscoveryOptions& options, Repeats repeats);

std::vector<Eigen::Index> searched_rows(const Split& split, std::size_t sample);

/// Numbers that are equal for repeats of a pose, or nothing.
std::vector<Eigen::Index> repeats_of(const Poses& poses);

/// An effect that an earlier round added, as a hypothesis among the others: what it was, at the present estimates.
Hypothesis found_before(const Hypothesis& earlier, const Effect& effect, const Eigen::MatrixXd& signature);

}  // namespace llmt::robotics
