/// \file
/// Free runs of a candidate over stretches that it was not learned from.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "dynamics/model_structure.hpp"
#include "dynamics/stretches.hpp"
#include "llmt/progress.hpp"

namespace llmt {

struct HeldOutRuns {
  RunBand band;
  Eigen::MatrixXd simulated;  ///< rows of the series x outputs, of the first folds; NaN: no run
};

/// Runs over the held-out stretches of folds to their end. The band pools them with runs that begin at sixteen places
/// of each stretch. `first`: that many folds, which hold out every row once, fill `simulated`.
HeldOutRuns held_out_runs(const Task& task, const ModelStructure& candidate, const std::vector<StretchFold>& folds,
                          Eigen::Index first, int iterations, Work& work);

}  // namespace llmt
