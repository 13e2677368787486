#include "shared/help.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <filesystem>
#include <memory>
#include <stdexcept>
#include <string_view>
#include <system_error>
#include <utility>
#include <vector>

#include "llmt/names.hpp"
#include "report/text/text.hpp"

namespace llmt::apps {
namespace {

constexpr std::size_t widest_help = 100;
constexpr std::size_t text_column = 28;

// A name to the left, its text in a column to the right.
std::string entry(const std::string& name, const std::string& text) {
  const std::size_t width = std::min(output_width(), widest_help);
  std::string line = "  " + name;
  if (text.empty()) return line + "\n";
  line += line.size() + 2 > text_column ? "\n" + std::string(text_column, ' ')
                                        : std::string(text_column - line.size(), ' ');
  const std::string right = report::wrapped(text, width - std::min(text_column, width / 2));
  for (const char c : right) {
    line += c;
    if (c == '\n') line += std::string(text_column, ' ');
  }
  return line + "\n";
}

class HelpFormatter : public CLI::Formatter {
 public:
  std::string make_option(const CLI::Option* option, bool is_positional) const override {
    const OptionHelp help = help_of(*option, make_option_name(option, is_positional), whole_);
    return entry(help.name, help.text);
  }

  std::string make_help(const CLI::App* app, std::string name, CLI::AppFormatMode mode) const override {
    const bool with_experts = mode != CLI::AppFormatMode::Normal;
    whole_ = with_experts;
    return make_description(app) + make_usage(app, std::move(name)) + make_positionals(app) +
           groups(*app, with_experts) + make_subcommands(app, mode) + "\n" + make_footer(app);
  }

  std::string make_subcommand(const CLI::App* command) const override {
    const std::string text = command->get_description();
    return entry(command->get_name(), text.substr(0, text.find('\n')));
  }

  std::string make_description(const CLI::App* app) const override { return paragraph(app->get_description()); }
  std::string make_footer(const CLI::App* app) const override { return paragraph(app->get_footer()); }

 private:
  // The groups of options, one below the other.
  std::string groups(const CLI::App& app, bool with_experts) const {
    std::string text;
    std::size_t hidden = 0;
    for (const std::string& group : app.get_groups()) {
      const auto in_group = [&](const CLI::Option* option) {
        return option->get_group() == group && option->nonpositional();
      };
      const std::vector<const CLI::Option*> options = app.get_options(in_group);
      if (group.empty() || options.empty()) continue;
      if (group == expert_options && !with_experts) {
        hidden += options.size();
      } else {
        text += make_group(group, false, options);
      }
    }
    return hidden == 0 ? text : text + fmt::format("\n{} more options for experts: --help-all\n", hidden);
  }

  static std::string paragraph(const std::string& text) {
    return text.empty() ? text : report::wrapped(text, std::min(output_width(), widest_help)) + "\n";
  }

  mutable bool whole_ = true;  // for make_option(), which the base class calls without the mode
};

std::vector<std::string> command_names(const CLI::App& app) {
  std::vector<std::string> names;
  for (const CLI::App* command : app.get_subcommands([](const CLI::App*) { return true; })) {
    names.push_back(command->get_name());
  }
  return names;
}

// "--target", "--inputs", ...
std::vector<std::string> option_names(const CLI::App& app) {
  std::vector<std::string> names;
  for (const CLI::Option* option : app.get_options()) {
    for (const std::string& name : option->get_lnames()) names.push_back("--" + name);
  }
  return names;
}

bool contains(const std::vector<std::string>& names, std::string_view name) {
  return std::ranges::find(names, name) != names.end();
}

}  // namespace

OptionHelp help_of(const CLI::Option& option, const std::string& shown_name, bool whole) {
  OptionHelp help{shown_name, option.get_description()};
  help.name.erase(std::min(help.name.find('{'), help.name.size()));  // the value of a flag that is given without one
  const bool is_positional = !option.nonpositional();
  const std::string type = option.get_option_text().empty() ? option.get_type_name() : option.get_option_text();
  const bool is_flag = option.get_items_expected_max() == 0;
  if (!is_positional && !is_flag && !type.empty()) help.name += " " + type;
  if (!is_positional && is_flag) help.name += option.get_option_text();
  constexpr std::size_t many_words = 80;
  const std::string value = option.get_default_str();
  const bool says_value = whole || value.size() < many_words;
  if (!value.empty()) {
    help.text += fmt::format(" [{}]", says_value ? value : "chosen from rows and method, see --help-all");
  }
  if (option.get_required() && !is_positional) help.text += " (required)";
  return help;
}

void set_up_help(CLI::App& program) {
  const auto formatter = std::make_shared<HelpFormatter>();
  formatter->label("SUBCOMMAND", "COMMAND");
  formatter->label("Positionals", "Arguments");
  program.formatter(formatter);
  for (CLI::App* command : program.get_subcommands({})) {
    command->formatter(formatter);
    command->group("Commands");
  }
}

void refuse_unknown_names(const CLI::App& program, int argc, const char* const* argv) {
  const CLI::App* app = &program;
  const std::vector<std::string> commands = command_names(program);
  for (int i = 1; i < argc; ++i) {
    const std::string_view word(argv[i]);
    if (word == "--") return;
    if (word.starts_with("--")) {
      const std::string_view name = word.substr(0, word.find('='));
      const std::vector<std::string> names = option_names(*app);
      if (contains(names, name)) {
        if (name == "--help" || name == "--help-all" || name == "--version") return;
        continue;
      }
      throw std::invalid_argument(
          fmt::format("there is no option {}{}; {} --help lists them", name, did_you_mean(name, names),
                      app == &program ? app->get_name() : program.get_name() + " " + app->get_name()));
    }
    if (word.starts_with("-")) {
      if (word == "-h") return;
      continue;
    }
    if (app != &program || commands.empty()) continue;
    if (!contains(commands, word)) {
      throw std::invalid_argument(fmt::format("there is no command \"{}\"{}; the commands are {}", word,
                                              did_you_mean(word, commands), fmt::join(commands, ", ")));
    }
    app = program.get_subcommand(std::string(word));
  }
  if (app == &program && program.get_require_subcommand_min() > 0) {
    throw std::invalid_argument(fmt::format("a command is needed: {}; {} --help says what they do",
                                            fmt::join(commands, ", "), program.get_name()));
  }
}

namespace {

// Why a word may stand where it was not expected; empty: not known.
std::string reason_of(const CLI::App& program, const std::string& extra, int argc, const char* const* argv) {
  const std::vector<CLI::App*> chosen = program.get_subcommands();
  const auto* const end = argv + argc;
  for (const auto* word = argv + 1; word != end; ++word) {
    if (extra != *word) continue;
    const auto* before = word;
    while (before != argv && !std::string_view(*before).starts_with("-")) --before;
    const CLI::Option* const option = chosen.back()->get_option_no_throw(*before);
    const bool has_list = option != nullptr && option->get_type_name().ends_with("...");
    if (before != argv && option != nullptr && option->get_items_expected_max() == 0 &&
        !option->get_option_text().empty()) {
      return fmt::format("; a value of {} is written {}={}", *before, *before, *word);
    }
    const CLI::Option* const output = chosen.back()->get_option_no_throw("--output");
    const bool is_flag = option != nullptr && option->get_items_expected_max() == 0;
    if (before + 1 == word && is_flag && output != nullptr) {
      return fmt::format("; {} takes no file: -o {} writes to it", *before, *word);
    }
    if (before != argv && has_list && word - before >= 2) {
      return fmt::format("; several names are separated by commas: {} {},{}", *before, *(before + 1), *(before + 2));
    }
  }
  return {};
}

}  // namespace

std::string hint_on_extra_argument(const CLI::App& program, int argc, const char* const* argv) {
  const std::vector<CLI::App*> chosen = program.get_subcommands();
  if (chosen.empty()) return {};
  const std::vector<std::string> extra = chosen.back()->remaining();
  const std::string reason = extra.empty() ? "" : reason_of(program, extra.front(), argc, argv);
  return reason.empty() ? usage_of(program) : reason;
}

std::string word_in_place_of_a_file(const CLI::App& program, int argc, const char* const* argv) {
  const std::vector<CLI::App*> chosen = program.get_subcommands();
  if (chosen.empty()) return {};
  std::size_t given = 0;
  std::size_t needed = 0;
  for (const CLI::Option* option : chosen.back()->get_options()) {
    if (option->nonpositional()) continue;
    given += option->count();
    needed += option->get_required() ? 1 : 0;
  }
  if (given <= needed) return {};  // no word too many: a file is missing
  for (const CLI::Option* option : chosen.back()->get_options()) {
    if (option->nonpositional()) continue;
    for (const std::string& word : option->results()) {
      std::error_code ignored;
      if (std::filesystem::exists(word, ignored)) continue;
      const std::string reason = reason_of(program, word, argc, argv);
      if (!reason.empty()) return fmt::format("The following argument was not expected: {}{}", word, reason);
    }
  }
  return {};
}

std::string usage_of(const CLI::App& program) {
  const CLI::App* const command = program.get_subcommands().back();
  std::string files;
  for (const CLI::Option* option : command->get_options()) {
    if (!option->nonpositional()) files += " " + option->get_name();
  }
  if (files.empty()) return {};
  return fmt::format("; usage: {} {} [OPTIONS]{}", program.get_name(), command->get_name(), files);
}

}  // namespace llmt::apps
