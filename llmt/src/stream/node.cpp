#include "stream/node.hpp"

namespace llmt {

double value_of(const StreamNode& node, const double* z) {
  double value = node.model(0);
  for (Eigen::Index k = 0; k < node.basis.origin.size(); ++k) {
    const double deviation = z[k] - node.basis.origin(k);
    value += deviation == deviation ? node.model(k + 1) * deviation : 0.0;
  }
  return value;
}

Eigen::Index leaves_of(const StreamNode& node) {
  return (node.is_leaf() ? 1 : leaves_of(*node.children[0]) + leaves_of(*node.children[1])) +
         (node.alternate ? leaves_of(*node.alternate) : 0);
}

Eigen::Index bytes_of(const StreamNode& node) {
  std::size_t doubles = 3 * node.model.size() + 3 * node.low.size();
  for (const Sums* sums : {&node.sums, &node.sides[0], &node.sides[1]}) {
    doubles += sums->gram.capacity();
  }
  Eigen::Index bytes = static_cast<Eigen::Index>(sizeof(StreamNode) + doubles * sizeof(double));
  bytes += node.search ? node.search->bytes() : 0;
  for (const StreamNode* below : {node.children[0].get(), node.children[1].get(), node.alternate.get()}) {
    bytes += below != nullptr ? bytes_of(*below) : 0;
  }
  return bytes;
}

const StreamNode& leaf_of(const StreamNode& top, const double* x) {
  const StreamNode* node = &top;
  while (!node->is_leaf()) {
    node = node->children[side_of(*node, x[node->input])].get();
  }
  return *node;
}

double predict(const StreamNode& top, const StreamRow& row) { return value_of(leaf_of(top, row.x), row.z); }

Sums all_sums(const StreamSetting& setting, const StreamNode& node) {
  Sums sums = node.sums;
  if (!node.is_leaf()) {
    sums.add(setting.shape, node.sides[0]);
    sums.add(setting.shape, node.sides[1]);
  }
  return sums;
}

Eigen::VectorXd own_model(const StreamSetting& setting, const StreamNode& node, int& rank) {
  return node.basis.base + solve(setting.shape, all_sums(setting, node).gram.data(), setting.shrinkage, rank);
}

}  // namespace llmt
