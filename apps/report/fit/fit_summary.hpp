/// \file
/// A fit as words and as JSON.
#pragma once

#include <string>
#include <vector>

#include "llmt/fit.hpp"
#include "report/document/document.hpp"
#include "report/text/json.hpp"
#include "report/text/text.hpp"

namespace llmt::report {

/// What was fitted to what.
struct FitRun {
  std::string data;  ///< the name of the table
  const FitOptions& options;
  const TrainingData& rows;
  const std::vector<Eigen::Index>& lines;  ///< of the rows, in the table's file
  std::string output;                      ///< the file of the model; empty: none
};

/// The rows that Loss::tukey left out, ascending; none of those whose weight was 0 anyway. `weights`: empty: all 1.
std::vector<Eigen::Index> rows_left_out(const Eigen::VectorXd& loss_weights, const Eigen::VectorXd& weights);

/// "Rows left out by the Tukey loss: 2 of 60 (lines 5, 9); the errors below are those of the other rows". `lines`: of
/// the rows left out; `rows`: of the table.
std::string left_out_by_loss(std::vector<Eigen::Index> lines, Eigen::Index rows);

/// The standard deviation of an error over the folds; "-" where only one was held out.
std::string spread_text(double spread, Eigen::Index folds);

/// The given rows, the first one below the header being 1.
std::vector<Eigen::Index> counted_from_one(std::vector<Eigen::Index> rows);

/// Names of inputs.
std::vector<std::string> names_of(const Model& model, const std::vector<int>& inputs);

/// The entries of `lines` at the given rows.
std::vector<Eigen::Index> lines_at(const std::vector<Eigen::Index>& lines, const std::vector<Eigen::Index>& rows);

/// Rows, settings, what was compared and what was chosen.
Json fit_json(const FitRun& run, const FitResult& result);

/// The same for people: subject, notes, and a section with the models that were compared.
Document fit_words(const FitRun& run, const FitResult& result);

}  // namespace llmt::report
