#include <fmt/format.h>
#include <fmt/ranges.h>

#include <memory>

#include "llmt/robotics/catalogue.hpp"
#include "llmt/robotics/discovery.hpp"
#include "llmt/robotics/robot_file.hpp"
#include "robot/commands.hpp"
#include "shared/cli.hpp"

namespace llmt::apps {
namespace {

using robotics::Discovery;

struct DiscoverArguments {
  std::string robot;
  std::string data;
  std::string test;
  std::string catalogue;
  std::string output;
  bool json = false;
  robotics::DiscoveryOptions options;
};

Json json_of(const Discovery& found) {
  Json effects = Json::array();
  for (const robotics::FoundEffect& effect : found.effects) {
    Json parameters = Json::array();
    for (const robotics::FoundParameter& parameter : effect.parameters) {
      parameters.push_back({{"name", parameter.name},
                            {"value", parameter.value},
                            {"unit", parameter.unit},
                            {"std_error", parameter.standard_error}});
    }
    Json constants = Json::object();
    const robotics::EffectType& type = robotics::effect_type(effect.effect.type);
    for (std::size_t k = 0; k < type.constants.size(); ++k) constants[type.constants[k].key] = effect.effect.constants[k];
    effects.push_back({{"name", effect.effect.type},
                       {"family", type.family},
                       {"location", effect.effect.at},
                       {"confirmed", effect.confirmed},
                       {"parameters", parameters},
                       {"constants", constants},
                       {"rivals", effect.rivals},
                       {"exact_alias", effect.exact_alias},
                       {"share", effect.share},
                       {"rms_mm", effect.rms_mm}});
  }
  Json shapes = Json::array();
  for (const robotics::FoundShape& shape : found.unknown) {
    shapes.push_back({{"acts_on", shape.shape.acts_on},
                      {"depends_on", shape.shape.depends_on},
                      {"per_turn", shape.shape.per_turn ? Json(*shape.shape.per_turn) : Json(nullptr)},
                      {"kind", shape.shape.kind},
                      {"share", shape.share}});
  }
  Json untestable = Json::array();
  for (const robotics::Untestable& entry : found.not_testable) untestable.push_back({{"effect", entry.what}, {"why", entry.why}});
  Json visible = Json::array();
  for (const robotics::Visible& entry : found.visible) {
    visible.push_back({{"effect", entry.what}, {"amplitude", entry.value}, {"unit", entry.unit}});
  }
  return {{"verdict", discovery::to_string(found.answer)},
          {"effects", effects},
          {"unknown", shapes.empty() ? Json(nullptr) : shapes[0]},
          {"unknown_all", shapes},
          {"gap",
           {{"before_mm", found.held_out.poses > 0 ? found.held_out.before.mean : found.fitted_before.mean},
            {"after_mm", found.held_out.poses > 0 ? found.held_out.after.mean : found.fitted_after.mean},
            {"noise_floor_mm", found.held_out.floor_mm},
            {"heldout_poses", found.held_out.poses}}},
          {"outliers", found.outliers},
          {"not_testable", untestable},
          {"smallest_visible", visible},
          {"noise_mm", found.noise_mm},
          {"score_gain", found.score_gain},
          {"chance_threshold", found.threshold},
          {"hypotheses", found.hypotheses},
          {"notes", found.notes},
          {"rounds", found.rounds}};
}

void discover_command(DiscoverArguments arguments) {
  const robotics::Robot robot = robotics::read_robot(arguments.robot);
  const robotics::Measurements data = robotics::read_measurements(arguments.data, robot);
  std::optional<robotics::Measurements> test;
  if (!arguments.test.empty()) test = robotics::read_measurements(arguments.test, robot);
  if (!arguments.catalogue.empty()) arguments.options.catalogue = robotics::read_catalogue(arguments.catalogue);
  const Discovery found = robotics::discover(robot, data, test, arguments.options);
  if (!arguments.output.empty()) robotics::save(found.improved.robot, arguments.output);
  if (arguments.json) {
    print_json(json_of(found));
    return;
  }
  print(json_of(found).dump(1) + "\n");
}

}  // namespace

void add_discover(CLI::App& app) {
  CLI::App* command = app.add_subcommand("discover", "Find, name and add the physical effect that a model lacks");
  const auto arguments = std::make_shared<DiscoverArguments>();
  command->add_option("robot", arguments->robot, "Robot description (YAML)")->required();
  command->add_option("measured", arguments->data, "Measurements (CSV)")->required();
  command->add_option("--test", arguments->test, "Measurements that take no part until the end (CSV); else a share is set aside");
  command->add_option("--catalogue", arguments->catalogue, "Effects to look for, and their plausible sizes (YAML)");
  command->add_option("-o,--output", arguments->output, "Improved robot description to write (YAML)");
  command->add_option("--seed", arguments->options.seed, "Of the poses set aside")->capture_default_str();
  command->add_flag("--json", arguments->json, "Print one JSON object");
  command->callback([arguments] { discover_command(*arguments); });
}

}  // namespace llmt::apps
