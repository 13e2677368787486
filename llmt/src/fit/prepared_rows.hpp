/// \file
/// The rows of a fit with all that was decided before it grows a tree.
#pragma once

#include <memory>
#include <vector>

#include "data/training.hpp"
#include "llmt/progress.hpp"
#include "llmt/summary.hpp"

namespace llmt {

/// The rows of a fit with the loss, the codes and the columns that they are fitted with.
struct PreparedRows {
  std::shared_ptr<const Training> training;    ///< of linear local models where `terms` is automatic
  LocalTerms terms;                            ///< as asked for
  CodeChoice codes = {};                       ///< training.inputs has positions in place of these
  Eigen::VectorXd loss_weights = {};           ///< as FitSummary::loss_weights
  std::vector<std::size_t> empty_levels = {};  ///< as GivenRows

  /// Whether the model is fitted to other values than those that its rows will have: with_codes().
  bool has_positions() const { return !codes.taken.empty() || !empty_levels.empty(); }
};

/// The kept rows, described by regressors. `inputs` and `categorical`: as in Training. `work`: of this.
std::shared_ptr<const Training> describe_columns(std::shared_ptr<const KeptRows> kept, const SharedMatrix& inputs,
                                                 std::vector<int> categorical, const FitOptions& options, Work& work);

/// The given rows as they are, with the squared loss, no choice of codes and checked options; terms: linear or
/// quadratic.
PreparedRows prepare_plain(const GivenRows& given, const FitOptions& options, Work& work);

/// The same rows with linear or quadratic local models.
std::shared_ptr<const Training> with_terms(const std::shared_ptr<const Training>& training, LocalTerms terms,
                                           Work& work);

}  // namespace llmt
