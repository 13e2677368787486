#include <fmt/format.h>

#include <memory>
#include <stdexcept>

#include "llmt/boosted_model.hpp"
#include "report/model/boosted_inspection.hpp"
#include "report/model/leaves.hpp"
#include "report/model/rules.hpp"
#include "shared/cli.hpp"
#include "shared/options.hpp"
#include "trees/commands.hpp"
#include "trees/model_file.hpp"

namespace llmt::apps {
namespace {

struct InspectArguments {
  std::string model;
  bool json = false;
  bool rules = false;
};

void inspect_sum(const InspectArguments& arguments) {
  if (arguments.rules) {
    throw std::runtime_error(fmt::format(
        "{}: --rules is not for a sum of trees, which has no rules; fit without --boost, or with --readable",
        arguments.model));
  }
  const BoostedModel model = load_boosted(arguments.model);
  if (arguments.json) {
    print_json(report::boosted_inspection_json(model));
  } else {
    print(report::boosted_inspection_text(model, arguments.model, output_width()));
  }
}

void inspect_trees(const InspectArguments& arguments) {
  const auto [model, intervals] = load_model(arguments.model, true);
  if (arguments.rules) {
    print(report::rules_text(model, arguments.model, output_width()));
    return;
  }
  const Eigen::Index most = intervals.record().size_limit;
  if (arguments.json) {
    Json json = report::leaves_json(model);
    if (most > 0) json["max_leaves"] = most;
    print_json(json);
    return;
  }
  print(report::leaves_text(model, arguments.model, output_width()));
  if (most > 0) print(fmt::format("\nFitted with at most {} leaves a tree, as --max-leaves {} does\n", most, most));
}

}  // namespace

void add_inspect(CLI::App& app) {
  CLI::App* command = app.add_subcommand("inspect",
                                         "Print a model's leaves: where each holds and what it says; of a sum of "
                                         "trees, its size and its uses of the inputs");
  command->footer("Example: llmt inspect concrete.json");
  const auto arguments = std::make_shared<InspectArguments>();
  add_input_file(*command, "model", arguments->model, "Model file of llmt fit")->required();
  CLI::Option* const json = command->add_flag("--json", arguments->json, "Print JSON");
  command->add_flag("--rules", arguments->rules, "Print a crisp model as rules and as a tree")->excludes(json);
  command->callback([arguments] {
    if (is_boosted_file(arguments->model)) {
      inspect_sum(*arguments);
      return;
    }
    inspect_trees(*arguments);
  });
}

}  // namespace llmt::apps
