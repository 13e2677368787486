#include <fmt/format.h>

#include <filesystem>
#include <memory>
#include <stdexcept>

#include "llmt/boosted_model.hpp"
#include "llmt/c_source.hpp"
#include "llmt/dynamic_source.hpp"
#include "llmt/files.hpp"
#include "shared/cli.hpp"
#include "shared/options.hpp"
#include "trees/commands.hpp"
#include "trees/model_file.hpp"

namespace llmt::apps {
namespace {

struct ExportArguments {
  std::string model;
  std::string output;
  std::string name = "model";
  bool c = false;
};

template <class AnyModel>
void write_source(const ExportArguments& arguments, const AnyModel& model, const CSource& c,
                  const std::string& header) {
  const std::vector<NewFile> files = {{arguments.output, c.source}, {header, c.header}};
  write_files(files);
  print(fmt::format("{}: {} inputs, {} outputs; written to {} and {}\n", arguments.model, model.num_inputs(),
                    model.num_outputs(), arguments.output, header));
}

void export_command(const ExportArguments& arguments) {
  if (!arguments.c) throw std::invalid_argument("--c is the only language there is, and must be given");
  if (!is_c_identifier(arguments.name)) {
    throw std::invalid_argument(fmt::format("--name: \"{}\" must be an identifier of C of at most 31 characters",
                                            without_controls(arguments.name)));
  }
  const std::string header = beside(arguments.output, ".h").string();
  if (header == arguments.output) throw std::invalid_argument("--output: the header has this name; write to FILE.c");
  const std::string include = std::filesystem::path(header).filename().string();
  if (is_boosted_file(arguments.model)) {
    const BoostedModel model = load_boosted(arguments.model);
    write_source(arguments, model, to_c(model, arguments.name, include), header);
    return;
  }
  if (is_dynamic_file(arguments.model)) {
    const DynamicModel model = load_dynamic(arguments.model);
    write_source(arguments, model, to_c(model, arguments.name, include), header);
    return;
  }
  const Model model = load_model(arguments.model);
  write_source(arguments, model, to_c(model, arguments.name, include), header);
}

}  // namespace

void add_export(CLI::App& app) {
  CLI::App* command = app.add_subcommand("export",
                                         "Write a model as C source\n"
                                         "C99 without dependencies, memory allocation or recursion: int "
                                         "NAME_predict(const double *inputs, double *outputs). "
                                         "Of a model of a system that moves: NAME_start and NAME_step, with its state "
                                         "in a struct. "
                                         "Everything that llmt predict does is in it.");
  command->footer("Example: llmt export --c concrete.json -o concrete.c && cc -std=c99 -c concrete.c");
  const auto arguments = std::make_shared<ExportArguments>();
  add_input_file(*command, "model", arguments->model, "Model file of llmt fit")->required();
  command->add_flag("--c", arguments->c, "As C source");
  command->add_option("--name", arguments->name, "Begins all names in the source")->capture_default_str();
  add_output_file(*command, "-o,--output", arguments->output, "C file to write; FILE.h is written beside it", {".h"})
      ->required();
  command->callback([arguments] { export_command(*arguments); });
}

}  // namespace llmt::apps
