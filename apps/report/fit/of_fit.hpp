/// \file
/// The report of `llmt fit`.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "llmt/fit.hpp"
#include "llmt/readable.hpp"
#include "report/document/document.hpp"

namespace llmt::report {

/// What was fitted to what. `result` has the intervals' models (FitOptions::intervals); its held-out rows are those of
/// `inputs`.
struct Fitted {
  std::string data;  ///< the file
  const Eigen::MatrixXd& inputs;
  const Eigen::MatrixXd& outputs;
  const FitOptions& options;
  const FitResult& result;
  const std::optional<ReadableResult>& readable;
  Eigen::Index left_out = 0;  ///< rows that Loss::tukey left out; they are not among the inputs and outputs
};

/// Charts, and below them what the terminal shows. `words`: see fit_words().
Document fit_report(const Fitted& fitted, const Document& words);

}  // namespace llmt::report
