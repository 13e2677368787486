#include "calibration/joint_ranges.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <set>
#include <stdexcept>

#include "llmt/robotics/calibration_quality.hpp"

namespace llmt::robotics {

std::vector<std::array<double, 2>> joint_ranges_of(const Chain& chain, const Poses& poses) {
  std::vector<std::array<double, 2>> ranges;
  for (Eigen::Index j = 0; j < poses.joints.cols(); ++j) {
    const Eigen::VectorXd values = poses.joints.col(j) * to_limit_unit(chain.joints[j]);
    ranges.push_back({values.minCoeff(), values.maxCoeff()});
  }
  return ranges;
}

std::vector<JointBeyond> joints_beyond(const Chain& chain, const std::vector<std::array<double, 2>>& ranges,
                                       const Poses& used) {
  constexpr double slack = 0.1;      // of the range
  constexpr double rounding = 1e-4;  // deg or mm
  if (ranges.size() != chain.joints.size()) {
    throw std::invalid_argument(fmt::format("llmt::robotics::joints_beyond: there are {} ranges of {} joints",
                                            ranges.size(), chain.joints.size()));
  }
  std::vector<JointBeyond> beyond;
  for (std::size_t j = 0; j < ranges.size() && used.count() > 0; ++j) {
    const Joint& joint = chain.joints[j];
    const auto [low, high] = ranges[j];
    const Eigen::VectorXd values = used.joints.col(j) * to_limit_unit(joint);
    const double margin = std::max(slack * (high - low), rounding);
    std::vector<Eigen::Index> rows;
    for (Eigen::Index i = 0; i < values.size(); ++i) {
      if (values(i) < low - margin || values(i) > high + margin) rows.push_back(i);
    }
    if (rows.empty()) continue;
    beyond.push_back({joint.name, limit_unit(joint), low, high, values.minCoeff(), values.maxCoeff(), std::move(rows)});
  }
  return beyond;
}

std::vector<Eigen::Index> rows_beyond(const std::vector<JointBeyond>& joints) {
  std::set<Eigen::Index> rows;
  for (const JointBeyond& joint : joints) rows.insert(joint.rows.begin(), joint.rows.end());
  return {rows.begin(), rows.end()};
}

}  // namespace llmt::robotics
