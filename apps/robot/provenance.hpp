/// \file
/// The record of a calibration: from which files, when, how.
#pragma once

#include <CLI/CLI.hpp>
#include <string>
#include <utility>
#include <vector>

#include "llmt/robotics/robot_types.hpp"

namespace llmt::apps {

/// What the user states for the record.
struct Stated {
  std::string instrument;
  std::string serial_number;
};

/// --instrument and --serial-number.
void add_stated(CLI::App& command, Stated& stated);

/// The record of a run of `command`. `files`: role and path; those without a path are left out. The date is today's, or
/// that of SOURCE_DATE_EPOCH (reproducible-builds.org). Options that change no result are left out: names of outputs,
/// threads. Throws std::runtime_error with its name for a file that cannot be read.
robotics::Provenance provenance_of(const CLI::App& command,
                                   const std::vector<std::pair<std::string, std::string>>& files, const Stated& stated);

/// SHA-256 (FIPS 180-4) of bytes, as 64 hexadecimal digits.
std::string sha256(const std::string& bytes);

}  // namespace llmt::apps
