/// \file
/// `llmt fit` of a table in an Arrow file, which need not fit into memory.
#pragma once

#include <CLI/CLI.hpp>
#include <string>

#include "llmt/learning.hpp"

namespace llmt::apps {

struct ArrowFitArguments {
  LearningArguments learning;
  std::string output;
  bool json = false;
  bool no_intervals = false;
  std::string memory;      ///< "4G"; empty: half of the machine's
  std::string checkpoint;  ///< file of the state after every pass; empty: none
  bool resume = false;     ///< begin with the checkpoint
};

/// Bytes from a number with K, M, G or T: "4G", "500M". Throws std::invalid_argument naming the option.
double read_memory(const std::string& text);

/// Learns from the table. `command`: to refuse options of `llmt fit` that are not for such tables.
void arrow_fit_command(const CLI::App& command, const ArrowFitArguments& arguments);

}  // namespace llmt::apps
