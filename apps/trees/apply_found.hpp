/// \file
/// `llmt discover --apply`: what was found, added to other rows.
#pragma once

#include <CLI/CLI.hpp>
#include <string>

#include "llmt/csv.hpp"
#include "report/terms/found_terms.hpp"

namespace llmt::apps {

struct ApplyArguments {
  std::string found;                ///< file of `llmt discover --json`
  std::string simulated;            ///< file with inputs and simulated outputs; may be empty where only code is written
  std::string measured;             ///< file with measured outputs, or empty
  std::string time;                 ///< column with the times of the rows; empty: as in the search
  std::string group;                ///< column with their runs; empty: as in the search
  std::string parameters;           ///< derivatives at these rows, or empty
  bool parameters_are_set = false;  ///< the simulated outputs have the changes of parameters already
  std::string corrected;            ///< file to write, or empty
  std::string code;                 ///< as write_code()
  DecimalMark mark = DecimalMark::point;
  bool json = false;
};

/// Applies what was found, writes, and prints the gap before and after where there are measured outputs. Throws
/// std::invalid_argument for options of the search, which the file of what was found stands for.
void apply_command(const CLI::App& command, const ApplyArguments& arguments);

/// Writes the correction as a function, in the language of the path's extension, .c or .py. Throws
/// std::invalid_argument for another one.
void write_code(const std::string& path, const report::FoundTerms& found);

}  // namespace llmt::apps
