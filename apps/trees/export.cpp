#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <filesystem>
#include <memory>
#include <stdexcept>

#include "llmt/boosted_model.hpp"
#include "llmt/c_source.hpp"
#include "llmt/dynamic_source.hpp"
#include "llmt/files.hpp"
#include "report/model/plain_source.hpp"
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
  std::string plain;  ///< the language; empty: not asked for
};

constexpr std::array<std::pair<std::string_view, report::PlainLanguage>, 3> plain_languages = {
    {{"c", report::PlainLanguage::c}, {"python", report::PlainLanguage::python}, {"sql", report::PlainLanguage::sql}}};

// "1 input, 2 outputs"
template <class AnyModel>
std::string size_text(const AnyModel& model) {
  const auto inputs = model.num_inputs();
  const auto outputs = model.num_outputs();
  return fmt::format("{} input{}, {} output{}", inputs, inputs == 1 ? "" : "s", outputs, outputs == 1 ? "" : "s");
}

template <class AnyModel>
void write_source(const ExportArguments& arguments, const AnyModel& model, const CSource& c,
                  const std::string& header) {
  const std::vector<NewFile> files = {{arguments.output, c.source}, {header, c.header}};
  write_files(files);
  print(fmt::format("{}: {}; written to {} and {}\n", arguments.model, size_text(model), arguments.output, header));
}

void export_plain(const ExportArguments& arguments) {
  if (is_boosted_file(arguments.model) || is_dynamic_file(arguments.model)) {
    throw std::runtime_error(arguments.model + ": --plain is for readable trees; `llmt fit --readable` writes one");
  }
  const Model model = load_model(arguments.model);
  const auto language =
      std::ranges::find(plain_languages, arguments.plain, &std::pair<std::string_view, report::PlainLanguage>::first);
  write_file(arguments.output,
             report::plain_source(model, language->second, arguments.name, without_controls(arguments.model)));
  print(fmt::format("{}: {}; written to {}\n", arguments.model, size_text(model), arguments.output));
}

void export_command(const ExportArguments& arguments) {
  if (arguments.c == !arguments.plain.empty()) {
    throw std::invalid_argument("--c, for every model, or --plain LANGUAGE, for a readable tree, must be given");
  }
  if (!is_c_identifier(arguments.name)) {
    throw std::invalid_argument(fmt::format("--name: \"{}\" must be an identifier of C of at most 31 characters",
                                            without_controls(arguments.name)));
  }
  if (!arguments.plain.empty()) {
    export_plain(arguments);
    return;
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
                                         "Write a model as source of a program\n"
                                         "--c: C99 without dependencies, memory allocation or recursion: int "
                                         "NAME_predict(const double *inputs, double *outputs). "
                                         "Of a model of a system that moves: NAME_start and NAME_step, with its state "
                                         "in a struct. "
                                         "Everything that llmt predict does is in it. "
                                         "--plain: a readable tree as if and equations that a person reads.");
  command->footer("Example: llmt export --c concrete.json -o concrete.c && cc -std=c99 -c concrete.c");
  const auto arguments = std::make_shared<ExportArguments>();
  add_input_file(*command, "model", arguments->model, "Model file of llmt fit")->required();
  command->add_flag("--c", arguments->c, "As C source");
  std::vector<std::string> languages;
  for (const auto& [language, value] : plain_languages) languages.emplace_back(language);
  command->add_option("--plain", arguments->plain, "A readable tree as plain if and equations in this language")
      ->type_name("c|python|sql")
      ->check(CLI::IsMember(languages));
  command->add_option("--name", arguments->name, "Begins all names in the source; of --plain sql the table")
      ->capture_default_str();
  add_output_file(*command, "-o,--output", arguments->output, "File to write; of --c FILE.h is written beside it",
                  {".h"})
      ->required();
  command->callback([arguments] { export_command(*arguments); });
}

}  // namespace llmt::apps
