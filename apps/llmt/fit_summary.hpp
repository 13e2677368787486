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
std::vector<Eigen::Index> rows_left_out(const Eigen::VectorXd& loss_weights, const Eigen::VectorXd& weights);

/// "Rows left out by the Tukey loss: 2 of 60 (lines 5, 9); the errors below are those of the other rows". `lines`: of
/// the rows left out; `rows`: of the table.
std::string left_out_by_loss(std::vector<Eigen::Index> lines, Eigen::Index rows);

/// The given rows, the first one below the header being 1.
std::vector<Eigen::Index> counted_from_one(std::vector<Eigen::Index> rows);

/// Names of inputs.
std::vector<std::string> names_of(const Model& model, const std::vector<int>& inputs);

/// Lines of rows in the file.
std::vector<Eigen::Index> lines_at(const LearningTable& table, const std::vector<Eigen::Index>& rows);

Json summary_json(const FitRun& run, const FitResult& result);

void print_summary(const FitRun& run, const FitResult& result);

}  // namespace llmt::apps
