/// \file
/// Model files that commands are given, and weights of the rows that they are applied to.
#pragma once

#include <string>

#include "llmt/csv.hpp"
#include "llmt/intervals.hpp"
#include "llmt/model.hpp"

namespace llmt::apps {

/// As load(); says of a table that it is one.
Model load_model(const std::string& path);

/// The same with the intervals, if they are wanted.
ModelWithIntervals load_model(const std::string& path, bool with_intervals);

/// A column of weights of new rows. Throws std::runtime_error as Csv::numbers(), and `path:line: column "c": ...` for
/// one that is not positive.
Eigen::VectorXd positive_weights(const Csv& csv, const std::string& column, int threads);

/// Whether the file begins as one that llmt fit --boost writes.
bool is_boosted_file(const std::string& path);

/// Whether the file begins as one that llmt fit --lags writes.
bool is_dynamic_file(const std::string& path);

}  // namespace llmt::apps
