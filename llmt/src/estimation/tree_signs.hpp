/// \file
/// Signs of slopes in a whole tree.
#pragma once

#include "data/dataset.hpp"

namespace llmt {

/// keep_signs() for all nodes of a tree whose local models are the least-squares models of the rows in their boxes. A
/// tree that has the signs stays as it is.
void keep_signs(const TrainingRows& training, Partition& grown, int max_threads);

}  // namespace llmt
