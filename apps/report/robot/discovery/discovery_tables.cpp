#include "report/robot/discovery/discovery_tables.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <cmath>
#include <map>

#include "report/robot/arms.hpp"
#include "report/robot/discovery/effect_text.hpp"
#include "report/text/text.hpp"

namespace llmt::report {

using robotics::Discovery;
using robotics::FoundEffect;

std::string title_of(const FoundEffect& effect) {
  return fmt::format("{} of {}{}", effect.title, place_of(effect), constants_of(effect));
}

Json effects_table(const Discovery& found) {
  Grid grid{.title = "What was added to the model",
            .header = {"effect", "values", "moves the tool by", "certain"},
            .rows = {},
            .words = {1},
            .wide = true};
  for (const robotics::FoundPattern& one : found.unknown) {
    grid.rows.push_back({fmt::format("no name: acts on {}", one.pattern.acts_on),
                         one.pattern.depends_on.empty() ? one.pattern.kind : pattern_words(one.pattern),
                         fmt::format("{:.0f} % of what was explained", 100.0 * one.share), "that something is there"});
  }
  for (const robotics::Effect& map : found.maps)
    grid.rows.push_back({fmt::format("free map of the angle error of {}", map.at),
                         fmt::format("{} values", map.values.size()), "", "no name"});
  for (const FoundEffect* one : by_size(found)) {
    const FoundEffect& effect = *one;
    std::vector<std::string> values;
    for (const robotics::FoundParameter& parameter : effect.parameters) {
      values.push_back(
          fmt::format("{} {}", parameter.name, with_unit(parameter.value, parameter.standard_error, parameter.unit)));
    }
    grid.rows.push_back({title_of(effect), fmt::format("{}", fmt::join(values, ", ")),
                         fmt::format("{} mm rms", number(effect.rms_mm, 3)), effect.confirmed ? "yes" : "perhaps"});
  }
  return block(grid);
}

Json untestable_table(const Discovery& found) {
  std::map<std::pair<std::string, std::string>, std::vector<std::string>> places;
  for (const discovery::UntestableCause& entry : found.not_testable) {
    const std::size_t at = entry.what.find('@');
    places[{entry.what.substr(0, at), entry.why}].push_back(at == std::string::npos ? "the arm"
                                                                                    : entry.what.substr(at + 1));
  }
  Grid grid{
      .title = "What could not be tested",
      .caption = "The poses or the columns that these would need are not there: they are neither found nor excluded.",
      .header = {"effect", "at", "why not"},
      .rows = {},
      .words = {1, 2},
      .wide = true};
  for (const auto& [what, where] : places)
    grid.rows.push_back({what.first, fmt::format("{}", fmt::join(where, ", ")), what.second});
  return block(grid);
}

Json next_table(const robotics::Chain& chain, const NextPoses& next) {
  Grid grid{.title = fmt::format("To tell {} from {}", next.effect, next.rival),
            .header = {"pose"},
            .rows = {},
            .wide = true};
  if (next.telling.none_can)
    return text_block(grid.title, {"No pose can: the two differ by less than the noise everywhere."});
  for (std::size_t j = 0; j < chain.joints.size(); ++j)
    grid.header.push_back(joint_axis(chain, static_cast<Eigen::Index>(j)));
  grid.header.insert(grid.header.end(), {"payload, kg", "they differ by, mm"});
  for (const robotics::DiscriminatingPose& pose : next.telling.poses) {
    std::vector<std::string> row = {std::to_string(grid.rows.size() + 1)};
    for (std::size_t j = 0; j < chain.joints.size(); ++j)
      row.push_back(number(joint_values(chain, pose.joints.transpose(), static_cast<Eigen::Index>(j)).front(), 4));
    row.push_back(number(pose.payload_kg, 3));
    row.push_back(number(pose.disagreement_mm, 3));
    grid.rows.push_back(std::move(row));
  }
  return block(grid);
}

Json visible_table(const Discovery& found) {
  const VisibleSizes sizes = visible_sizes(found);
  Grid grid{
      .title = "What would have been seen",
      .caption = "The smallest size that would have been found nine times in ten, at the best and the worst joint.",
      .header = {"effect", "best place", "worst place", "unit"},
      .rows = {},
      .wide = true};
  for (const auto& [type, range] : sizes.ranges) {
    grid.rows.push_back({type, number(range.best_place, 2), number(range.worst_place, 2), range.unit});
  }
  for (const std::string& type : sizes.never) grid.rows.push_back({type, "not at any plausible size", "", ""});
  return block(grid);
}

}  // namespace llmt::report
