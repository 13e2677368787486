/// \file
/// What `llmt fit` says of a fit: as JSON and as text.
#pragma once

#include <string>
#include <vector>

#include "llmt/fit.hpp"
#include "llmt/learning.hpp"
#include "shared/cli.hpp"

namespace llmt::apps {

/// What was fitted: its arguments, the rows, and the file it went to; empty: none.
struct FitRun {
  const LearningArguments& learning;
  const LearningTable& table;
  const std::string& output;
};

/// The rows that Loss::tukey left out, ascending; none of those whose weight was 0 anyway. `weights`: empty: all 1.
std::vector<Eigen::Index> rows_left_out(const FitSummary& summary, const Eigen::VectorXd& weights);

/// Names of inputs.
std::vector<std::string> names_of(const Model& model, const std::vector<int>& inputs);

/// Lines of rows in the file.
std::vector<Eigen::Index> lines_of(const FitRun& run, const std::vector<Eigen::Index>& rows);

Json summary_json(const FitRun& run, const FitResult& result);

void print_summary(const FitRun& run, const FitResult& result);

}  // namespace llmt::apps
