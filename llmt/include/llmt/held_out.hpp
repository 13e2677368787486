/// \file
/// Which rows a fit held out, for whoever wants to see its held-out predictions one by one.
///
///     const std::vector<std::vector<Eigen::Index>> rows = llmt::held_out_rows(inputs, outputs);  // of each fold
#pragma once

#include <Eigen/Core>
#include <vector>

#include "llmt/abi.hpp"
#include "llmt/options.hpp"

namespace llmt {

/// The rows of `inputs` that fit() holds out with these arguments, ascending, one list for each fold, in the order of
/// Intervals::models(): the model of a fold has not seen the rows of its list. Copies of a row are in the list of the
/// row that they copy, and repeats of a measurement in one list; rows of weight 0 are in none. With one fold held out
/// once (many rows) the lists do not cover all rows. Loss::tukey leaves out rows as if their weight were 0: give these
/// (FitSummary::loss_weights) the weight 0 in `options`. Empty without folds. Throws std::invalid_argument as fit().
std::vector<std::vector<Eigen::Index>> held_out_rows(const Eigen::Ref<const Eigen::MatrixXd>& inputs,
                                                     const Eigen::Ref<const Eigen::MatrixXd>& outputs,
                                                     const FitOptions& options = {});

}  // namespace llmt
