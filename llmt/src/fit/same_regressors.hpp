/// \file
/// One model of partitions that use different regressors.
#pragma once

#include <vector>

#include "data/dataset.hpp"
#include "llmt/model.hpp"

namespace llmt {

/// A partition and the regressors that it uses.
struct PartitionOn {
  std::vector<Regressor> regressors;
  Partition partition;
};

/// The model of these partitions, which serve all outputs of `rows` together. Its regressors are those of `rows` that
/// some partition uses; the slopes of the others are 0 in a partition.
Model make_model(const TrainingRows& rows, std::vector<PartitionOn> partitions);

}  // namespace llmt
