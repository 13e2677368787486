// Effects of the instrument that measures, at the origin of the measurements: what a polar instrument gets wrong.
#include <cmath>

#include "effects/effect_entries.hpp"

namespace llmt::robotics {
namespace {

using Values = std::span<const double>;

// Errors of the horizontal angle move the point around the instrument's vertical axis.
template <int Order>
void apply_azimuth(const PoseContext& pose, std::size_t, Values values, Values, Deformation& deformation) {
  const Eigen::Vector3d& point = pose.skeleton.tool.position_mm;
  const double azimuth = Order * std::atan2(point.y(), point.x());
  const double error = values[0] * std::cos(azimuth) + values[1] * std::sin(azimuth);
  deformation.world_mm += error * Eigen::Vector3d(-point.y(), point.x(), 0.0);
}

void apply_elevation(const PoseContext& pose, std::size_t, Values values, Values, Deformation& deformation) {
  const Eigen::Vector3d& point = pose.skeleton.tool.position_mm;
  const double across = std::hypot(point.x(), point.y());
  if (!(across > 0.0)) return;
  const double elevation = std::atan2(point.z(), across);
  const double error = values[0] + values[1] * std::cos(elevation) + values[2] * std::sin(elevation);
  const Eigen::Vector3d outwards(point.x() / across, point.y() / across, 0.0);
  deformation.world_mm += error * (across * Eigen::Vector3d::UnitZ() - point.z() * outwards);
}

void apply_range(const PoseContext& pose, std::size_t, Values values, Values, Deformation& deformation) {
  const Eigen::Vector3d& point = pose.skeleton.tool.position_mm;
  if (point.norm() > 0.0) deformation.world_mm += values[0] * point.normalized();
}

EffectParameter angle_of(const std::string& name) { return {.name = name, .unit = "rad", .key = name + "_rad"}; }

}  // namespace

std::vector<EffectType> instrument_effects() {
  const std::string source = "Hughes et al. 2011, laser tracker error determination; Muralikrishnan et al. 2009";
  return {
      {.name = "instrument_azimuth",
       .family = "instrument_azimuth",
       .formula = "the point turns about the world's z by a cos az + b sin az, az its azimuth: an eccentric circle",
       .source = source,
       .place = EffectPlace::robot,
       .parameters = {angle_of("cosine"), angle_of("sine")},
       .apply = apply_azimuth<1>,
       .senses = Senses::arm,
       .of_measuring = true},
      {.name = "instrument_azimuth_twice",
       .family = "instrument_azimuth",
       .formula = "the point turns about the world's z by a cos 2 az + b sin 2 az: a circle pressed out of round",
       .source = source,
       .place = EffectPlace::robot,
       .parameters = {angle_of("cosine"), angle_of("sine")},
       .apply = apply_azimuth<2>,
       .senses = Senses::arm,
       .of_measuring = true},
      {.name = "instrument_elevation",
       .family = "instrument_elevation",
       .formula = "the point is lifted about the instrument by c + a cos el + b sin el, el its elevation",
       .source = source,
       .place = EffectPlace::robot,
       .parameters = {angle_of("constant"), angle_of("cosine"), angle_of("sine")},
       .apply = apply_elevation,
       .senses = Senses::arm,
       .of_measuring = true},
      {.name = "instrument_range",
       .family = "instrument_range",
       .formula = "the distance from the instrument is too large by an offset",
       .source = source,
       .place = EffectPlace::robot,
       .parameters = {{.name = "offset", .unit = "mm", .key = "offset_mm"}},
       .apply = apply_range,
       .senses = Senses::arm,
       .of_measuring = true},
  };
}

}  // namespace llmt::robotics
