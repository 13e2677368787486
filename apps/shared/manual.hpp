/// \file
/// The help of a program in the forms that a system installs. The build writes them by `PROGRAM --man` and
/// `PROGRAM --bash-completion`, which help does not list.
#pragma once

#include <CLI/CLI.hpp>
#include <string>

namespace llmt::apps {

/// A page for `man`, roff: the program, its commands with all their options, exit codes.
std::string man_page(const CLI::App& program);

/// A script for bash that completes commands, options and files.
std::string bash_completion(const CLI::App& program);

}  // namespace llmt::apps
