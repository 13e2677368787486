#include "report/robot/learning_figures.hpp"

#include <fmt/format.h>

namespace llmt::report {

Chart learning_chart(const std::vector<robotics::LearningPoint>& curve) {
  Layer held_out{.mark = Mark::line, .name = "poses that took no part", .role = "after"};
  Layer fitted{.mark = Mark::line, .name = "poses that were fitted", .role = "before", .dashed = true};
  for (const robotics::LearningPoint& point : curve) {
    const auto poses = static_cast<double>(point.poses);
    held_out.x.push_back(poses);
    held_out.y.push_back(point.held_out_mm);
    fitted.x.push_back(poses);
    fitted.y.push_back(point.fitted_mm);
  }
  return {.title = "Would more poses help?",
          .caption =
              "Mean error of calibrations to that many poses. Where both lines have met, more poses of this "
              "kind will not lower it: what is left is noise or not geometry.",
          .x = {"poses used for calibration", true},
          .y = {"mean error, mm", true},
          .layers = {held_out, fitted}};
}

Grid learning_grid(const std::vector<robotics::LearningPoint>& curve) {
  Grid grid{.title = "Would more poses help? Errors of calibrations to that many poses",
            .header = {"poses", "mean error at them, mm", "at a fifth of all poses, left out"},
            .rows = {}};
  for (const robotics::LearningPoint& point : curve) {
    grid.rows.push_back({std::to_string(point.poses), fmt::format("{:.4f}", point.fitted_mm),
                         fmt::format("{:.4f}", point.held_out_mm)});
  }
  return grid;
}

}  // namespace llmt::report
