/// \file
/// --report and --plot, as every command that has them offers them.
#pragma once

#include <CLI/CLI.hpp>
#include <functional>
#include <string>

#include "report/document/document.hpp"

namespace llmt::apps {

/// The files asked for; empty: none.
struct ReportFiles {
  std::string page;
  std::string plot;

  bool wanted() const { return !page.empty() || !plot.empty(); }
};

/// Adds both options. Before the command runs, they throw if this build or this machine cannot make such a file.
void add_report_options(CLI::App& command, ReportFiles& files, const std::string& main_picture);

/// Writes what is wanted and says so in a line for people, which is returned; empty: nothing was wanted.
std::string write_reports(const ReportFiles& files, const report::Document& document);

}  // namespace llmt::apps
