/// \file
/// The model of the top of a tree and its branches.
#pragma once

#include "distributed/state.hpp"
#include "llmt/model.hpp"

namespace llmt::distributed {

/// One model of a top whose branches are all done.
Model assemble(const StateData& data);

}  // namespace llmt::distributed
