#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <iterator>
#include <memory>
#include <stdexcept>

#include "llmt/folds.hpp"
#include "llmt/robotics/calibration_report.hpp"
#include "llmt/robotics/catalogue.hpp"
#include "llmt/robotics/discovery/discovery.hpp"
#include "llmt/robotics/robot_file.hpp"
#include "report/robot/discovery/discovery_page.hpp"
#include "report/robot/discovery/next_poses.hpp"
#include "report/robot/discovery/of_discovery.hpp"
#include "report/robot/measurement_text.hpp"
#include "robot/commands.hpp"
#include "robot/corrected_file.hpp"
#include "robot/measured_file.hpp"
#include "shared/cli.hpp"
#include "shared/options.hpp"
#include "shared/report_files.hpp"

namespace llmt::apps {
namespace {

using robotics::Discovery;

struct DiscoverArguments {
  std::string robot;
  robotics::UrdfLinks links;
  std::string data;
  std::string test;
  std::string catalogue;
  std::string output;
  int folds = 0;
  bool contiguous = false;
  bool json = false;
  MeasuredFileOptions reading;
  robotics::DiscoveryOptions options;
  ReportFiles reports;
};

// Columns that the catalogue's effects, a user's own among them, look at.
std::vector<std::string> columns_of(const std::vector<robotics::EffectType>& catalogue, const robotics::Robot& robot) {
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

// The whole discovery repeated without each fold and judged on it.
Json folds_json(const robotics::Robot& robot, const robotics::Measurements& data, const DiscoverArguments& arguments) {
  FoldOptions dealing;
  dealing.count = arguments.folds;
  dealing.kind = arguments.contiguous ? FoldKind::contiguous : FoldKind::random;
  dealing.seed = arguments.options.seed;
  const std::vector<double> groups = robotics::pose_labels(data.poses);
  double before = 0.0;
  double after = 0.0;
  ProgressBar bar("fold");
  Eigen::Index done = 0;
  for (const Fold& fold : make_folds(data.count(), dealing, groups)) {
    bar.show(done++, arguments.folds);
    const robotics::Measurements held_out = robotics::select(data, fold.held_out);
    const Discovery found = robotics::discover(robot, robotics::select(data, fold.train), held_out, arguments.options);
    const auto n = static_cast<double>(held_out.count());
    before += n * found.held_out.before.mean / static_cast<double>(data.count());
    after += n * found.held_out.after.mean / static_cast<double>(data.count());
  }
  return {{"folds", arguments.folds}, {"contiguous", arguments.contiguous}, {"before_mm", before}, {"after_mm", after}};
}

// Says what `calibrate` would say of measurements that the description cannot mean: wrong units, signs or zeros are
// easily taken for effects.
void warn_of_misfit(const robotics::Robot& robot, const robotics::Measurements& data) {
  const robotics::CalibrationReport calibrated = robotics::report_calibration(robot, data, {.folds = 0});
  for (const std::string& mistake : robotics::input_mistakes(robot, data, calibrated)) warn("WARNING: " + mistake);
}

// discover(); where it refuses the measurements, what looks wrong with them is said first.
Discovery discovered(const robotics::Robot& robot, const robotics::Measurements& data,
                     const std::optional<robotics::Measurements>& test, const robotics::DiscoveryOptions& options) {
  try {
    return robotics::discover(robot, data, test, options);
  } catch (const std::runtime_error&) {
    try {
      warn_of_misfit(robot, data);
    } catch (const std::exception&) {  // what discover() says is enough then
    }
    throw;
  }
}

void discover_command(DiscoverArguments arguments) {
  const robotics::Robot described = read_description(arguments.robot, arguments.data, arguments.links);
  refuse_lost_correction(described, arguments.robot, arguments.output);
  if (!arguments.catalogue.empty()) arguments.options.catalogue = robotics::read_catalogue(arguments.catalogue);
  const std::vector<std::string> also = columns_of(arguments.options.catalogue, described);
  const robotics::Measurements data = read_measured(arguments.data, described, also, arguments.reading);
  const robotics::Robot robot = robotics::with_frames(described, data);
  std::optional<robotics::Measurements> test;
  if (!arguments.test.empty()) test = read_measured(arguments.test, robot, also, arguments.reading);
  check_positions(arguments.robot, robot, data.poses);
  if (test) check_positions(arguments.robot, robot, test->poses);
  for (const std::string& warning : data.warnings) warn(warning);
  ProgressBar bar("discover");
  arguments.options.progress = bar.callback();
  const Discovery found = discovered(robot, data, test, arguments.options);
  bar.clear();
  arguments.options.progress = {};
  warn_of_misfit(robot, data);  // what cannot be calibrated was refused
  const Json folds = arguments.folds > 0 ? folds_json(robot, data, arguments) : Json(nullptr);
  SavedRobot written;
  if (!arguments.output.empty()) {
    written = save_corrected(found.improved, arguments.output, {arguments.robot, arguments.links});
  }
  const std::vector<report::NextPoses> next = report::next_poses(found, data);
  std::string reports;
  if (arguments.reports.wanted()) {
    reports = write_reports(arguments.reports, report::discovery_report({arguments.robot, arguments.data,
                                                                         report::points_of(data), found, next}));
  }
  if (arguments.json) {
    Json json = report::discovery_json(found);
    json["cross_validation"] = folds;
    print_json(json);
    return;
  }
  print(fmt::format("{}: {} of {}, {} {} set aside\n{}\n", arguments.data, report::counts_of(data), robot.chain.name,
                    test ? 0 : found.held_out.poses, data.poses.observations.empty() ? "of them" : "poses",
                    use_of_orientations(data)));
  print(report::discovery_page(found, data.lines, output_width()));
  print(report::next_poses_text(next));
  if (!folds.is_null()) {
    print(fmt::format("{} {} folds, everything found anew in each: {:.4f} -> {:.4f} mm mean on the poses left out\n",
                      arguments.folds, arguments.contiguous ? "contiguous" : "random", folds["before_mm"].get<double>(),
                      folds["after_mm"].get<double>()));
  }
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
  add_number(*command, "--held-out", arguments->options.held_out_share, share_set_aside,
             "Share of the poses that is set aside")
      ->capture_default_str();
  add_count(*command, "--folds", arguments->folds, 2,
            "Besides, cross-validate the whole discovery with that many folds", 100);
  command->add_flag("--contiguous", arguments->contiguous, "Folds are blocks of consecutive rows");
  add_measured_file_options(*command, arguments->reading);
  add_input_file(*command, "--catalogue", arguments->catalogue,
                 "Effects to look for, and their plausible sizes (YAML)");
  add_number(*command, "--mass-uncertainty", arguments->options.mass_uncertainty, any_share,
             "Standard deviation of the described masses, as a share: part of the errors of compliances")
      ->capture_default_str();
  add_output_file(*command, "-o,--output", arguments->output, "Improved robot description to write (YAML)",
                  {correction_extension});
  add_seed(*command, arguments->options.seed, "Of the poses set aside");
  add_report_options(*command, arguments->reports, "the error before and after");
  command->add_flag("--json", arguments->json, "Print one JSON object");
  command->callback([command, arguments] {
    check_beside_urdf(*command, arguments->output);
    discover_command(*arguments);
  });
}

}  // namespace llmt::apps
