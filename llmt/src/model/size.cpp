#include "llmt/size.hpp"

#include <algorithm>
#include <limits>
#include <vector>

namespace llmt {
namespace {

Eigen::Index size_of_factor(const InputColumn& input) { return input.centre == 0.0 ? 1 : 3; }

Eigen::Index size_of_regressor(const Regressor& regressor, const std::vector<InputColumn>& inputs) {
  if (regressor.level >= 0) return 3;
  if (regressor.second_input < 0) return 1;
  const Eigen::Index first = size_of_factor(inputs[regressor.input]);
  return regressor.second_input == regressor.input ? first + 2
                                                   : first + 1 + size_of_factor(inputs[regressor.second_input]);
}

// The size of the local model of a node for one output of its partition.
Eigen::Index size_of_local_model(const Node& node, Eigen::Index output, const std::vector<Eigen::Index>& regressors) {
  Eigen::Index size = 1;
  for (Eigen::Index k = 0; k < node.slope.cols(); ++k) {
    if (node.slope(output, k) != 0.0) size += 3 + regressors[k];
  }
  return size;
}

bool is_on_number(const Node& node) {
  return node.level_side.empty() && node.threshold < std::numeric_limits<double>::max();
}

// The size that a split adds to the expressions of its children.
Eigen::Index size_of_split(const Node& node, const Validity& validity) {
  if (!node.level_side.empty()) return 3 + std::ranges::count(node.level_side, -1);
  if (!is_on_number(node)) return 3;
  const Eigen::Index side = node.is_oblique() ? 4 * (node.direction.array() != 0.0).count() - 1 : 1;
  if (node.half_width == 0.0) return 3 + side;
  if (validity.kind == ValidityKind::logistic) {
    const Eigen::Index gate = 9 + side;
    return 5 + 2 * gate;
  }
  const Eigen::Index ramp = 8 + side;
  const Eigen::Index transition = 7 + 2 * ramp;
  return 5 + 2 * transition;
}

// The size that weights by normalised Gaussians add to the local models.
Eigen::Index size_of_gaussians(const Partition& partition) {
  std::vector<int> split;
  for (const Node& node : partition.nodes) {
    if (!node.is_leaf() && is_on_number(node)) split.push_back(node.split_input);
  }
  std::ranges::sort(split);
  const Eigen::Index inputs = std::unique(split.begin(), split.end()) - split.begin();
  const Eigen::Index leaves = partition.num_leaves();
  if (leaves == 1) return 0;
  const Eigen::Index gaussian = 8 * inputs + 2;
  return 2 * leaves * gaussian + leaves + 2 * (leaves - 1) + 1;  // the Gaussians, *, + in both sums, /
}

Eigen::Index size_of_partition(const Partition& partition, const std::vector<Eigen::Index>& regressors) {
  const bool is_gaussian = partition.validity.kind == ValidityKind::gaussian;
  Eigen::Index size = 0;
  for (Eigen::Index output = 0; output < std::ssize(partition.outputs); ++output) {
    if (is_gaussian) size += size_of_gaussians(partition);
    for (const Node& node : partition.nodes) {
      if (node.is_leaf()) {
        size += size_of_local_model(node, output, regressors);
      } else if (!is_gaussian) {
        size += size_of_split(node, partition.validity);
      }
    }
  }
  return size;
}

}  // namespace

Eigen::Index expression_size(const Model& model) {
  std::vector<Eigen::Index> regressors;
  for (const Regressor& regressor : model.regressors()) {
    regressors.push_back(size_of_regressor(regressor, model.inputs()));
  }
  Eigen::Index size = 0;
  for (const Partition& partition : model.partitions()) size += size_of_partition(partition, regressors);
  return size;
}

}  // namespace llmt
