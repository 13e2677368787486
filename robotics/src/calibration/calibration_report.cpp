#include "llmt/robotics/calibration_report.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "calibration/input_mistakes.hpp"
#include "calibration/suspected_changes.hpp"
#include "calibration/travel.hpp"
#include "llmt/statistics.hpp"

namespace llmt::robotics {
namespace {

struct Fitted {
  Calibration calibration;
  std::optional<Correction> correction;
};

Fitted fit_all(const Robot& robot, const Measurements& measurements, const ReportOptions& options, Work& work) {
  Fitted fitted{.calibration = calibrate(robot, measurements, options.calibration), .correction = {}};
  work.check();
  if (!options.correct) return fitted;
  const std::vector<double> labels = pose_labels(measurements.poses);
  if (options.boost) {
    const BoostOptions boost{.seed = options.seed, .max_threads = options.max_threads};
    fitted.correction =
        fit_boosted_correction(fitted.calibration.robot, measurements, boost, labels, work.progress()).model;
    return fitted;
  }
  FitOptions fit = options.correction;
  fit.validity = ValidityChoice::crisp;
  fit.folds = {.count = options.correction_folds, .kind = options.kind, .seed = options.seed};
  fit.intervals = false;
  fit.max_threads = options.max_threads;
  fitted.correction = fit_correction(fitted.calibration.robot, measurements, fit, labels, work.progress()).model;
  return fitted;
}

struct Distances {
  Eigen::VectorXd nominal;
  Eigen::VectorXd geometric;
  Eigen::VectorXd corrected;  // empty without correction
};

Distances distances_of(const Fitted& fitted, const Measurements& measurements) {
  Distances result;
  result.nominal = distances(positions(fitted.calibration.registered, measurements.poses), measurements);
  result.geometric = distances(positions(fitted.calibration.robot, measurements.poses), measurements);
  if (fitted.correction) {
    const CorrectedRobot corrected{fitted.calibration.robot, fitted.correction};
    result.corrected = distances(positions(corrected, measurements.poses), measurements);
  }
  return result;
}

constexpr double implausible_share = 0.02;

void hold_out(const Robot& robot, const Measurements& measurements, const ReportOptions& options, Work& work,
              CalibrationReport& report) {
  const Eigen::Index n = measurements.count();
  const std::vector<double> labels = pose_labels(measurements.poses);
  report.grouped = !labels.empty();
  report.nominal.held_out_mm.resize(n);
  report.geometric.held_out_mm.resize(n);
  if (report.corrected) report.corrected->held_out_mm.resize(n);
  for (const Fold& fold : make_folds(n, {.count = options.folds, .kind = options.kind, .seed = options.seed}, labels)) {
    const Measurements trained = select(measurements, fold.train);
    const Measurements left_out = select(measurements, fold.held_out);
    work.begin(fmt::format("fold {}", report.fold_terminations.size() + 1));
    Work part(work, 1.0 / (options.folds + 1));
    Fitted fitted = fit_all(robot, trained, options, part);
    for (Robot* placed : {&fitted.calibration.registered, &fitted.calibration.robot}) {
      *placed = with_placed_frames(*placed, left_out, trained.poses);
    }
    const Distances held_out = distances_of(fitted, left_out);
    report.fold_terminations.push_back(fitted.calibration.result.termination);
    report.nominal.held_out_mm(fold.held_out) = held_out.nominal;
    report.geometric.held_out_mm(fold.held_out) = held_out.geometric;
    if (report.corrected) report.corrected->held_out_mm(fold.held_out) = held_out.corrected;
    part.finish();
  }
  report.folds = options.folds;
}

// Errors that were kept by row become distances of points and angles of orientations.
void part_kinds(const Measurements& measurements, Stage& stage) {
  const std::vector<Eigen::Index> turns = orientation_rows(measurements.poses);
  if (turns.empty()) return;
  const std::vector<Eigen::Index> points = position_rows(measurements.poses);
  const auto part = [&](Eigen::VectorXd& of_rows, Eigen::VectorXd& angles) {
    if (of_rows.size() == 0) return;
    angles = 1e3 / measurements.poses.observations[turns.front()].lever_mm * of_rows(turns);
    of_rows = Eigen::VectorXd(of_rows(points));
  };
  part(stage.in_sample_mm, stage.in_sample_mrad);
  part(stage.held_out_mm, stage.held_out_mrad);
}

void decide(CalibrationReport& report) {
  if (!report.corrected) {
    report.decision = "no correction was asked for";
  } else if (report.folds == 0) {
    report.correction_kept = true;
    report.decision = "the correction is kept without being judged: no poses were held out";
  } else {
    const PairedDifference gain = paired_difference(report.geometric.held_out_mm, report.corrected->held_out_mm);
    report.correction_kept = gain.is_beyond_chance();
    const std::string figures = fmt::format("held-out mean {:.4f} mm with it, {:.4f} mm without",
                                            report.corrected->held_out_mm.mean(), report.geometric.held_out_mm.mean());
    report.decision = report.correction_kept ? fmt::format("the correction is kept: {}", figures)
                      : gain.mean <= 0.0
                          ? fmt::format("the correction is left out, it makes unseen poses worse: {}", figures)
                          : fmt::format("the correction is left out, its gain is within chance (+-{:.4f} mm): {}",
                                        2.0 * gain.standard_error, figures);
  }
}

// A calibrated arm turns its tool wrong by some mrad, a wrong convention by about 1 rad.
bool has_wrong_orientations(const CalibrationReport& report) {
  constexpr double implausible_mrad = 50.0;
  const Eigen::VectorXd& errors = report.geometric.in_sample_mrad;
  return errors.size() > 0 && errors.mean() > implausible_mrad;
}

}  // namespace

ErrorFigures error_figures(const Eigen::VectorXd& distances_mm) {
  if (distances_mm.size() == 0) throw std::invalid_argument("llmt::robotics::error_figures: there are no distances");
  std::vector<double> sorted(distances_mm.data(), distances_mm.data() + distances_mm.size());
  std::ranges::sort(sorted);
  const auto count = static_cast<double>(sorted.size());
  const auto rank = static_cast<std::size_t>(std::ceil(0.95 * count)) - 1;
  return {.mean = distances_mm.mean(),
          .max = sorted.back(),
          .p95 = sorted[rank],
          .rms = distances_mm.norm() / std::sqrt(count)};
}

CorrectedRobot CalibrationReport::best() const {
  CorrectedRobot robot{.robot = calibration.robot, .correction = {}};
  if (correction_kept) robot.correction = correction;
  return robot;
}

double size_of(const Chain& chain, const Measurements& measurements) {
  const double size = reach_of(chain) - chain.tool.xyz_mm.norm() + travel_of(chain, measurements.poses);
  if (size > 0.0 || measurements.count() == 0) return size;
  const Eigen::MatrixXd& points = measurements.positions_mm;
  return std::sqrt((points.rowwise() - points.colwise().mean()).squaredNorm() / static_cast<double>(points.rows()));
}

bool is_implausible(const Robot& nominal, const Measurements& measurements, const CalibrationReport& report) {
  if (has_wrong_orientations(report)) return true;
  return median(report.geometric.in_sample_mm) > implausible_share * size_of(nominal.chain, measurements);
}

std::vector<Finding> input_mistakes(const Robot& robot, const Measurements& measurements,
                                    const CalibrationReport& report) {
  std::vector<Finding> found;
  const auto add = [&](const char* code, std::string sentence) {
    found.push_back(finding(code, std::move(sentence)));
    found.back().is_mistake = true;
  };
  const double length_mm = size_of(robot.chain, measurements);
  for (std::size_t j = 0; j < robot.chain.joints.size(); ++j) {
    const Joint& joint = robot.chain.joints[j];
    if (!joint.limits) continue;
    const Eigen::ArrayXd values = measurements.poses.joints.col(j) * to_limit_unit(joint);
    constexpr double slack = 1.0;  // degree or mm
    const Eigen::Index outside = (values < joint.limits->at(0) - slack || values > joint.limits->at(1) + slack).count();
    if (outside > 0) {
      add("joint_limits",
          fmt::format(
              "{} of {} values of {} {} outside its limits, {:.4g} to {:.4g} {} ({:.4g} to {:.4g} {} measured): "
              "are the units right, is it this robot?",
              outside, measurements.count(), joint.name, outside == 1 ? "lies" : "lie", joint.limits->at(0),
              joint.limits->at(1), limit_unit(joint), values.minCoeff(), values.maxCoeff(), limit_unit(joint)));
    }
  }
  const double implausible_mm = implausible_share * length_mm;
  const bool is_held_out = report.geometric.held_out_mm.size() > 0;
  const auto coordinates = std::ssize(measured_rows(measurements));
  const Eigen::Index parameters = report.calibration.result.rank;
  constexpr Eigen::Index fewest_per_parameter = 2;
  if (coordinates < fewest_per_parameter * parameters) {
    add("few_poses",
        fmt::format("{} parameters were identified from {} measured coordinates: so few poses can be fitted by wrong "
                    "values; only the error on poses left out says something, and more poses are needed",
                    parameters, coordinates));
  } else if (is_held_out && report.geometric.held_out_mm.mean() >= report.nominal.held_out_mm.mean()) {
    add("no_gain",
        "on poses left out the calibrated robot is no better than the described one: keep the description, or measure "
        "more poses");
  }
  const double nominal = report.nominal.in_sample_mm.mean();
  const double calibrated = (is_held_out ? report.geometric.held_out_mm : report.geometric.in_sample_mm).mean();
  if (calibrated > implausible_mm) {
    add("calibrated_misses",
        fmt::format("the calibrated robot still misses the {} by {:.4g} mm on average, {:.0f} % of the machine's size: "
                    "this description does not belong to these measurements, and the identified values mean nothing; "
                    "check units, signs and zeros of the joints, their order, and whether it is this robot",
                    is_held_out ? "held-out points" : "measured points", calibrated, 100.0 * calibrated / length_mm));
  } else if (nominal > implausible_mm) {
    add("described_misses",
        fmt::format("the described robot misses the measured points by {:.4g} mm on average, whatever its base and "
                    "tool: check units, signs and zeros of the joints, their order, and the description",
                    nominal));
  }
  if (has_wrong_orientations(report)) {
    const std::string likely = orientation_mistake(robot, measurements);
    add("turned", fmt::format("the calibrated robot turns its tool by {:.3g} mrad otherwise than was measured{}",
                              report.geometric.in_sample_mrad.mean(),
                              likely.empty() ? ": is the quaternion w, x, y, z, is the convention of angles right?"
                                             : "; most likely " + likely));
  }
  return found;
}

namespace {

// The largest error of an honest reading, mm.
double far_limit(const Eigen::VectorXd& errors_mm) {
  constexpr double far = 8.0;  // times the median
  constexpr double upper = 0.85;
  constexpr double deviations_of_upper = 1.036;  // of a normal variable
  constexpr double most_deviations = 4.0;
  std::vector<double> sorted(errors_mm.begin(), errors_mm.end());
  std::ranges::sort(sorted);
  const double median = sorted[sorted.size() / 2];
  if (median == 0.0) return 0.0;
  const double quantile = sorted[static_cast<std::size_t>(upper * static_cast<double>(sorted.size()))];
  const double deviation = std::log(quantile / median) / deviations_of_upper;
  return median * std::max(far, std::exp(most_deviations * deviation));
}

}  // namespace

void remember_errors(CalibrationRecord& record, const Eigen::VectorXd& left_out_mm) {
  const double limit = far_limit(left_out_mm);
  std::vector<double> honest;
  std::ranges::copy_if(left_out_mm, std::back_inserter(honest), [&](double error) { return error <= limit; });
  // Errors of 0 have no limit.
  const Eigen::VectorXd errors = honest.empty() ? left_out_mm : Eigen::VectorXd::Map(honest.data(), std::ssize(honest));
  const auto freedom = static_cast<double>(std::max<Eigen::Index>(1, errors.size() - 1));
  record.held_out_mm = errors.mean();
  record.held_out_poses = errors.size();
  record.held_out_sd_mm = (errors.array() - errors.mean()).matrix().norm() / std::sqrt(freedom);
}

std::optional<Finding> far_readings(const Measurements& measurements, const CalibrationReport& report) {
  const bool is_held_out = report.geometric.held_out_mm.size() > 0;
  const Eigen::VectorXd& errors = is_held_out ? report.geometric.held_out_mm : report.geometric.in_sample_mm;
  constexpr Eigen::Index fewest = 10;
  if (errors.size() < fewest) return {};
  constexpr double much = 0.25;        // of the squares
  constexpr double few = 0.05;         // of the readings
  constexpr double few_all = 3.0;      // of a short file
  constexpr double short_few = 0.125;  // of its readings
  constexpr std::size_t most_lines = 10;
  const double limit = far_limit(errors);
  const std::vector<Eigen::Index> rows = position_rows(measurements.poses);
  std::vector<Eigen::Index> lines;
  double squares = 0.0;
  for (Eigen::Index k = 0; k < errors.size(); ++k) {
    if (errors(k) <= limit) continue;
    squares += errors(k) * errors(k);
    lines.push_back(measurements.lines.empty() ? rows[k] + 1 : measurements.lines[rows[k]]);
  }
  const auto count = static_cast<double>(errors.size());
  const bool is_few = static_cast<double>(lines.size()) <= std::max(few * count, std::min(few_all, short_few * count));
  if (lines.empty() || !is_few || squares < much * errors.squaredNorm()) return {};
  const std::string said = fmt::format("{} of {} readings lie far off and make {:.0f} % of the squared error",
                                       lines.size(), errors.size(), 100.0 * squares / errors.squaredNorm());
  return Finding{"far_readings",
                 [said, lines, has_lines = !measurements.lines.empty()](const Face& face) {
                   return fmt::format("{} ({})", said,
                                      has_lines ? face.rows(lines, most_lines) : numbered("row", lines, most_lines));
                 },
                 lines};
}

CalibrationReport report_calibration(const Robot& robot, const Measurements& measurements,
                                     const ReportOptions& options) {
  CalibrationReport report;
  Work work(options.progress);
  work.begin("all poses");
  Work part(work, 1.0 / (options.folds + 1));
  Fitted fitted = fit_all(robot, measurements, options, part);
  const Distances in_sample = distances_of(fitted, measurements);
  report.calibration = std::move(fitted.calibration);
  report.correction = std::move(fitted.correction);
  report.nominal.in_sample_mm = in_sample.nominal;
  report.geometric.in_sample_mm = in_sample.geometric;
  if (options.correct) report.corrected = Stage{.in_sample_mm = in_sample.corrected, .held_out_mm = {}};
  part.finish();
  if (options.folds != 0) hold_out(robot, measurements, options, work, report);
  part_kinds(measurements, report.nominal);
  part_kinds(measurements, report.geometric);
  if (report.corrected) part_kinds(measurements, *report.corrected);
  decide(report);
  if (options.folds != 0) {
    const Eigen::VectorXd& errors = (report.correction_kept ? *report.corrected : report.geometric).held_out_mm;
    remember_errors(*report.calibration.robot.calibration, errors);
  }
  work.finish();
  return report;
}

}  // namespace llmt::robotics
