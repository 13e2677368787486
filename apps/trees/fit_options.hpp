/// \file
/// The options of `llmt fit` that `llmt compare` does not have: rule, local models, candidates.
#pragma once

#include <CLI/CLI.hpp>

#include "llmt/fit.hpp"

namespace llmt::apps {

/// Adds them to a command. `options` must live as long as the command.
void add_fit_options(CLI::App& command, FitOptions& options);

/// The option --loss of `fit` and `compare`.
void add_loss(CLI::App& command, Loss& loss);

}  // namespace llmt::apps
