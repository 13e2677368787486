/// \file
/// Model files that commands are given.
#pragma once

#include <string>

#include "llmt/intervals.hpp"
#include "llmt/model.hpp"

namespace llmt::apps {

/// As load(); says of a table that it is one.
Model load_model(const std::string& path);

/// The same with the intervals, if they are wanted.
ModelWithIntervals load_model(const std::string& path, bool with_intervals);

/// Whether the file begins as one that llmt fit --boost writes.
bool is_boosted_file(const std::string& path);

}  // namespace llmt::apps
