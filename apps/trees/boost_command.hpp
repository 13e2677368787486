/// \file
/// `llmt fit --boost`.
#pragma once

#include <CLI/CLI.hpp>
#include <string>

#include "llmt/boosted.hpp"
#include "trees/learning.hpp"

namespace llmt::apps {

struct BoostArguments {
  LearningArguments learning;
  std::string output;
  bool json = false;
  int seeds = 1;
  int max_rounds = BoostOptions().max_rounds;
  double time_limit = 0.0;  ///< in seconds; 0: none
};

/// Fits a sum of trees. `command`: to refuse options of `llmt fit` that are for one tree.
void boost_command(const CLI::App& command, const BoostArguments& arguments);

}  // namespace llmt::apps
