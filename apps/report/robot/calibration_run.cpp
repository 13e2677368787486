#include "report/robot/calibration_run.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <set>
#include <stdexcept>
#include <utility>

#include "report/robot/input_checks.hpp"

namespace llmt::report {
namespace {

// Measurements that take no part, with frames of the calibrated robot or, in a new session, frames of their own.
robotics::Measurements test_of(const CalibrationTask& task, const robotics::Robot& nominal,
                               const ReadMeasurements& read_test) {
  robotics::Measurements test = read_test(nominal);
  if (!task.new_session) {
    check_frames(task.test_file, nominal, test,
                 fmt::format("; {} fits base and tool to the test file", task.face.switched("new-session")));
  } else if (constexpr std::size_t values_of_frames = 9; robotics::measured_rows(test).size() <= values_of_frames) {
    throw std::runtime_error(fmt::format("{}: {} points do not tell base and tool ({} values) and the error, too",
                                         task.test_file, test.count(), values_of_frames));
  }
  check_positions(task.robot_file, robotics::with_frames(nominal, test.poses), test.poses);
  return test;
}

// Takes the readings that lie far off out of the run's measurements.
void leave_outliers_out(CalibrationRun& run) {
  robotics::Measurements& measurements = run.measurements;
  const robotics::RobustCalibration robust =
      robotics::calibrate_robustly(run.nominal, measurements, run.task.options.calibration);
  std::vector<Eigen::Index>& lines = run.outlier_lines;
  for (const std::size_t row : robust.left_out) lines.push_back(measurements.lines[row]);
  std::ranges::sort(lines);
  lines.erase(std::unique(lines.begin(), lines.end()), lines.end());
  robotics::Measurements kept = robotics::without_rows(measurements, robust.left_out);
  kept.warnings = measurements.warnings;
  kept.unused_columns = measurements.unused_columns;
  measurements = std::move(kept);
}

void require_poses_for_folds(const CalibrationRun& run) {
  const std::vector<double> labels = robotics::pose_labels(run.measurements.poses);
  const Eigen::Index poses =
      labels.empty() ? run.measurements.count() : std::ssize(std::set<double>(labels.begin(), labels.end()));
  if (poses < run.task.options.folds) {
    throw std::runtime_error(fmt::format("{}: {} {} for {} folds", run.task.data_file, poses,
                                         poses == 1 ? "pose is too few" : "poses are too few", run.task.options.folds));
  }
}

const JudgedModel& model_to_use(const CalibrationRun& run) {
  return run.report.correction_kept ? run.models.back() : run.models[1];
}

Acceptance acceptance_of(const CalibrationRun& run) {
  Acceptance result;
  const double limit = run.task.limit_mm;
  if (!(limit > 0.0)) return result;
  const JudgedModel& model = model_to_use(run);
  const bool has_held_out = model.stage.held_out_mm.size() > 0;
  if (run.is_implausible || !run.report.calibration.result.converged() || (!model.test && !has_held_out)) {
    result.verdict = Acceptance::Verdict::not_evaluated;
    result.sentence = model.test || has_held_out
                          ? "NOT EVALUATED: the calibration is none, see below."
                          : "NOT EVALUATED: no poses were left out of the fit, and there is no test file.";
    return result;
  }
  result.error_mm = model.test ? model.test->mean : model.stage.held_out_mm.mean();
  const bool passes = result.error_mm <= limit;
  result.verdict = passes ? Acceptance::Verdict::pass : Acceptance::Verdict::fail;
  result.sentence = fmt::format("{}: the mean error on {} is {:.4f} mm, the limit {:.4g} mm.", passes ? "PASS" : "FAIL",
                                model.test ? "the test file" : "poses left out", result.error_mm, limit);
  return result;
}

// Another session has another base and tool: the error is then metres, and no error of the arm.
void refuse_another_session(const CalibrationRun& run) {
  if (!run.test || run.task.new_session) return;
  const JudgedModel& calibrated = run.models[1];
  constexpr double far = 10.0;
  constexpr double far_better = 0.1;
  const double known = calibrated.stage.in_sample_mm.mean();
  const double limit = std::max(far * known, 0.002 * robotics::size_of(run.nominal.chain, run.measurements));
  if (!(calibrated.test->mean > limit) || robotics::measured_rows(*run.test).size() <= 9) return;
  const JudgedModel fitted = judged_models(run.report, run.measurements, run.test, true)[1];
  if (!(fitted.test->mean < far_better * calibrated.test->mean)) return;
  throw std::runtime_error(fmt::format(
      "{}: with base and tool of the calibration the mean error is {:.4g} mm, with a base and a tool of its own {:.4g} "
      "mm: the file is of another session; {} fits them",
      run.task.test_file, calibrated.test->mean, fitted.test->mean, run.task.face.switched("new-session")));
}

// The test file judges the correction, too.
void judge_correction_by_test(CalibrationRun& run) {
  if (!run.report.correction_kept || !run.test) return;
  const double with = run.models.back().test->mean;
  const double without = run.models[1].test->mean;
  if (with <= without) return;
  run.report.correction_kept = false;
  if (run.report.folds > 0) {
    robotics::remember_errors(*run.report.calibration.robot.calibration, run.report.geometric.held_out_mm);
  }
  run.report.decision = fmt::format(
      "the correction is left out, it makes the test file worse: {:.4f} mm with it, {:.4f} mm without", with, without);
}

bool is_accepted(const CalibrationRun& run) {
  return !run.suspicion || run.suspicion->name == run.task.accept_suspicion;
}

std::string refusal_of(const CalibrationRun& run) {
  if (!is_accepted(run)) {
    return fmt::format("{}: nothing is written while the files look wrong; {} {} takes them as they stand",
                       run.task.data_file, run.task.face.option("accept-suspicion"), run.suspicion->name);
  }
  if (run.is_implausible) {
    return fmt::format(
        "{}: the calibrated robot misses half of the points by more than a fiftieth of its length, or turns its tool "
        "otherwise than was measured: nothing is written; check units, order, signs and zeros of the joints, the order "
        "of quaternions or the convention of angles, and the description",
        run.task.data_file);
  }
  const discovery::SolverResult& result = run.report.calibration.result;
  return result.converged() ? "" : fmt::format("the calibration did not converge: {}", result.reason);
}

}  // namespace

std::string to_string(Acceptance::Verdict verdict) {
  switch (verdict) {
    case Acceptance::Verdict::not_asked:
      return "";
    case Acceptance::Verdict::pass:
      return "pass";
    case Acceptance::Verdict::fail:
      return "fail";
    case Acceptance::Verdict::not_evaluated:
      return "not evaluated";
  }
  return "";
}

CalibrationRun run_calibration(const robotics::Robot& described, const robotics::Measurements& measured,
                               const ReadMeasurements& read_test, CalibrationTask task) {
  CalibrationRun run{.task = std::move(task),
                     .nominal = {},
                     .measurements = robotics::without_small_sessions(measured),
                     .test = {},
                     .outlier_lines = {},
                     .report = {},
                     .models = {},
                     .input_mistakes = {},
                     .used = {},
                     .details = {},
                     .learning = {},
                     .suspicion = {},
                     .is_implausible = false,
                     .acceptance = {},
                     .refusal = {}};
  robotics::Measurements& measurements = run.measurements;
  if (measurements.count() == 0) {
    throw std::runtime_error(run.task.data_file + ": " + measurements.warnings.back().words(run.task.face));
  }
  run.nominal = robotics::with_frames(described, measurements);
  if (run.task.robust) leave_outliers_out(run);
  require_poses_for_folds(run);
  if (read_test) run.test = test_of(run.task, run.nominal, read_test);
  check_positions(run.task.robot_file, run.nominal, measurements.poses);
  run.report = robotics::report_calibration(run.nominal, measurements, run.task.options);
  run.task.options.progress = {};
  if (std::optional<Finding> far = robotics::far_readings(measurements, run.report); far && !run.task.robust) {
    far->words = [which = far->words](const Face& face) {
      return fmt::format("{}: {} leaves such readings out", which(face), face.switched("robust"));
    };
    measurements.warnings.push_back(std::move(*far));
  }
  run.models = judged_models(run.report, measurements, run.test, run.task.new_session);
  refuse_another_session(run);
  judge_correction_by_test(run);
  run.input_mistakes = robotics::input_mistakes(run.nominal, measurements, run.report);
  run.suspicion = robotics::likely_mistake(run.nominal, measurements);
  if (run.suspicion) {
    run.input_mistakes.push_back(finding("likely_mistake", run.suspicion->sentence));
    run.input_mistakes.back().is_mistake = true;
  }
  if (run.test) {
    if (const auto same = tests_that_took_part(measured, *run.test)) run.input_mistakes.push_back(*same);
    robotics::Poses used = run.test->poses;
    used.observations.clear();
    if (!run.test->poses.observations.empty()) used = select(used, robotics::position_rows(run.test->poses));
    run.used = robotics::coverage(run.report.calibration, measurements.poses, used, run.task.new_session);
  }
  if (run.task.quality) {
    run.details = calibration_details(run.nominal, measurements, run.report, run.task.options);
  }
  run.is_implausible = robotics::is_implausible(run.nominal, run.measurements, run.report) || !is_accepted(run);
  if (run.task.quality || (run.task.page && !run.is_implausible)) {
    const robotics::ReportOptions& options = run.task.options;
    run.learning = robotics::learning_curve(run.nominal, measurements, options.calibration, 3, options.seed);
  }
  run.acceptance = acceptance_of(run);
  run.refusal = refusal_of(run);
  return run;
}

}  // namespace llmt::report
