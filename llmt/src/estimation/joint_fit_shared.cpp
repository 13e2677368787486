// Leaves that share a local model.
#include <algorithm>

#include "estimation/joint_fit.hpp"

namespace llmt {

void JointFit::copy_shared_models(Partition& partition) {
  for (Node& node : partition.nodes) {
    if (node.shared_with >= 0) {
      const Node& first = partition.nodes[static_cast<std::size_t>(node.shared_with)];
      node.value = first.value;
      node.slope = first.slope;
    }
  }
}

std::vector<Merge> JointFit::merges() const {
  // Outputs are compared by what least squares leaves of them.
  const Eigen::VectorXd weights =
      partition_.nodes.front().rss.unaryExpr([](double rss) { return rss > 0.0 ? 1.0 / rss : 0.0; });
  return merge_sequence(partition_, sums_, weights);
}

void JointFit::share(const Merge& merge) {
  const auto in_group = [&](std::size_t node, int first) {
    return static_cast<int>(node) == first || partition_.nodes[node].shared_with == first;
  };
  std::vector<std::size_t> members;
  std::ptrdiff_t samples = 0;
  for (std::size_t i = 0; i < partition_.nodes.size(); ++i) {
    if (in_group(i, merge.kept) || in_group(i, merge.merged)) {
      members.push_back(i);
      samples += partition_.nodes[i].samples;
    }
  }
  const std::size_t kept = static_cast<std::size_t>(merge.kept);
  const std::size_t merged = static_cast<std::size_t>(merge.merged);
  const Node& a = partition_.nodes[kept];
  const Node& b = partition_.nodes[merged];
  const Eigen::MatrixXd gram = sums_.gram[kept] + sums_.gram[merged];
  const Eigen::MatrixXd products = sums_.products[kept] + sums_.products[merged];
  const Eigen::VectorXd squares = sums_.squares[kept] + sums_.squares[merged];
  const Eigen::VectorXd low = a.low.cwiseMin(b.low);
  const Eigen::VectorXd high = a.high.cwiseMax(b.high);
  const int most = static_cast<int>(std::min<std::ptrdiff_t>({size_, samples, a.rank + b.rank}));
  const int rank = std::clamp(rank_of(gram), std::min(most, std::max(a.rank, b.rank)), most);
  for (const std::size_t member : members) {
    Node& node = partition_.nodes[member];
    node.shared_with = member == kept ? -1 : merge.kept;
    node.low = low;
    node.high = high;
    node.rank = rank;
    sums_.gram[member] = gram;
    sums_.products[member] = products;
    sums_.squares[member] = squares;
  }
  for (const std::size_t member : members) {
    if (!selected_.empty()) {
      selected_[member] = select(member);
    }
  }
}

void JointFit::merge_to(std::ptrdiff_t local_models) {
  if (partition_.num_local_models() <= local_models) {
    return;
  }
  for (const Merge& merge : merges()) {
    if (partition_.num_local_models() <= local_models) {
      return;
    }
    share(merge);
  }
}

}  // namespace llmt
