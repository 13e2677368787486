/// \file
/// The division of rows that scikit-learn's users get from a seed, so that results of ours can stand beside theirs.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

namespace bench {

struct SplitRows {
  std::vector<Eigen::Index> train;
  std::vector<Eigen::Index> test;
};

/// The rows of train_test_split(X, y, train_size=.75, test_size=.25, random_state=seed) in their order: of NumPy's
/// RandomState(seed).permutation(rows) the first ceil(rows / 4) are for testing, the others for training.
SplitRows shuffle_split(Eigen::Index rows, std::uint32_t seed);

}  // namespace bench
