#include <fmt/format.h>
#include <fmt/ranges.h>

#include <functional>
#include <memory>
#include <optional>

#include "llmt/robotics/catalogue.hpp"
#include "llmt/robotics/robot_file.hpp"
#include "report/robot/discovery/discovery_run.hpp"
#include "report/robot/discovery/of_discovery.hpp"
#include "report/robot/measurement_text.hpp"
#include "robot/commands.hpp"
#include "robot/corrected_file.hpp"
#include "robot/measured_file.hpp"
#include "robot/provenance.hpp"
#include "shared/cli.hpp"
#include "shared/options.hpp"
#include "shared/report_files.hpp"

namespace llmt::apps {
namespace {

struct DiscoverArguments {
  std::string robot;
  robotics::UrdfLinks links;
  std::string data;
  std::string test;
  std::string catalogue;
  std::string output;
  bool json = false;
  MeasuredFileOptions reading;
  report::DiscoveryTask task;
  Stated stated;
  ReportFiles reports;
};

void discover_command(const CLI::App& command, DiscoverArguments arguments) {
  const robotics::Robot described = read_description(arguments.robot, arguments.data, arguments.links);
  refuse_lost_correction(described, arguments.robot, arguments.output);
  robotics::DiscoveryOptions& options = arguments.task.options;
  if (!arguments.catalogue.empty()) options.catalogue = robotics::read_catalogue(arguments.catalogue);
  const std::vector<std::string> also = report::searched_columns(options.catalogue, described);
  const robotics::Measurements data = read_measured(arguments.data, described, also, arguments.reading);
  std::function<robotics::Measurements(const robotics::Robot&)> read_test;
  if (!arguments.test.empty()) {
    read_test = [&](const robotics::Robot& robot) {
      return read_measured(arguments.test, robot, also, arguments.reading);
    };
  }
  ProgressBar bar("discover");
  options.progress = bar.callback();
  arguments.task.robot_file = arguments.robot;
  report::DiscoveryRun run =
      report::run_discovery(described, data, read_test, arguments.task, [&](const Finding& finding) {
        bar.clear();
        warn_of(finding);
      });
  bar.clear();
  if (std::optional<robotics::CalibrationRecord>& record = run.found.improved.robot.calibration) {
    record->made_from = provenance_of(command,
                                      {{"description", arguments.robot},
                                       {"measurements", arguments.data},
                                       {"test", arguments.test},
                                       {"catalogue", arguments.catalogue},
                                       {"column map", arguments.reading.columns}},
                                      arguments.stated);
  }
  SavedRobot written;
  if (!arguments.output.empty()) {
    written = save_corrected(run.found.improved, arguments.output, {arguments.robot, arguments.links});
  }
  std::string reports;
  if (arguments.reports.wanted()) {
    reports = write_reports(
        arguments.reports,
        report::discovery_report({arguments.robot, arguments.data, report::points_of(data), run.found, run.next}));
  }
  if (arguments.json) {
    print_json(report::discovery_run_json(run));
    return;
  }
  print(report::discovery_text(run, arguments.data, output_width()));
  if (!written.names.empty()) print(fmt::format("Improved description: {}\n", fmt::join(written.names, ", ")));
  print(written.beside_urdf);
  print(reports);
}

}  // namespace

void add_discover(CLI::App& app) {
  CLI::App* command = app.add_subcommand(
      "discover",
      "Find, name and add the physical effect that a model lacks\n"
      "Finds where a robot description and measurements disagree, names the physical effect that is "
      "missing, adds it, and shows the error on poses that took no part. Or says that nothing is missing, "
      "that causes cannot be told apart, or that the catalogue does not know what is there.");
  command->footer("Example: llmt-robot discover robot.yaml measured.csv -o improved.yaml");
  const auto arguments = std::make_shared<DiscoverArguments>();
  add_input_file(*command, "robot", arguments->robot, "Robot description (YAML or URDF)")->required();
  add_urdf_links(*command, arguments->links);
  add_input_file(*command, "measured", arguments->data, "Measurements (CSV)")->required();
  add_input_file(*command, "--test", arguments->test,
                 "Measurements that take no part until the end (CSV); without it a share is set aside");
  add_number(*command, "--held-out", arguments->task.options.held_out_share, share_set_aside,
             "Share of the poses that is set aside")
      ->capture_default_str();
  add_count(*command, "--folds", arguments->task.folds, 2,
            "Besides, cross-validate the whole discovery with that many folds", 100);
  command->add_flag("--contiguous", arguments->task.contiguous, "Folds are blocks of consecutive rows");
  add_measured_file_options(*command, arguments->reading);
  add_input_file(*command, "--catalogue", arguments->catalogue,
                 "Effects to look for, and their plausible sizes (YAML)");
  add_number(*command, "--mass-uncertainty", arguments->task.options.mass_uncertainty, any_share,
             "Standard deviation of the described masses, as a share: part of the errors of compliances")
      ->capture_default_str();
  add_output_file(*command, "-o,--output", arguments->output, "Improved robot description to write (YAML)",
                  {correction_extension});
  command
      ->add_option("--accept-suspicion", arguments->task.accept_suspicion,
                   "Take the files as they stand although they look like this mistake, by the name that was printed")
      ->type_name("NAME");
  add_stated(*command, arguments->stated);
  add_seed(*command, arguments->task.options.seed, "Of the poses set aside");
  add_report_options(*command, arguments->reports, "the error before and after");
  command->add_flag("--json", arguments->json, "Print one JSON object");
  command->callback([command, arguments] {
    check_beside_urdf(*command, arguments->output);
    discover_command(*command, *arguments);
  });
}

}  // namespace llmt::apps
