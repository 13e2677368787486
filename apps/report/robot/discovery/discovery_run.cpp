#include "report/robot/discovery/discovery_run.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <iterator>
#include <stdexcept>
#include <utility>

#include "llmt/folds.hpp"
#include "llmt/robotics/calibration_report.hpp"
#include "llmt/robotics/catalogue.hpp"
#include "llmt/robotics/likely_mistake.hpp"
#include "report/robot/discovery/discovery_page.hpp"
#include "report/robot/measurement_text.hpp"
#include "report/robot/provenance.hpp"

namespace llmt::report {
namespace {

// Says what `calibrate` would say of measurements that the description cannot mean.
void warn_of_misfit(const robotics::Robot& robot, const robotics::Measurements& data, const Warn& warn) {
  const robotics::CalibrationReport calibrated = robotics::report_calibration(robot, data, {.folds = 0});
  std::ranges::for_each(robotics::input_mistakes(robot, data, calibrated), warn);
}

// discover(); where it refuses the measurements, what looks wrong with them is said first.
robotics::Discovery discovered(const robotics::Robot& robot, const robotics::Measurements& data,
                               const std::optional<robotics::Measurements>& test,
                               const robotics::DiscoveryOptions& options, const Warn& warn) {
  try {
    return robotics::discover(robot, data, test, options);
  } catch (const std::runtime_error&) {
    try {
      warn_of_misfit(robot, data, warn);
    } catch (const std::exception&) {  // what discover() says is enough then
    }
    throw;
  }
}

DiscoveryFolds cross_validated(const robotics::Robot& robot, const robotics::Measurements& data,
                               const DiscoveryTask& task, const Progress& progress) {
  DiscoveryFolds result{.folds = task.folds, .contiguous = task.contiguous};
  FoldOptions dealing;
  dealing.count = task.folds;
  dealing.kind = task.contiguous ? FoldKind::contiguous : FoldKind::random;
  dealing.seed = task.options.seed;
  Work work(progress);
  for (const Fold& fold : make_folds(data.count(), dealing, robotics::pose_labels(data.poses))) {
    Work part(work, 1.0 / task.folds);
    robotics::DiscoveryOptions options = task.options;
    options.progress = part.progress();
    const robotics::Measurements held_out = robotics::select(data, fold.held_out);
    const robotics::Discovery found = robotics::discover(robot, robotics::select(data, fold.train), held_out, options);
    const auto n = static_cast<double>(held_out.count());
    result.before_mm += n * found.held_out.before.mean / static_cast<double>(data.count());
    result.after_mm += n * found.held_out.after.mean / static_cast<double>(data.count());
  }
  work.finish();
  return result;
}

}  // namespace

std::vector<std::string> searched_columns(const std::vector<robotics::EffectType>& catalogue,
                                          const robotics::Robot& robot) {
  std::vector<std::string> columns;
  for (const robotics::EffectType& type : catalogue) {
    for (std::size_t j = 0; j < robot.chain.joints.size(); ++j) {
      if (!type.searched || !robotics::suits(type, robot.chain, j)) continue;
      if (type.place == robotics::EffectPlace::robot && j > 0) continue;
      for (const std::string& names :
           robotics::effect_columns(robot.chain, robotics::make_effect(type, robot.chain, j))) {
        std::ranges::copy(robotics::alternatives(names), std::back_inserter(columns));
      }
    }
  }
  return columns;
}

DiscoveryRun run_discovery(const robotics::Robot& described, const robotics::Measurements& measured,
                           const std::function<robotics::Measurements(const robotics::Robot&)>& read_test,
                           DiscoveryTask task, const Warn& warn) {
  DiscoveryRun run{.robot = robotics::with_frames(described, measured),
                   .measurements = measured,
                   .found = {},
                   .has_test = static_cast<bool>(read_test),
                   .folds = {},
                   .next = {}};
  std::optional<robotics::Measurements> test;
  if (read_test) test = read_test(run.robot);
  check_positions(task.robot_file, run.robot, measured.poses);
  if (test) check_positions(task.robot_file, run.robot, test->poses);
  std::ranges::for_each(measured.warnings, warn);
  if (const auto same = test ? tests_that_took_part(measured, *test) : std::nullopt) warn(*same);
  const std::optional<robotics::Suspicion> suspicion = robotics::likely_mistake(run.robot, measured);
  if (suspicion && suspicion->name != task.accept_suspicion) {
    Finding mistake = finding("likely_mistake", suspicion->sentence);
    mistake.is_mistake = true;
    warn(mistake);
    throw std::runtime_error(
        fmt::format("nothing is searched while the files look wrong; {} {} takes them as they stand",
                    task.face.option("accept-suspicion"), suspicion->name));
  }
  run.found = discovered(run.robot, measured, test, task.options, warn);
  const Progress progress = std::exchange(task.options.progress, {});
  warn_of_misfit(run.robot, measured, warn);  // what cannot be calibrated was refused
  if (task.folds > 0) run.folds = cross_validated(run.robot, measured, task, progress);
  run.next = next_poses(run.found, measured);
  return run;
}

std::vector<bool> are_set_aside(const DiscoveryRun& run) {
  if (run.has_test) return {};
  std::vector<bool> rows(run.measurements.count());
  for (const Eigen::Index row : run.found.held_out.rows) rows[row] = true;
  std::vector<bool> points;
  for (const Eigen::Index row : robotics::position_rows(run.measurements.poses)) points.push_back(rows[row]);
  return points;
}

std::string discovery_text(const DiscoveryRun& run, const std::string& data, std::size_t width, const Face& face) {
  const std::string use = use_of_orientations(run.measurements, face);
  std::string text =
      fmt::format("{}: {} of {}, {} {} set aside\n{}{}\n", face.table(data), counts_of(run.measurements),
                  run.robot.chain.name, run.has_test ? 0 : run.found.held_out.poses,
                  run.measurements.poses.observations.empty() ? "of them" : "poses", use, use.empty() ? "" : "\n");
  text += discovery_page(run.found, run.measurements.lines, width, face);
  text += next_poses_text(run.next);
  if (run.folds) {
    text += fmt::format("{} {} folds, everything found anew in each: {:.4f} -> {:.4f} mm mean on the poses left out\n",
                        run.folds->folds, run.folds->contiguous ? "contiguous" : "random", run.folds->before_mm,
                        run.folds->after_mm);
  }
  return text;
}

Json discovery_run_json(const DiscoveryRun& run) {
  Json json = discovery_json(run.found);
  json["frame"] = frames_text(run.found.improved.robot.chain, run.measurements.poses);
  const auto& record = run.found.improved.robot.calibration;
  if (record && record->made_from) json["made_from"] = provenance_json(*record->made_from);
  json["cross_validation"] = nullptr;
  if (run.folds) {
    json["cross_validation"] = {{"folds", run.folds->folds},
                                {"contiguous", run.folds->contiguous},
                                {"before_mm", run.folds->before_mm},
                                {"after_mm", run.folds->after_mm}};
  }
  return json;
}

}  // namespace llmt::report
