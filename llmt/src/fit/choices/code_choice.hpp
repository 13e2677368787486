/// \file
/// Which numeric inputs are codes, that is, categories given as numbers: docs/algorithms/codes.md.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "data/training.hpp"
#include "llmt/intervals.hpp"
#include "llmt/progress.hpp"
#include "llmt/summary.hpp"

namespace llmt {

/// The codes of every input, ascending; an empty list: the input is a number, or a category by the caller's word.
using Codes = std::vector<std::vector<double>>;

/// Takes inputs of few whole numbers for codes where that lowers the error on held-out rows by more than chance.
/// `options` are checked, their terms linear or quadratic. `work`: the choice counts as a part of it.
CodeChoice choose_codes(const GivenRows& given, const FitOptions& options, Work& work);

/// The inputs with positions in place of codes, and the position behind them in place of a missing code.
Eigen::MatrixXd at_positions(const Codes& codes, const Eigen::Ref<const Eigen::MatrixXd>& inputs);

/// The categorical inputs of a fit to positions.
std::vector<int> with_codes(std::vector<int> categorical, const Codes& codes);

/// Intervals of models that were fitted to positions. `empty_levels`: as GivenRows.
Intervals with_codes(const Intervals& intervals, const Codes& codes, const std::vector<std::size_t>& empty_levels);

}  // namespace llmt
