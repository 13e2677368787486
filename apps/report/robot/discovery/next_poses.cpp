#include "report/robot/discovery/next_poses.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>

#include "report/robot/discovery/effect_text.hpp"
#include "report/text/text.hpp"

namespace llmt::report {
namespace {

std::string telling_line(const robotics::TellingPose& pose) {
  std::vector<std::string> joints;
  for (Eigen::Index j = 0; j < pose.joints.size(); ++j) joints.push_back(number(pose.joints(j), 3));
  return fmt::format("    q = ({}) rad, payload {} kg: the explanations differ by {:.4f} mm\n", fmt::join(joints, ", "),
                     number(pose.payload_kg, 3), pose.disagreement_mm);
}

}  // namespace

std::vector<NextPoses> next_poses(const robotics::Discovery& found, const robotics::Measurements& data) {
  std::vector<NextPoses> result;
  const std::vector<robotics::Effect>& all = found.improved.robot.effects;
  for (const robotics::FoundEffect& effect : found.effects) {
    if (!effect.confirmed || effect.exact_alias || effect.rival_effects.empty()) continue;
    const std::string label = robotics::effect_label(effect.effect);
    const auto place = std::ranges::find(all, label, robotics::effect_label);
    if (place == all.end() || effect.rival_effects.front().empty()) continue;
    constexpr int proposed = 3;
    result.push_back({effect_words(effect.effect), rival_words(effect, 0),
                      robotics::telling_poses(found.improved.robot, static_cast<std::size_t>(place - all.begin()),
                                              effect.rival_effects.front(), data.poses, found.noise_mm, proposed, 1,
                                              data.measured)});
  }
  return result;
}

std::string next_poses_text(const std::vector<NextPoses>& next) {
  std::string text;
  for (const NextPoses& each : next) {
    text += fmt::format("To tell {} from {}: ", each.effect, each.rival);
    if (each.telling.none_can) {
      text += "no pose can, they differ by less than the noise everywhere.\n";
      continue;
    }
    text += each.telling.payload_helps ? "measure these, another payload helps\n" : "measure these\n";
    for (const robotics::TellingPose& pose : each.telling.poses) text += telling_line(pose);
  }
  return text;
}

}  // namespace llmt::report
