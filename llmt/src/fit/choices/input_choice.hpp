/// \file
/// Which inputs a partition uses: backward elimination, docs/algorithms/input-choice.md.
#pragma once

#include <memory>
#include <vector>

#include "data/training.hpp"
#include "llmt/progress.hpp"
#include "llmt/summary.hpp"

namespace llmt {

/// The inputs that a partition uses.
struct ChosenInputs {
  std::shared_ptr<const Training>
      training;                       ///< with these inputs alone; each fold's model has as many as that of all rows
  std::vector<int> left_out = {};     ///< ascending
  std::vector<InputStep> steps = {};  ///< empty: nothing was compared
};

/// All inputs, or fewer where that lowers the error on held-out rows by more than chance. `served`: the outputs;
/// `work`: the choice counts as a part of it.
ChosenInputs choose_inputs(const std::shared_ptr<const Training>& training, const std::vector<int>& served, Work& work);

}  // namespace llmt
