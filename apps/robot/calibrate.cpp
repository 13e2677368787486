#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <map>
#include <memory>
#include <set>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "llmt/robotics/calibration_report.hpp"
#include "llmt/robotics/robot_file.hpp"
#include "report/robot/calibration_facts.hpp"
#include "report/robot/measurement_text.hpp"
#include "report/robot/of_calibration.hpp"
#include "robot/commands.hpp"
#include "robot/corrected_file.hpp"
#include "robot/measured_file.hpp"
#include "shared/cli.hpp"
#include "shared/options.hpp"
#include "shared/report_files.hpp"

namespace llmt::apps {
namespace {

using robotics::CalibrationReport;

struct CalibrateArguments {
  std::string robot;
  robotics::UrdfLinks links;
  std::string data;
  std::string output;
  std::string test;
  bool contiguous = false;
  bool json = false;
  bool robust = false;
  bool quality = false;
  bool new_session = false;
  std::vector<std::string> priors;
  MeasuredFileOptions reading;
  robotics::ReportOptions options;
  ReportFiles reports;
};

// PARAMETER=SIGMA.
std::map<std::string, double> priors_of(const std::vector<std::string>& texts) {
  std::map<std::string, double> priors;
  for (const std::string& text : texts) {
    const std::size_t sign = text.find('=');
    if (sign == std::string::npos) {
      throw std::invalid_argument(fmt::format(
          "--prior: \"{}\" must be a parameter and its standard deviation in mm or deg, as joint2.a=0.1", text));
    }
    // Smaller ones are beyond the rounding of what they hold: --fix says that a parameter is known.
    constexpr NumberRange sigmas = {1e-9, largest_number,
                                    "a finite number, 1e-9 or more (mm or deg); --fix holds a parameter"};
    priors[text.substr(0, sign)] = read_number("--prior " + text.substr(0, sign), text.substr(sign + 1), sigmas);
  }
  return priors;
}

// Measurements that take no part, with frames of the calibrated robot or, in a new session, frames of their own.
robotics::Measurements read_test(const CalibrateArguments& arguments, const robotics::Robot& nominal) {
  robotics::Measurements test = read_measured(arguments.test, nominal, {}, arguments.reading);
  if (!arguments.new_session) {
    check_frames(arguments.test, nominal, test, "; --new-session fits base and tool to the test file");
  } else if (constexpr std::size_t values_of_frames = 9; robotics::measured_rows(test).size() <= values_of_frames) {
    throw std::runtime_error(fmt::format("{}: {} points do not tell base and tool ({} values) and the error, too",
                                         arguments.test, test.count(), values_of_frames));
  }
  check_positions(arguments.robot, robotics::with_frames(nominal, test.poses), test.poses);
  return test;
}

void calibrate_command(CalibrateArguments arguments) {
  arguments.options.calibration.priors = priors_of(arguments.priors);
  const robotics::Robot described = read_description(arguments.robot, arguments.data, arguments.links);
  refuse_lost_correction(described, arguments.robot, arguments.output);
  robotics::Measurements measurements =
      robotics::without_small_sessions(read_measured(arguments.data, described, {}, arguments.reading));
  if (measurements.count() == 0) throw std::runtime_error(arguments.data + ": " + measurements.warnings.back());
  const robotics::Robot nominal = robotics::with_frames(described, measurements);
  std::vector<Eigen::Index> outlier_lines;
  if (arguments.robust) {
    const robotics::RobustCalibration robust =
        robotics::calibrate_robustly(nominal, measurements, arguments.options.calibration);
    for (const std::size_t row : robust.left_out) outlier_lines.push_back(measurements.lines[row]);
    std::ranges::sort(outlier_lines);
    outlier_lines.erase(std::unique(outlier_lines.begin(), outlier_lines.end()), outlier_lines.end());
    robotics::Measurements kept = robotics::without_rows(measurements, robust.left_out);
    kept.warnings = measurements.warnings;
    kept.unused_columns = measurements.unused_columns;
    measurements = std::move(kept);
  }
  const std::vector<double> labels = robotics::pose_labels(measurements.poses);
  const Eigen::Index poses =
      labels.empty() ? measurements.count() : std::ssize(std::set<double>(labels.begin(), labels.end()));
  if (poses < arguments.options.folds) {
    throw std::runtime_error(
        fmt::format("{}: {} poses do not make {} folds", arguments.data, poses, arguments.options.folds));
  }
  std::optional<robotics::Measurements> test;
  if (!arguments.test.empty()) test = read_test(arguments, nominal);
  check_positions(arguments.robot, nominal, measurements.poses);
  arguments.options.kind = arguments.contiguous ? FoldKind::contiguous : FoldKind::random;
  ProgressBar bar("calibrating");
  arguments.options.progress = bar.callback();
  const CalibrationReport report = robotics::report_calibration(nominal, measurements, arguments.options);
  bar.clear();
  arguments.options.progress = {};
  if (const std::string far = robotics::far_readings(measurements, report); !far.empty() && !arguments.robust) {
    measurements.warnings.push_back(far + ": --robust leaves such readings out");
  }
  report::CalibrationFacts facts{.robot_file = arguments.robot,
                                 .data_file = arguments.data,
                                 .output = arguments.output,
                                 .note = use_of_orientations(measurements),
                                 .contiguous = arguments.contiguous,
                                 .nominal = nominal,
                                 .measurements = measurements,
                                 .report = report,
                                 .models = report::judged_models(report, measurements, test, arguments.new_session),
                                 .input_mistakes = robotics::input_mistakes(nominal, measurements, report),
                                 .outlier_lines = outlier_lines,
                                 .used = {},
                                 .details = {}};
  if (test) {
    robotics::Poses used = test->poses;
    used.observations.clear();
    if (!test->poses.observations.empty()) used = select(used, robotics::position_rows(test->poses));
    facts.used = robotics::coverage(report.calibration, measurements.poses, used, arguments.new_session);
  }
  if (arguments.quality) facts.details = report::calibration_details(nominal, measurements, report, arguments.options);
  SavedRobot written;
  const bool is_implausible = robotics::is_implausible(nominal, report);
  if (!arguments.output.empty() && !is_implausible) {
    written = save_corrected(report.best(), arguments.output, {arguments.robot, arguments.links});
  }
  std::string reports;
  if (arguments.reports.wanted()) {
    reports = write_reports(arguments.reports, report::calibration_report({arguments.robot, arguments.data, nominal,
                                                                           report::points_of(measurements), report,
                                                                           arguments.options, facts.input_mistakes}));
  }
  if (arguments.json) {
    print_json(report::calibration_json(facts));
  } else {
    print(report::calibration_text(facts, output_width()));
    if (!written.names.empty()) print(fmt::format("Written: {}\n", fmt::join(written.names, ", ")));
    print(written.beside_urdf);
    print(reports);
  }
  if (is_implausible) {
    throw std::runtime_error(fmt::format(
        "{}: the calibrated robot misses half of the points by more than a fiftieth of its length, or turns its tool "
        "otherwise than was measured: nothing is written; check units, order, signs and zeros of the joints, the order "
        "of quaternions or the convention of angles, and the description",
        arguments.data));
  }
  if (!report.calibration.result.converged()) {
    throw std::runtime_error(fmt::format("the calibration did not converge: {}", report.calibration.result.reason));
  }
}

}  // namespace

void add_calibrate(CLI::App& app) {
  CLI::App* command = app.add_subcommand(
      "calibrate",
      "Identify a robot's parameters from measured positions\n"
      "Identifies base, tool and geometry; with --correct, learns what is left as a function of the joint "
      "values. Held-out figures: everything, the size of the correction included, is fitted without the "
      "poses it is judged on. The correction is kept if it lowers the held-out mean error by more than two "
      "standard errors of the difference; with --folds 0 it is kept without a test.");
  command->footer("Example: llmt-robot calibrate robotics/robots/ur10.yaml measured.csv --correct -o calibrated.yaml");
  const auto arguments = std::make_shared<CalibrateArguments>();
  robotics::ReportOptions& options = arguments->options;
  add_input_file(*command, "robot", arguments->robot, "Robot description (YAML or URDF)")->required();
  add_urdf_links(*command, arguments->links);
  add_input_file(*command, "data", arguments->data, "Measurements (CSV with units in the column names)")->required();
  command->add_flag("--correct", options.correct, "Learn the residual as a function of the joint values");
  add_folds(*command, options.folds, "Folds of the held-out figures, 0: none");
  command->add_flag("--contiguous", arguments->contiguous, "Folds are blocks of consecutive rows: for paths and grids");
  add_input_file(*command, "--test", arguments->test, "Further measurements that take no part, judged at the end");
  command
      ->add_flag("--new-session", arguments->new_session,
                 "The test file is of another session: its base and tool are fitted to it first")
      ->needs("--test");
  add_measured_file_options(*command, arguments->reading);
  command->add_flag("--robust", arguments->robust, "Leave out readings that lie far off, and name their lines");
  add_names(*command, "--fix", options.calibration.fixed, "PARAMETER",
            "What to keep as given: joint2.a, joint3, base, tool");
  add_names(*command, "--only", options.calibration.only, "PARAMETER",
            "Free these and no others, base and tool included");
  add_names(*command, "--prior", arguments->priors, "PARAMETER=SIGMA",
            "Known beforehand to within a standard deviation, mm or deg: joint2.a=0.1");
  add_count(*command, "--max-leaves", options.correction.max_leaves, Eigen::Index{0},
            "Most leaves of a tree of the correction, 0: no limit")
      ->capture_default_str();
  add_count(*command, "--min-leaf", options.correction.min_leaf_samples, Eigen::Index{0},
            "Fewest poses in a leaf, 0: twice the coefficients of a leaf")
      ->capture_default_str();
  add_seed(*command, options.seed, "Of the random folds");
  add_threads(*command, options.max_threads);
  add_output_file(*command, "-o,--output", arguments->output,
                  "Calibrated description to write (the correction goes beside it)", {correction_extension});
  add_report_options(*command, arguments->reports, "the share of the poses below every error");
  command->add_flag("--quality", arguments->quality,
                    "Print also how well the poses determine the parameters, and whether more would help");
  command->add_flag("--json", arguments->json, "Print the report as JSON");
  command->callback([command, arguments] {
    check_beside_urdf(*command, arguments->output);
    calibrate_command(*arguments);
  });
}

}  // namespace llmt::apps
