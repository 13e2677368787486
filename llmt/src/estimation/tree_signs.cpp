#include "estimation/tree_signs.hpp"

#include <algorithm>

#include "constraints/signs.hpp"
#include "estimation/sums/assembly.hpp"

namespace llmt {

void keep_signs(const TrainingRows& training, Partition& grown, int max_threads) {
  const std::vector<int> signs = coefficient_signs(training);
  if (signs.empty() || std::ranges::all_of(grown.nodes, [&](const Node& node) { return has_signs(signs, node); })) {
    return;
  }
  Partition crisp = grown;  // ranges are set with the sums
  const Eigen::Index outputs = std::ssize(grown.outputs);
  const Eigen::MatrixXd none = Eigen::MatrixXd::Zero(std::ssize(training.regressors) + 1, outputs);
  const NormalEquations sums = assemble(training, crisp, none, max_threads);
  for (std::size_t i = 0; i < grown.nodes.size(); ++i) {
    if (!has_signs(signs, grown.nodes[i])) {
      keep_signs_by_gram(signs, sums.gram[i], training.scale, grown.nodes[i]);
    }
  }
}

}  // namespace llmt
