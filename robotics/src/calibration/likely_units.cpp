#include "calibration/likely_units.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <numbers>
#include <stdexcept>
#include <vector>

#include "llmt/robotics/calibration.hpp"

namespace llmt::robotics {
namespace {

struct Misread {
  double of_angles;
  double of_positions;
  const char* words;
};

constexpr double degrees = 180.0 / std::numbers::pi;
constexpr Misread misreads[] = {
    {degrees, 1.0, "if the angles of the file were radians, not degrees"},
    {1.0 / degrees, 1.0, "if the angles of the file were degrees, not radians"},
    {1.0, 1000.0, "if the measured positions were a thousand times as large (metres, not millimetres)"},
    {1.0, 0.001, "if the measured positions were a thousandth as large (millimetres, not metres)"}};

// As many poses as tell a factor of a thousand.
Measurements some_of(const Measurements& measurements) {
  constexpr Eigen::Index enough = 200;
  std::vector<Eigen::Index> rows;
  const Eigen::Index step = std::max<Eigen::Index>(1, measurements.count() / enough);
  for (Eigen::Index row = 0; row < measurements.count(); row += step) rows.push_back(row);
  return select(measurements, rows);
}

Measurements read_as(Measurements measurements, const Chain& chain, const Misread& misread) {
  for (std::size_t j = 0; j < chain.joints.size(); ++j) {
    if (chain.joints[j].type == JointType::revolute) {
      measurements.poses.joints.col(static_cast<Eigen::Index>(j)) *= misread.of_angles;
    }
  }
  measurements.positions_mm *= misread.of_positions;
  return measurements;
}

}  // namespace

std::string likely_units(const Robot& robot, const Measurements& measurements, double misfit_mm, double plausible_mm) {
  constexpr double far_better = 0.1;
  const Measurements some = some_of(measurements);
  const Misread* best = nullptr;
  double smallest = std::min(far_better * misfit_mm, plausible_mm);
  for (const Misread& misread : misreads) {
    const Measurements other = read_as(some, robot.chain, misread);
    try {
      const Robot placed = calibrate(robot, other, {.only = {"base", "tool"}}).robot;
      const double misses = distances(positions(placed, other.poses), other).mean();
      if (misses >= smallest) continue;
      smallest = misses;
      best = &misread;
    } catch (const std::exception&) {
      continue;  // so it is not that
    }
  }
  if (best == nullptr) return {};
  return fmt::format(
      "{} the described robot would miss the points by {:.3g} mm instead of {:.3g} mm: most likely the "
      "units in the column names are wrong",
      best->words, smallest, misfit_mm);
}

}  // namespace llmt::robotics
