// Rows of a file of measurements that are readings of points that stand still, as nests on the base.
#pragma once

#include "llmt/csv.hpp"
#include "llmt/robotics/measurements.hpp"
#include "measurements/header.hpp"

namespace llmt::robotics {

/// Rows of a table with and without a name in the column of reference points.
struct ReferenceRows {
  std::vector<Eigen::Index> references;
  std::vector<Eigen::Index> others;
};
ReferenceRows reference_rows(const Csv& csv, const ColumnMap& map);

/// Takes the movement of the instrument that the reference points show, session by session, off measured points and
/// orientations, and says so in the warnings. `rows`: of `csv`, row by row of the measurements. Throws
/// std::runtime_error `path:line: ...`.
void take_off_drift(const Csv& csv, const ReferenceRows& split, const Robot& robot, const ColumnMap& map,
                    const std::vector<Eigen::Index>& rows, Measurements& measurements);

}  // namespace llmt::robotics
