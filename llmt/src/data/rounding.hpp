/// \file
/// Values that are equal but for rounding.
#pragma once

#include <Eigen/Core>
#include <optional>
#include <vector>

namespace llmt {

/// The table with values made the same that are equal up to rounding: those of a column that lie within 1e-6 of its
/// spread, the distance of the 10 % and 90 % quantiles of its different values (of all, if that is 0), and, where these
/// are many, within a hundredth of the mean distance of as many values. This is done in a column only if more than a
/// tenth of its different values vanish by it. They become the smallest of them; those that the largest value of the
/// column is among become that. None: nothing changes. `rows`: those that count, and change.
std::optional<Eigen::MatrixXd> without_rounding(const Eigen::Ref<const Eigen::MatrixXd>& table,
                                                const std::vector<Eigen::Index>& rows, int max_threads);

}  // namespace llmt
