/// \file
/// Which candidates are compared.
#pragma once

#include <vector>

#include "dynamics/model_structure.hpp"

namespace llmt {

/// The lags that are compared where the caller gives none. `delays`: the first lag of each input; -1: it has no lags.
std::vector<Lags> lag_candidates(const std::vector<int>& delays, Eigen::Index outputs, Eigen::Index rows);

/// Lags 1 ... `past` of every output and, of every input that has any, `count` ones from its delay on.
Lags simple_lags(const std::vector<int>& delays, Eigen::Index outputs, int past, int count);

/// A few candidates that tell good lags from bad ones.
std::vector<ModelStructure> probes(const Lags& lags, const DynamicOptions& options, Eigen::Index rows);

/// All candidates with these lags.
std::vector<ModelStructure> all_candidates(const Lags& lags, const DynamicOptions& options, Eigen::Index rows);

}  // namespace llmt
