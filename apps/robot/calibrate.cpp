#include <fmt/format.h>
#include <fmt/ranges.h>

#include <map>
#include <memory>
#include <stdexcept>
#include <string>
#include <vector>

#include "llmt/robotics/robot_file.hpp"
#include "report/document/document_text.hpp"
#include "report/robot/calibration_document.hpp"
#include "report/robot/calibration_run.hpp"
#include "report/robot/of_calibration.hpp"
#include "robot/commands.hpp"
#include "robot/corrected_file.hpp"
#include "robot/measured_file.hpp"
#include "robot/provenance.hpp"
#include "shared/cli.hpp"
#include "shared/options.hpp"
#include "shared/report_files.hpp"

namespace llmt::apps {
namespace {

struct CalibrateArguments {
  robotics::UrdfLinks links;
  std::string output;
  bool contiguous = false;
  bool json = false;
  std::vector<std::string> priors;
  MeasuredFileOptions reading;
  report::CalibrationTask task;
  Stated stated;
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

void calibrate_command(const CLI::App& command, CalibrateArguments arguments) {
  report::CalibrationTask& task = arguments.task;
  task.page = arguments.reports.wanted();
  robotics::ReportOptions& options = task.options;
  options.calibration.priors = priors_of(arguments.priors);
  options.kind = arguments.contiguous ? FoldKind::contiguous : FoldKind::random;
  const robotics::Robot described = read_description(task.robot_file, task.data_file, arguments.links);
  refuse_lost_correction(described, task.robot_file, arguments.output);
  report::ReadMeasurements read_test;
  if (!task.test_file.empty()) {
    read_test = [&](const robotics::Robot& nominal) {
      return read_measured(task.test_file, nominal, {}, arguments.reading);
    };
  }
  ProgressBar bar("calibrating");
  options.progress = bar.callback();
  report::CalibrationRun run = report::run_calibration(
      described, read_measured(task.data_file, described, {}, arguments.reading), read_test, task);
  bar.clear();
  run.report.calibration.robot.calibration->made_from = provenance_of(command,
                                                                      {{"description", task.robot_file},
                                                                       {"measurements", task.data_file},
                                                                       {"test", task.test_file},
                                                                       {"column map", arguments.reading.columns}},
                                                                      arguments.stated);
  SavedRobot written;
  if (!arguments.output.empty() && !run.is_implausible) {
    written = save_corrected(run.report.best(), arguments.output, {task.robot_file, arguments.links});
  }
  std::string reports;
  if (task.page) reports = write_reports(arguments.reports, report::calibration_page(run));
  if (arguments.json) {
    print_json(report::calibration_json(run, arguments.output));
  } else {
    print(report::document_text(report::calibration_document(run), output_width()));
    if (!run.acceptance.sentence.empty()) print(run.acceptance.sentence + "\n");
    if (!written.names.empty()) print(fmt::format("Written: {}\n", fmt::join(written.names, ", ")));
    print(written.beside_urdf);
    print(reports);
  }
  using Verdict = report::Acceptance::Verdict;
  if (!run.refusal.empty() && run.acceptance.verdict == Verdict::not_evaluated) {
    throw report::NotEvaluated(run.refusal);
  }
  if (!run.refusal.empty()) throw std::runtime_error(run.refusal);
  if (run.acceptance.verdict == Verdict::not_evaluated) throw ExitCode{exit_not_evaluated};
  if (run.acceptance.verdict == Verdict::fail) throw ExitCode{exit_refused};
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
  report::CalibrationTask& task = arguments->task;
  robotics::ReportOptions& options = task.options;
  add_input_file(*command, "robot", task.robot_file, "Robot description (YAML or URDF)")->required();
  add_urdf_links(*command, arguments->links);
  add_input_file(*command, "data", task.data_file, "Measurements (CSV with units in the column names)")->required();
  command->add_flag("--correct", options.correct, "Learn the residual as a function of the joint values");
  CLI::Option* const boost = command->add_flag(
      "--boost", options.boost, "Learn it with a sum of many small trees, more accurate, in place of one");
  boost->needs("--correct");
  add_folds(*command, options.folds, "Folds of the held-out figures, 0: none");
  command->add_flag("--contiguous", arguments->contiguous, "Folds are blocks of consecutive rows: for paths and grids");
  add_input_file(*command, "--test", task.test_file, "Further measurements that take no part, judged at the end");
  command
      ->add_flag("--new-session", task.new_session,
                 "The test file is of another session: its base and tool are fitted to it first")
      ->needs("--test");
  add_measured_file_options(*command, arguments->reading);
  command->add_flag("--robust", task.robust, "Leave out readings that lie far off, and name their lines");
  add_names(*command, "--fix", options.calibration.fixed, "PARAMETER",
            "What to keep as given: joint2.a, joint3, base, tool");
  add_names(*command, "--only", options.calibration.only, "PARAMETER",
            "Free these and no others, base and tool included");
  add_names(*command, "--prior", arguments->priors, "PARAMETER=SIGMA",
            "Known beforehand to within a standard deviation, mm or deg: joint2.a=0.1");
  add_count(*command, "--max-leaves", options.correction.max_leaves, Eigen::Index{0},
            "Most leaves of a tree of the correction, 0: no limit")
      ->capture_default_str()
      ->excludes(boost);
  add_count(*command, "--min-leaf", options.correction.min_leaf_samples, Eigen::Index{0},
            "Fewest poses in a leaf, 0: twice the coefficients of a leaf")
      ->capture_default_str()
      ->excludes(boost);
  command
      ->add_option("--accept-suspicion", task.accept_suspicion,
                   "Take the files as they stand although they look like this mistake, by the name that was printed")
      ->type_name("NAME");
  add_number(*command, "--limit-mm", task.limit_mm, above_zero,
             "Largest mean error to be accepted, on the test file or else on poses left out: pass is exit code 0, fail "
             "1, not evaluated 4");
  add_stated(*command, arguments->stated);
  add_seed(*command, options.seed, "Of the random folds");
  add_threads(*command, options.max_threads);
  add_output_file(*command, "-o,--output", arguments->output,
                  "Calibrated description to write (the correction goes beside it)", {correction_extension});
  add_report_options(*command, arguments->reports, "the share of the poses below every error");
  command->add_flag("--quality", task.quality,
                    "Print also how well the poses determine the parameters, and whether more would help");
  command->add_flag("--json", arguments->json, "Print the report as JSON");
  command->callback([command, arguments] {
    check_beside_urdf(*command, arguments->output);
    calibrate_command(*command, *arguments);
  });
}

}  // namespace llmt::apps
