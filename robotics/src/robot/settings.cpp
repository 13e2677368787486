#include "robot/settings.hpp"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <map>
#include <numeric>
#include <stdexcept>
#include <utility>

#include "kinematics/units.hpp"

namespace llmt::robotics {
namespace {

Eigen::Isometry3d transform_of(const Frame& frame) {
  Eigen::Isometry3d transform = Eigen::Isometry3d::Identity();
  transform.translate(frame.xyz_mm);
  for (int axis = 2; axis >= 0; --axis) {
    transform.rotate(Eigen::AngleAxisd(radians * frame.rpy_deg(axis), Eigen::Vector3d::Unit(axis)));
  }
  return transform;
}

std::size_t place_of(const std::vector<NamedFrame>& frames, const std::string& name, const char* kind) {
  const auto found = std::ranges::find(frames, name, &NamedFrame::name);
  if (found == frames.end()) {
    throw std::invalid_argument(fmt::format("llmt::robotics::positions: the robot has no {} \"{}\"", kind, name));
  }
  return found - frames.begin();
}

constexpr Eigen::Index frame_size = 6;

Setting make_setting(const Robot& robot, const std::string& base, const std::string& tool) {
  Setting setting{.robot = robot, .poses = {}, .rows = {}, .tool = tool_parameter(FrameParameter::x)};
  Chain& chain = setting.robot.chain;
  const Eigen::Index first = joint_parameter(chain.joints.size(), JointParameter::theta);
  if (!base.empty()) {
    const std::size_t place = place_of(robot.chain.bases, base, "base");
    chain.base = robot.chain.bases[place].frame;
    setting.base = first + frame_size * place;
    setting.is_touched = is_touched(base);
    if (is_sphere(base)) {
      const auto spheres_from = std::ranges::count_if(robot.chain.bases.begin() + static_cast<std::ptrdiff_t>(place),
                                                      robot.chain.bases.end(), is_sphere, &NamedFrame::name);
      setting.radius_mm = robot.chain.bases[place].radius_mm;
      setting.radius = geometric_parameter_count(robot.chain) - spheres_from;
    }
  }
  if (!tool.empty()) {
    const std::size_t place = place_of(robot.chain.tools, tool, "tool");
    chain.tool = robot.chain.tools[place].frame;
    setting.tool = first + frame_size * (robot.chain.bases.size() + place);
    // The payload hangs where it hung.
    chain.payload.com_mm =
        transform_of(chain.tool).inverse() * (transform_of(robot.chain.tool) * robot.chain.payload.com_mm);
  }
  chain.bases.clear();
  chain.tools.clear();
  return setting;
}

}  // namespace

bool is_one_setting(const Robot& robot, const Poses& poses) {
  if (!poses.observations.empty() && std::ssize(poses.observations) != poses.count()) {
    throw std::invalid_argument(fmt::format("llmt::robotics::positions: there are {} observations of {} poses",
                                            poses.observations.size(), poses.count()));
  }
  return robot.chain.bases.empty() && robot.chain.tools.empty() &&
         std::ranges::all_of(poses.observations,
                             [](const Observation& seen) { return seen.base.empty() && seen.tool.empty(); });
}

std::vector<Setting> settings_of(const Robot& robot, const Poses& poses) {
  std::vector<Setting> settings;
  if (poses.observations.empty()) {
    settings.push_back(make_setting(robot, "", ""));
    settings[0].rows.resize(poses.count());
    std::iota(settings[0].rows.begin(), settings[0].rows.end(), 0);
    settings[0].poses = poses;
    return settings;
  }
  std::map<std::pair<std::string, std::string>, std::size_t> places;
  for (Eigen::Index row = 0; row < poses.count(); ++row) {
    const Observation& seen = poses.observations[row];
    const auto [place, is_new] = places.try_emplace({seen.base, seen.tool}, settings.size());
    if (is_new) settings.push_back(make_setting(robot, seen.base, seen.tool));
    settings[place->second].rows.push_back(row);
  }
  for (Setting& setting : settings) {
    setting.poses = select(poses, setting.rows);
    for (Observation& seen : setting.poses.observations) seen.base = seen.tool = "";
  }
  return settings;
}

std::vector<Eigen::Index> columns_of(const Setting& setting, const Robot& whole) {
  std::vector<Eigen::Index> columns;
  for (Eigen::Index k = 0; k < frame_size; ++k) columns.push_back(setting.base + k);
  for (Eigen::Index k = 0; k < frame_size; ++k) columns.push_back(setting.tool + k);
  const Eigen::Index own = geometric_parameter_count(setting.robot.chain);
  for (Eigen::Index k = joint_parameter(0, JointParameter::theta); k < own; ++k) columns.push_back(k);
  Eigen::Index next = geometric_parameter_count(whole.chain);
  for (const Effect& effect : whole.effects) {
    for (std::size_t k = 0; k < effect.values.size(); ++k) columns.push_back(next++);
  }
  return columns;
}

}  // namespace llmt::robotics
