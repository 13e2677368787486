/// \file
/// How the programs print their help, and what they say about names that they do not know.
#pragma once

#include <CLI/CLI.hpp>
#include <string>

namespace llmt::apps {

/// Group of options that only `--help-all` prints.
inline constexpr const char* expert_options = "Options for experts";

/// Gives a program and its commands their help: lines no longer than the terminal or 100 columns, the type of an option
/// beside its name, its default at the end of its text. Call it once, when all commands are there.
void set_up_help(CLI::App& program);

/// An option as its help has it: "-t,--target COLUMN,..." and what it does, with the default at the end.
struct OptionHelp {
  std::string name;
  std::string text;
};
/// `whole`: a default of many words is stated too, which --help leaves to --help-all.
OptionHelp help_of(const CLI::Option& option, const std::string& shown_name, bool whole = true);

/// Throws std::invalid_argument, with the name that was most likely meant, if the command line has a command or a long
/// option that the program does not know, or no command. CLI11 would first ask for options that are missing.
void refuse_unknown_names(const CLI::App& program, int argc, const char* const* argv);

/// What to add to the message about arguments that were not expected: that lists are separated by commas, if the first
/// of them follows an option with a list. Else empty.
std::string hint_on_extra_argument(const CLI::App& program, int argc, const char* const* argv);

/// What to say in the place of an error where a word after an option was taken for a file: "The following argument was
/// not expected: 5; a value of --readable is written --readable=5". Empty: all files exist, or none is such a word.
std::string word_in_place_of_a_file(const CLI::App& program, int argc, const char* const* argv);

/// "; usage: llmt fit [OPTIONS] data" of the command that was chosen; empty if it takes no file.
std::string usage_of(const CLI::App& program);

}  // namespace llmt::apps
