/// \file
/// `llmt fit --boost`.
#pragma once

#include <CLI/CLI.hpp>
#include <string>

#include "trees/learning.hpp"

namespace llmt::apps {

struct BoostArguments {
  LearningArguments learning;
  std::string output;
  bool json = false;
  int seeds = 1;
};

/// Fits a sum of trees. `command`: to refuse options of `llmt fit` that are for one tree.
void boost_command(const CLI::App& command, const BoostArguments& arguments);

}  // namespace llmt::apps
