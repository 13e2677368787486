// Readings that the others contradict: a lost beam, a wrong line.
#pragma once

#include <Eigen/Core>
#include <vector>

namespace llmt::robotics {

/// Residuals (n) = J d + noise with all columns of J (n x K) free, but the coordinates of a bad reading are shifted by
/// any amount. Coordinate i belongs to reading `reading_of`[i], from 0 on. The generalised extreme studentised deviate
/// test (Rosner 1983): one after another, the reading is left out whose shift takes most of the squares (F test, its
/// probability times the number of readings); all up to the last one below `level` are bad. So several that hide each
/// other are found. At most `most`; returns their numbers in the order in which they were left out.
std::vector<Eigen::Index> bad_readings(const Eigen::MatrixXd& jacobian, const Eigen::VectorXd& residuals,
                                       const std::vector<Eigen::Index>& reading_of, Eigen::Index most, double level);

}  // namespace llmt::robotics
