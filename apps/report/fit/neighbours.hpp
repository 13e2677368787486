/// \file
/// Whether rows that follow each other are alike, so that random folds say too little of the error on other stretches.
#pragma once

#include <optional>

#include "llmt/fit.hpp"

namespace llmt::report {

/// The correlation of the held-out errors of rows that follow each other in the table, the largest of the outputs. 0
/// where nothing is to be learned from it: an output that only grows or falls from row to row (a sorted table), repeats
/// or groups, which are held out together, folds that are blocks already, and where not every row is held out. `result`
/// is of these data and has the intervals' models.
double neighbours_correlation(const TrainingData& data, const FitOptions& options, const FitResult& result);

/// Whether the correlation is more than that of rows in random order (five standard errors) and than weak. Rows in
/// random order have 1 / sqrt(rows) as its standard error.
bool are_alike(double correlation, Eigen::Index rows);

/// "Rows that follow each other are alike: their held-out errors have a correlation of 0.83 ...". `rmse_contiguous`:
/// with blocks of rows held out; empty: not measured.
std::string neighbours_text(double correlation, double rmse, std::optional<double> rmse_contiguous);

}  // namespace llmt::report
