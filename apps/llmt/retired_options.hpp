/// \file
/// Options of earlier versions.
#pragma once

#include <CLI/CLI.hpp>

namespace llmt::apps {

/// Makes `command` refuse options that an earlier version had, with a message that says why they went and what does
/// their work now. They do not appear in its help.
void refuse_retired_options(CLI::App& command);

}  // namespace llmt::apps
