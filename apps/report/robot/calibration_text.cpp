#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>

#include "report/robot/calibration_facts.hpp"
#include "report/robot/measurement_text.hpp"

namespace llmt::report {
namespace {

using robotics::CalibrationReport;
using robotics::error_figures;
using robotics::ErrorFigures;

std::string kind_of(const robotics::Measurements& measurements) {
  const std::vector<robotics::Observation>& seen = measurements.poses.observations;
  return !seen.empty() && seen.front().reading == robotics::Reading::distance ? "distance" : "position";
}

// One kind of error, in-sample, held-out and on the test file.
std::string error_table(const std::vector<JudgedModel>& rows, const std::string& head, bool is_held_out,
                        const Eigen::VectorXd robotics::Stage::*in_sample,
                        const Eigen::VectorXd robotics::Stage::*held_out,
                        const std::optional<ErrorFigures> JudgedModel::*on_test, std::size_t width) {
  std::vector<std::string> header = {head, "mean", "95 %", "max"};
  if (is_held_out) header.insert(header.end(), {"| mean", "95 %", "max"});
  if (rows.front().*on_test) header.insert(header.end(), {"| mean", "95 %", "max"});
  Table table(header);
  for (const JudgedModel& row : rows) {
    std::vector<std::string> cells = {row.name};
    const auto add = [&](const ErrorFigures& figures) {
      for (const double value : {figures.mean, figures.p95, figures.max}) cells.push_back(fmt::format("{:.4f}", value));
    };
    add(error_figures(row.stage->*in_sample));
    if (is_held_out) add(error_figures(row.stage->*held_out));
    if (row.*on_test) add(*(row.*on_test));
    table.add(std::move(cells));
  }
  return table.text(width);
}

std::string error_tables(const std::vector<JudgedModel>& rows, const CalibrationReport& report, bool contiguous,
                         const std::string& kind, std::size_t width) {
  using robotics::Stage;
  const bool is_held_out = report.folds > 0;
  std::string text = "in-sample";
  if (is_held_out)
    text += fmt::format(", then held-out ({} {} folds)", report.folds, contiguous ? "contiguous" : "random");
  if (rows.front().test) text += ", then on the test file";
  text += ":\n" + error_table(rows, kind + " error, mm", is_held_out, &Stage::in_sample_mm, &Stage::held_out_mm,
                              &JudgedModel::test, width);
  if (report.geometric.in_sample_mrad.size() == 0) return text;
  return text + error_table(rows, "orientation error, mrad", is_held_out, &Stage::in_sample_mrad, &Stage::held_out_mrad,
                            &JudgedModel::test_mrad, width);
}

// As many decimals as show two digits of the standard error, at most six: lengths in mm and angles in degrees are never
// known better.
std::string to_error(double value, double error) {
  constexpr int most = 6;
  const bool is_known = std::isfinite(error) && error > 0.0;
  const int decimals = is_known ? std::clamp(1 - static_cast<int>(std::floor(std::log10(error))), 0, most) : most;
  const std::string text = fmt::format("{:.{}f}", value, decimals);
  return text.find_first_not_of("-0.") == std::string::npos ? fmt::format("{:.{}f}", 0.0, decimals) : text;
}

std::string parameter_table(const robotics::Robot& nominal, const CalibrationReport& report, std::size_t width) {
  const std::vector<discovery::Parameter> before = robotics::parameters(nominal);
  const discovery::SolverResult& result = report.calibration.result;
  Table table({"parameter", "nominal", "identified", "change", "std error", "unit"});
  for (std::size_t k = 0; k < result.parameters.size(); ++k) {
    const discovery::Parameter& after = result.parameters[k];
    const auto nominal_value = std::ranges::find(before, after.name, &discovery::Parameter::name);
    if (after.free && nominal_value != before.end()) {
      const double error = result.standard_errors(k);
      const bool is_geometric = after.unit == "mm" || after.unit == "deg";
      const auto shown = [&](double value, int digits) {
        return is_geometric ? to_error(value, error) : number(value, digits);
      };
      table.add({after.name, shown(nominal_value->value, 7), shown(after.value, 7),
                 shown(after.value - nominal_value->value, 4), std::isfinite(error) ? shown(error, 2) : "-",
                 after.unit});
    }
  }
  return table.text(width);
}

std::string parameters_text(const CalibrationFacts& facts, std::size_t width) {
  const robotics::CalibrationReport& report = facts.report;
  const discovery::SolverResult& result = report.calibration.result;
  std::string text;
  text += fmt::format("\n{}\n", parameter_table(facts.nominal, report, width));
  text += result.converged()
              ? fmt::format("{} parameters identified; the fit converged after {} iterations\n", result.rank,
                            result.iterations)
              : fmt::format("{} parameters identified; the fit did NOT converge: {}\n", result.rank, result.reason);
  if (report.calibration.began_without_priors) {
    text +=
        "The description is far off. Two starts were tried; the second one won, which began without the priors that "
        "hold "
        "parameters near it\n";
  }
  std::vector<std::string> kept;
  std::vector<std::string> dependent;
  std::vector<std::string> unseen;
  for (const robotics::FixedParameter& fixed : report.calibration.fixed) {
    (fixed.why == "fixed by the user"       ? kept
     : fixed.why == robotics::unseen_motion ? unseen
                                            : dependent)
        .push_back(fixed.name);
  }
  if (!dependent.empty()) {
    text += fmt::format(
        "Not identified but kept as described, because they move the measured point as parameters above do, or not at "
        "all: {}\n",
        fmt::join(dependent, ", "));
  }
  if (!unseen.empty()) {
    text += fmt::format("Kept as described, because only the motion of joints that hardly moved could tell: {}\n",
                        fmt::join(unseen, ", "));
  }
  if (!kept.empty()) text += fmt::format("Kept as described by --fix or --only: {}\n", fmt::join(kept, ", "));
  if (const std::string uncertain = uncertain_text(report.calibration.robot); !uncertain.empty()) {
    text += fmt::format(
        "Uncertain values: {}. These poses do not determine each of them alone, so do not take them for "
        "the true ones. Positions near these poses do not suffer: all values together give them.\n",
        uncertain);
  }
  for (const discovery::Combination& combination : result.unidentifiable) {
    text += fmt::format("These poses determine only a combination of: {}\n", combination.names());
  }
  return text;
}

// The sentence to read if only one is read.
std::string verdict(const CalibrationFacts& facts) {
  const CalibrationReport& report = facts.report;
  const bool is_held_out = report.folds > 0;
  const auto mean = [&](const robotics::Stage& stage) {
    return (is_held_out ? stage.held_out_mm : stage.in_sample_mm).mean();
  };
  std::string text;
  for (const std::string& mistake : facts.input_mistakes) text += "WARNING: " + mistake + "\n";
  if (facts.input_mistakes.empty()) {
    text += fmt::format("Calibrated: the mean {} error falls from {:.4f} to {:.4f} mm", kind_of(facts.measurements),
                        mean(report.nominal), mean(report.geometric));
    if (report.correction_kept) {
      const double corrected = mean(*report.corrected);
      text += fmt::format(", and {}to {:.4f} mm with the correction",
                          corrected <= mean(report.geometric) ? "" : "rises again ", corrected);
    }
    text += is_held_out ? ", on poses left out of the fit.\n"
                        : ", on the poses of the fit; none were left out to judge it.\n";
  }
  return text;
}

// The length that stands for the scale where no reading shows it, or nothing.
std::string kept_length(const CalibrationReport& report) {
  for (const robotics::FixedParameter& fixed : report.calibration.fixed) {
    if (fixed.why == robotics::unseen_scale) return fixed.name;
  }
  return "";
}

// "only x and y were measured", or nothing.
std::string missing_axes(const robotics::Measurements& measurements) {
  const std::vector<robotics::Observation>& observations = measurements.poses.observations;
  const std::string base = observations.empty() ? "" : observations.front().base;
  if (robotics::is_plane(base)) return "Note: all errors are distances from the planes\n";
  if (robotics::is_sphere(base) || robotics::is_known_sphere(base)) {
    return "Note: all errors are distances from the surfaces of the spheres\n";
  }
  if (kind_of(measurements) == "distance") return "";
  std::vector<std::string> seen;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    if (measurements.measured[axis]) seen.emplace_back(1, "xyz"[axis]);
  }
  if (seen.size() == 3) return "";
  return fmt::format("Note: only {} {} measured; all errors are of {}\n", fmt::join(seen, " and "),
                     seen.size() == 1 ? "was" : "were", seen.size() == 1 ? "it" : "these");
}

std::string head(const CalibrationFacts& facts) {
  const robotics::Measurements& measurements = facts.measurements;
  std::string text = fmt::format("{}: {} of {}\n", facts.data_file, counts_of(measurements), facts.nominal.chain.name);
  text += verdict(facts) + missing_axes(measurements);
  const std::vector<robotics::Observation>& seen = measurements.poses.observations;
  if (std::ranges::any_of(seen, robotics::is_known_sphere, &robotics::Observation::base)) {
    text +=
        "Note: the radii in the file give the scale: 0.1 % of error there is 0.1 % of every position. The errors are "
        "scatter at spheres, not errors of positions elsewhere\n";
  }
  if (const std::string kept = kept_length(facts.report); !kept.empty()) {
    text += fmt::format(
        "Note: no reading shows the scale. All lengths are relative to {}, kept as described: 0.1 % of error there is "
        "0.1 % of every position. The errors are scatter at what was touched, not errors of positions elsewhere\n",
        kept);
  }
  for (const std::string& warning : measurements.warnings) text += "Note: " + warning + "\n";
  if (!facts.report.calibration.still.empty()) text += "Note: " + still_text(facts.report.calibration.still) + "\n";
  if (!facts.outlier_lines.empty()) {
    text += fmt::format("Left out, more than four times as far off as the median: line{} {}\n",
                        facts.outlier_lines.size() == 1 ? "" : "s", fmt::join(facts.outlier_lines, ", "));
  }
  if (!measurements.unused_columns.empty()) {
    text += fmt::format("Columns not used: {}\n", fmt::join(measurements.unused_columns, ", "));
  }
  return text + facts.note;
}

std::string coverage_text(const robotics::Coverage& used) {
  if (used.outside.empty()) return "";
  std::vector<std::string> joints;
  for (const robotics::JointBeyond& range : used.beyond) {
    joints.push_back(fmt::format("{} {:.0f} to {:.0f} {} (measured {:.0f} to {:.0f})", range.joint, range.used_low,
                                 range.used_high, range.unit, range.measured_low, range.measured_high));
  }
  return fmt::format(
      "{} test poses lie outside of what was measured: {}. There the parameters leave the tool uncertain by {:.4f} mm "
      "(one standard deviation; inside: {:.4f} mm), and errors of the arm that show only there are unknown.\n",
      used.outside.size(), fmt::join(joints, ", "), used.deviation_outside_mm, used.deviation_inside_mm);
}

std::string details_text(const CalibrationDetails& details, std::size_t width) {
  const robotics::Observability& seen = details.seen;
  std::string text = "\nHow well these poses determine the parameters\n";
  text += fmt::format("  mean error with each pose left out in turn (to first order): {:.4f} mm\n",
                      details.leave_one_out_mm);
  if (details.repeats) {
    text += fmt::format("  noise of one coordinate by {} repeats: {:.4f} mm\n", details.repeats->freedom,
                        details.repeats->sigma_mm);
  }
  text += fmt::format("  observability: O1 {:.4g}, O2 {:.4g}, O3 {:.4g}, O4 {:.4g}, O5 {:.4g}; condition {:.4g}\n",
                      seen.o1, seen.o2, seen.o3, seen.o4, seen.o5, seen.condition);
  for (const CalibrationDetails::Correlation& pair : details.correlations) {
    text += fmt::format("  {} and {} are strongly correlated: {:.3f}\n", pair.first, pair.second, pair.value);
  }
  if (!details.learning.empty()) {
    Table table({"poses", "mean error at them, mm", "at a fifth of all poses, left out"});
    for (const robotics::LearningPoint& point : details.learning) {
      table.add({std::to_string(point.poses), fmt::format("{:.4f}", point.fitted_mm),
                 fmt::format("{:.4f}", point.held_out_mm)});
    }
    text += "\nWould more poses help? Errors of calibrations to that many poses\n" + table.text(width);
  }
  if (!details.shares.empty()) {
    text += "\nOf the mean square error of the described arm\n";
    for (const CalibrationDetails::Share& share : details.shares) {
      text += fmt::format("  {:<24}{:6.1f} %\n", share.of, 100.0 * share.share);
    }
  }
  return text;
}

}  // namespace

std::string calibration_text(const CalibrationFacts& facts, std::size_t width) {
  const CalibrationReport& report = facts.report;
  if (robotics::is_implausible(facts.nominal, report)) return head(facts);  // no value means anything
  std::string text = head(facts) + parameters_text(facts, width);
  text += "\n" + error_tables(facts.models, report, facts.contiguous, kind_of(facts.measurements), width);
  text += "nominal: base and tool fitted to the poses, everything else as described.\n";
  if (report.folds > 0) {
    text +=
        fmt::format("held-out: on poses that were left out of the fit{}. in-sample: on the poses that were fitted.\n",
                    kept_length(report).empty() ? "; take these for the error at new poses" : "");
  }
  if (report.correction) {
    std::vector<std::string> leaves;
    for (const PartitionSummary& partition : report.correction->summary.partitions) {
      for (const int output : partition.outputs) {
        leaves.push_back(fmt::format("{} {}", report.correction->model.outputs()[output].name, partition.leaves));
      }
    }
    text += fmt::format("Leaves of the correction: {}\n", fmt::join(leaves, ", "));
  }
  if (!report.decision.empty()) text += report.decision + "\n";
  if (facts.used) text += coverage_text(*facts.used);
  if (facts.details) text += details_text(*facts.details, width);
  return text;
}

}  // namespace llmt::report
