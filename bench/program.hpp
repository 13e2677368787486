/// \file
/// The main function of a program with subcommands.
#pragma once

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <exception>

namespace bench {

/// Runs the subcommand that argv names. Each `add` adds one to the CLI::App that it gets. Returns the exit code: 1 if
/// the subcommand throws, CLI11's own code if argv is wrong.
template <class... Add>
int run_program(const char* name, const char* description, int argc, char** argv, const Add&... add) {
  CLI::App program(description, name);
  program.require_subcommand(1);
  program.set_help_all_flag("--help-all", "help of all subcommands");
  (add(program), ...);
  try {
    CLI11_PARSE(program, argc, argv);
  } catch (const std::exception& error) {
    fmt::print(stderr, "{}: {}\n", name, error.what());
    return 1;
  }
  return 0;
}

}  // namespace bench
