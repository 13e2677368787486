#include "model/leaf_validities.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "base/count.hpp"
#include "base/simd.hpp"
#include "model/logistic.hpp"
#include "model/transition.hpp"
#include "model/tree.hpp"

namespace llmt {
namespace {

// Gaussians whose logarithm lies this far below the largest one's are left out.
constexpr double negligible_log = -40.0;

}  // namespace

LeafValidities::LeafValidities(const Partition& partition, const std::vector<InputColumn>& inputs)
    : kind_(partition.validity.kind), smoothness_(partition.validity.smoothness) {
  for (const Node& node : partition.nodes) {
    Branch branch{.left = node.left,
                  .right = node.right,
                  .input = node.split_input,
                  .first_level = -1,
                  .levels = 0,
                  .first_term = -1,
                  .terms = 0,
                  .threshold = node.threshold,
                  .per_half_width = std::isfinite(1.0 / node.half_width) ? 1.0 / node.half_width : 0.0,
                  .missing_left = node.missing_left};
    if (!node.level_side.empty()) {
      branch.first_level = count_of(level_share_);
      branch.levels = count_of(node.level_side);
      for (const int side : node.level_side) {
        level_share_.push_back(side < 0 ? 1.0 : side > 0 ? 0.0 : node.missing_left);
      }
    }
    if (node.is_oblique()) {
      branch.first_term = count_of(terms_);
      for (Eigen::Index j = 0; j < node.direction.size(); ++j) {
        if (node.direction(j) != 0.0) {
          terms_.push_back({static_cast<int>(j), node.direction(j), inputs[j].centre});
          ++branch.terms;
        }
      }
    }
    branches_.push_back(branch);
  }
  std::vector<Eigen::Index> depths(partition.nodes.size(), 0);
  for (std::size_t i = 0; i < partition.nodes.size(); ++i) {  // parents stand before their children
    depth_ = std::max(depth_, depths[i]);
    if (const Node& node = partition.nodes[i]; !node.is_leaf()) depths[node.left] = depths[node.right] = depths[i] + 1;
  }
  if (are_gaussian()) {
    add_gaussians(partition, inputs);
  }
}

void LeafValidities::add_gaussians(const Partition& partition, const std::vector<InputColumn>& inputs) {
  const Eigen::Index count = std::ssize(inputs);
  Eigen::VectorXd low(count);
  Eigen::VectorXd high(count);
  for (Eigen::Index j = 0; j < count; ++j) {
    low(j) = inputs[j].low;
    high(j) = inputs[j].high;
  }
  gaussians_.inputs = count;
  gaussians_.stride = padded_to_quads(count);
  const Boxes boxes = boxes_of(partition, low, high);
  std::vector<bool> is_split(inputs.size(), false);
  for (const Node& node : partition.nodes) {
    if (!node.is_leaf() && node.level_side.empty() && node.threshold < std::numeric_limits<double>::max()) {
      is_split[node.split_input] = true;
    }
  }
  for (int box = 0; box < std::ssize(partition.nodes); ++box) {
    if (!partition.nodes[box].is_leaf()) continue;
    gaussians_.nodes.push_back(box);
    for (Eigen::Index j = 0; j < gaussians_.stride; ++j) {
      const bool used = j < count && is_split[j];
      const double sigma = used ? partition.validity.width * (boxes.high(j, box) - boxes.low(j, box)) : 0.0;
      // An input that no split uses has the same factor in all Gaussians, which normalisation cancels.
      gaussians_.per_sigma.push_back(std::isfinite(1.0 / sigma) ? 1.0 / sigma : 0.0);
      gaussians_.centres.push_back(used ? 0.5 * (boxes.low(j, box) + boxes.high(j, box)) : 0.0);
    }
  }
}

double LeafValidities::left_share(const Branch& branch, double x) const {
  if (branch.first_level >= 0) {
    const bool known = x >= 0.0 && x < branch.levels;
    return known ? level_share_[static_cast<std::size_t>(branch.first_level) + static_cast<std::size_t>(x)]
                 : branch.missing_left;
  }
  if (std::isnan(x)) return branch.missing_left;
  if (branch.per_half_width == 0.0) return x <= branch.threshold ? 1.0 : 0.0;
  const double u = (x - branch.threshold) * branch.per_half_width;
  return kind_ == ValidityKind::logistic ? logistic(u) : transition(u, smoothness_);
}

int LeafValidities::child_of(int node, const double* row) const {
  const Branch& branch = branches_[node];
  if (const double x = side(branch, row); branch.first_level < 0 && !std::isnan(x)) {
    return x <= branch.threshold ? branch.left : branch.right;
  }
  return left_share(node, row) >= 0.5 ? branch.left : branch.right;
}

bool LeafValidities::is_ambiguous(const double* row) const {
  std::vector<int> open = {0};
  while (!open.empty()) {
    const int node = open.back();
    open.pop_back();
    const Branch& branch = branches_[node];
    if (branch.left < 0) continue;
    const double left = left_share(node, row);
    if (branch.first_term < 0 && std::isnan(row[branch.input]) && left > 1.0 - clear_share && left < clear_share) {
      return true;
    }
    if (left > 0.0) {
      open.push_back(branch.left);
    }
    if (left < 1.0) {
      open.push_back(branch.right);
    }
  }
  return false;
}

void LeafValidities::activate(const double* row, std::vector<Activation>& active) const {
  active.clear();
  if (are_gaussian()) {
    activate_gaussians(row, active);
    return;
  }
  thread_local std::vector<Activation> waiting;  // right children, the leftmost last; kept for its memory
  waiting.assign(1, {0, 1.0});
  while (!waiting.empty()) {
    auto [node, validity] = waiting.back();
    waiting.pop_back();
    for (const Branch* branch = &branches_[node]; branch->left >= 0; branch = &branches_[node]) {
      const double left = left_share(*branch, side(*branch, row));
      node = left <= 0.0 ? branch->right : branch->left;
      if (left > 0.0 && left < 1.0) {
        waiting.push_back({branch->right, validity * (1.0 - left)});
        validity *= left;
      }
    }
    active.push_back({node, validity});
  }
}

LLMT_FOR_EACH_INSTRUCTION_SET
double LeafValidities::set_exponents(const double* row, Activation* active) const {
  double largest = -std::numeric_limits<double>::infinity();
  const double* centre = gaussians_.centres.data();
  const double* per_sigma = gaussians_.per_sigma.data();
  for (std::size_t i = 0; i < gaussians_.nodes.size(); ++i) {
    Quad sum = {};
    for (Eigen::Index j = 0; j < gaussians_.inputs; j += quad, centre += quad, per_sigma += quad) {
      const Quad x = load_quad(row + j, gaussians_.inputs - j);
      const Quad z = x != x ? Quad{} : (x - load_quad(centre)) * load_quad(per_sigma);
      sum += z * z;
    }
    active[i].validity = -0.5 * sum_of(sum);
    largest = std::max(largest, active[i].validity);
  }
  return largest;
}

void LeafValidities::activate_gaussians(const double* row, std::vector<Activation>& active) const {
  active.clear();
  for (const int node : gaussians_.nodes) {
    active.push_back({node, 0.0});
  }
  const double largest = set_exponents(row, active.data());
  std::erase_if(active, [&](const Activation& entry) { return !(entry.validity - largest >= negligible_log); });
  double sum = 0.0;
  for (Activation& entry : active) {
    entry.validity = std::exp(entry.validity - largest);
    sum += entry.validity;
  }
  for (Activation& entry : active) {
    entry.validity /= sum;
  }
}

}  // namespace llmt
