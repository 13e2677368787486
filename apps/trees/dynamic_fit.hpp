/// \file
/// `llmt fit --lags`: a model of a system that moves.
#pragma once

#include <CLI/CLI.hpp>
#include <string>

#include "shared/report_files.hpp"
#include "trees/learning.hpp"

namespace llmt::apps {

/// The options of `llmt fit` that only systems that move have.
struct DynamicArguments {
  std::string lags;   ///< empty: a table of rows is learned
  std::string delay;  ///< empty: none is asked for
  std::string time;
  std::string purpose = "simulation";
  double grid = 0.0;
  bool accept_unstable = false;
};

void add_dynamic_options(CLI::App& command, DynamicArguments& arguments);

struct DynamicFitArguments {
  LearningArguments learning;
  DynamicArguments dynamic;
  std::string output;
  bool json = false;
  bool boost = false;
  bool readable = false;
  ReportFiles reports = {};
};

/// Throws std::invalid_argument for an option that was given and is not for systems that move, and ExitCode if the
/// model is unstable and therefore not written.
void dynamic_fit_command(const CLI::App& command, const DynamicFitArguments& arguments);

/// Throws std::invalid_argument if one of the options was given without --lags.
void refuse_dynamic_options(const CLI::App& command);

}  // namespace llmt::apps
