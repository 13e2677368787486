#include "shared/manual.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cctype>
#include <string_view>
#include <vector>

#include "shared/help.hpp"

namespace llmt::apps {
namespace {

// Text that roff prints as it is.
std::string escaped(std::string_view text) {
  std::string result;
  bool at_begin = true;
  for (const char c : text) {
    if (at_begin && (c == '.' || c == '\'')) result += "\\&";
    if (c == '-') {
      result += "\\-";
    } else if (c == '\\') {
      result += "\\e";
    } else {
      result += c;
    }
    at_begin = c == '\n';
  }
  return result;
}

std::vector<const CLI::App*> commands_of(const CLI::App& program) {
  std::vector<const CLI::App*> commands;
  for (const CLI::App* command : program.get_subcommands([](const CLI::App*) { return true; })) {
    commands.push_back(command);
  }
  return commands;
}

std::vector<const CLI::Option*> shown_options(const CLI::App& command) {
  return command.get_options([](const CLI::Option* option) { return !option->get_group().empty(); });
}

// What stands before the first line break, and after it.
std::pair<std::string, std::string> parts_of(const std::string& description) {
  const std::size_t end = std::min(description.find('\n'), description.size());
  return {description.substr(0, end), end < description.size() ? description.substr(end + 1) : ""};
}

std::string shown_name(const CLI::Option& option) {
  return option.nonpositional() ? option.get_name(false, true) : option.get_name();
}

std::string man_options(const CLI::App& command) {
  std::string text;
  for (const CLI::Option* option : shown_options(command)) {
    const OptionHelp help = help_of(*option, shown_name(*option));
    text += fmt::format(".TP\n.B {}\n{}\n", escaped(help.name), escaped(help.text));
  }
  return text;
}

std::string man_command(const CLI::App& program, const CLI::App& command) {
  const auto [first, rest] = parts_of(command.get_description());
  std::string text = fmt::format(".SS {} {}\n{}.\n", program.get_name(), escaped(command.get_name()), escaped(first));
  if (!rest.empty()) text += fmt::format(".PP\n{}\n", escaped(rest));
  text += man_options(command);
  if (!command.get_footer().empty()) text += fmt::format(".PP\n{}\n", escaped(command.get_footer()));
  return text;
}

// The names that complete an option: "--target", "-t".
std::vector<std::string> words_of(const CLI::App& command) {
  std::vector<std::string> words;
  for (const CLI::Option* option : shown_options(command)) {
    for (const std::string& name : option->get_lnames()) words.push_back("--" + name);
    for (const std::string& name : option->get_snames()) words.push_back("-" + name);
  }
  return words;
}

}  // namespace

std::string man_page(const CLI::App& program) {
  std::string title = program.get_name();
  std::ranges::transform(title, title.begin(), [](unsigned char c) { return static_cast<char>(std::toupper(c)); });
  std::string text = fmt::format(
      ".TH {} 1 \"\" \"LLMT {}\"\n.SH NAME\n{} \\- {}\n.SH SYNOPSIS\n.B {}\n.I COMMAND\n[ARGUMENTS]\n.SH "
      "DESCRIPTION\n{}\n",
      title, LLMT_VERSION, escaped(program.get_name()), escaped(parts_of(program.get_description()).first),
      escaped(program.get_name()), escaped(program.get_description()));
  text += ".SH OPTIONS\n" + man_options(program) + ".SH COMMANDS\n";
  for (const CLI::App* command : commands_of(program)) text += man_command(program, *command);
  text +=
      ".SH EXIT STATUS\n.TP\n.B 0\nDone.\n.TP\n.B 1\nThe data or the outcome do not allow it.\n.TP\n.B 2\nWrong "
      "usage.\n";
  return text;
}

std::string bash_completion(const CLI::App& program) {
  std::string name = "_" + program.get_name();
  std::ranges::replace(name, '-', '_');
  std::vector<std::string> first;
  std::string cases;
  for (const CLI::App* command : commands_of(program)) {
    first.push_back(command->get_name());
    cases += fmt::format("    {}) words=\"{}\" ;;\n", command->get_name(), fmt::join(words_of(*command), " "));
  }
  for (const std::string& word : words_of(program)) first.push_back(word);
  return fmt::format(
      "# bash completion of {0}\n{1}() {{\n  local word=${{COMP_WORDS[COMP_CWORD]}} words=\n  COMPREPLY=()\n"
      "  case ${{COMP_WORDS[1]}} in\n{3}  esac\n  if [ \"$COMP_CWORD\" -eq 1 ]; then words=\"{2}\"; "
      "elif [[ $word != -* ]]; then return; fi\n  COMPREPLY=($(compgen -W \"$words\" -- \"$word\"))\n}}\n"
      "complete -o default -F {1} {0}\n",
      program.get_name(), name, fmt::join(first, " "), cases);
}

}  // namespace llmt::apps
