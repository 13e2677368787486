#include <memory>

#include "llmt/commands.hpp"
#include "llmt/model_file.hpp"
#include "report/model/leaves.hpp"
#include "report/model/rules.hpp"
#include "shared/cli.hpp"
#include "shared/options.hpp"

namespace llmt::apps {
namespace {

struct InspectArguments {
  std::string model;
  bool json = false;
  bool rules = false;
};

}  // namespace

void add_inspect(CLI::App& app) {
  CLI::App* command = app.add_subcommand("inspect", "Print a model's leaves: where each holds and what it says");
  command->footer("Example: llmt inspect concrete.json");
  const auto arguments = std::make_shared<InspectArguments>();
  add_input_file(*command, "model", arguments->model, "Model file of llmt fit")->required();
  CLI::Option* const json = command->add_flag("--json", arguments->json, "Print JSON");
  command->add_flag("--rules", arguments->rules, "Print a crisp model as rules and as a tree")->excludes(json);
  command->callback([arguments] {
    const Model model = load_model(arguments->model);
    if (arguments->json) {
      print_json(report::leaves_json(model));
    } else if (arguments->rules) {
      print(report::rules_text(model, arguments->model, output_width()));
    } else {
      print(report::leaves_text(model, arguments->model, output_width()));
    }
  });
}

}  // namespace llmt::apps
