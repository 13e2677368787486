/// \file
/// From which lag on inputs help.
#pragma once

#include <vector>

#include "dynamics/choice.hpp"

namespace llmt {

/// No delay of the inputs that change, no lags (-1) of the others: what never changes explains nothing.
std::vector<int> no_delays(const Task& task);

/// 0 in the place of find_delay and no_delay_helps.
std::vector<int> without_marks(std::vector<int> delays);

/// The lag of each input from which on it helps a linear model, one input after the other; -1 as no_delays().
std::vector<int> find_delays(const Task& task, const std::vector<StretchFold>& folds, bool on_runs, Work& work);

/// The dead times that are asked for: those that are given, and of other inputs the longest one with which a linear
/// model of `lags` runs as well as with the best, or no_delay_helps. `rows`: that the folds have.
std::vector<int> asked_delays(const Task& task, const std::vector<StretchFold>& folds, const Lags& lags,
                              std::vector<int> delays, Eigen::Index rows, Work& work);

}  // namespace llmt
