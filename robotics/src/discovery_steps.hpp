// Which poses are searched, which are set aside, and which belong together.
#pragma once

#include <optional>
#include <vector>

#include "hypotheses.hpp"

namespace llmt::robotics {

struct Split {
  Measurements searched;
  Measurements test;                    ///< no poses: nothing was set aside
  std::vector<Eigen::Index> rows;       ///< of the file, of every searched pose
  std::vector<std::vector<Eigen::Index>> merged;  ///< searched poses behind each sample of without_dwelling()
};

/// Sets a share aside, repeats of a pose together; or takes the test measurements as given.
Split set_aside(const Measurements& measurements, const std::optional<Measurements>& test,
                const DiscoveryOptions& options);

/// Readings taken while the arm stood still are one measurement of that pose: their scatter is the instrument's, not the
/// arm's. Groups of `pose` with `dwelled` = 1 or `returned` = 0 are replaced by their means.
Measurements without_dwelling(const Measurements& measurements, std::vector<std::vector<Eigen::Index>>* merged = nullptr);

std::vector<Eigen::Index> searched_rows(const Split& split, std::size_t sample);

/// Numbers that are equal for repeats of a pose, or nothing.
std::vector<Eigen::Index> repeats_of(const Poses& poses);

/// An effect that an earlier round added, as a hypothesis among the others: what it was, at the present estimates.
Hypothesis found_before(const Hypothesis& earlier, const Effect& effect, const Eigen::MatrixXd& signature);

}  // namespace llmt::robotics
