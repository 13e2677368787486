/// \file
/// `llmt fit --stream`.
#pragma once

#include <CLI/CLI.hpp>
#include <string>

#include "llmt/stream.hpp"
#include "trees/learning.hpp"

namespace llmt::apps {

struct StreamArguments {
  LearningArguments learning;
  std::string output;
  bool json = false;
};

/// Learns from a file, or from standard input if that is "-", in memory that does not depend on its length. `command`:
/// to refuse options of `llmt fit` that are not for streams.
void stream_command(const CLI::App& command, const StreamArguments& arguments);

}  // namespace llmt::apps
