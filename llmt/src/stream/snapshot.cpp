#include "stream/snapshot.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <optional>
#include <queue>
#include <set>

#include "estimation/estimate.hpp"
#include "estimation/jumps.hpp"
#include "stream/blend_correction.hpp"

namespace llmt {
namespace {

// `node` as a leaf of a Partition.
Node leaf_of(const StreamTree& tree, const StreamNode& node, const std::vector<ColumnRange>& columns) {
  const StreamSetting& setting = tree.setting();
  const Eigen::Index inputs = setting.inputs;
  const Sums sums = all_sums(setting, node);
  int rank = 0;
  const Eigen::VectorXd change = solve(setting.shape, sums.gram.data(), setting.options.shrinkage, rank);
  // A leaf with too few rows says what it says to predict().
  const bool few = node.is_leaf() && sums.rows < 2 * setting.coefficients();
  const Eigen::VectorXd model = few ? node.model : node.basis.base + change;
  Node result;
  result.samples = sums.rows;
  result.rank = std::max(1, rank);
  result.rss = Eigen::VectorXd::Constant(1, remaining(setting.shape, sums.gram.data(), model - node.basis.base));
  result.slope.resize(1, inputs);
  result.mean.resize(inputs);
  result.low.resize(inputs);
  result.high.resize(inputs);
  result.value = Eigen::VectorXd::Constant(1, model(0));
  for (Eigen::Index k = 0; k < inputs; ++k) {
    const ColumnRange& column = columns[k];
    const double origin = setting.unscaled(k, node.basis.origin(k));
    result.slope(0, k) = model(k + 1) / setting.scale(k);
    result.value(0) += result.slope(0, k) * (column.mean - origin);
    const bool has_values = node.low(k) <= node.high(k);
    result.low(k) = (has_values ? node.low(k) : origin) - column.mean;
    result.high(k) = (has_values ? node.high(k) : origin) - column.mean;
    // A missing value counts as the origin.
    result.mean(k) = std::clamp(origin - column.mean, result.low(k), result.high(k));
  }
  // [1, deviations] of the model = turn * [1, z - origin] of the sums.
  Eigen::MatrixXd turn = Eigen::MatrixXd::Identity(inputs + 1, inputs + 1);
  for (Eigen::Index k = 0; k < inputs; ++k) {
    turn(k + 1, 0) = setting.unscaled(k, node.basis.origin(k)) - columns[k].mean;
    turn(k + 1, k + 1) = setting.scale(k);
  }
  const Eigen::MatrixXd gram = matrix_of(setting.shape, sums.gram.data()).topLeftCorner(inputs + 1, inputs + 1);
  result.inverse_gram = inverse_gram(turn * gram * turn.transpose(), turn.diagonal());
  return result;
}

struct Waiting {
  double gain;
  std::size_t position;
  const StreamNode* node;
  bool operator<(const Waiting& other) const {
    return gain != other.gain ? gain < other.gain : position > other.position;
  }
};

}  // namespace

Partition crisp_partition(const StreamTree& tree, const std::vector<ColumnRange>& columns, int output) {
  Partition partition{.outputs = {output}, .validity = {}, .nodes = {}, .outer_slope = {}, .residual_range = {}};
  std::priority_queue<Waiting> queue;
  const auto enter = [&](const StreamNode& node) {
    if (!node.is_leaf()) {
      queue.push({node.gain * static_cast<double>(node.rows()), partition.nodes.size(), &node});
    }
    partition.nodes.push_back(leaf_of(tree, node, columns));
  };
  enter(tree.root());
  while (!queue.empty()) {
    const Waiting next = queue.top();
    queue.pop();
    const StreamNode& from = *next.node;
    const int left = static_cast<int>(partition.nodes.size());
    Node& node = partition.nodes[next.position];
    node.left = left;
    node.right = left + 1;
    node.split_input = from.input;
    node.threshold = from.threshold;
    const double rows_left = static_cast<double>(from.children[0]->rows());
    const double rows_right = static_cast<double>(from.children[1]->rows());
    node.missing_left = rows_left >= rows_right ? 1.0 : 0.0;
    enter(*from.children[0]);
    enter(*from.children[1]);
  }
  partition.outer_slope = agreed_slope(partition);
  return partition;
}

namespace {

// Held-out rows that choose, at least.
constexpr Eigen::Index enough_rows = 20;

// Rows of a correction for each of its unknowns, at least.
constexpr Eigen::Index rows_per_unknown = 10;

// Candidates.
constexpr std::array<double, 3> widths = {0.5, 1.0, 2.0};
constexpr double first_ridge = 0.1;
constexpr std::array<double, 4> further_ridges = {1e-3, 0.01, 1.0, 10.0};  // of the best with the first
constexpr std::array<double, 2> jumps = {no_jump, 1.0};

Eigen::MatrixXd range_of_residuals(const std::array<const TrainingRows*, 2>& parts, const Partition& partition) {
  const Node& root = partition.nodes.front();
  Eigen::MatrixXd range(1, 2);
  range << std::numeric_limits<double>::infinity(), -std::numeric_limits<double>::infinity();
  for (const TrainingRows* rows : parts) {
    for (Eigen::Index index = 0; index < num_chunks(*rows); ++index) {
      const Chunk chunk = fetch(*rows, index, partition.outputs);
      for (Eigen::Index r = 0; r < chunk.count(); ++r) {
        const Eigen::VectorXd deviations = chunk.deviations.row(r).transpose();
        const double residual = chunk.outputs(r, 0) - root.value(0) -
                                root.slope.row(0).dot(deviations.array().isNaN().select(root.mean, deviations));
        range(0, 0) = std::min(range(0, 0), residual);
        range(0, 1) = std::max(range(0, 1), residual);
      }
    }
  }
  return range;
}

}  // namespace

Partition choose(const TrainingRows& others, const TrainingRows& held_out, Partition crisp, ValidityChoice validity) {
  const Eigen::VectorXd one = Eigen::VectorXd::Ones(1);
  if (held_out.count() < enough_rows || others.count() < enough_rows) return crisp;
  crisp.residual_range = range_of_residuals({&others, &held_out}, crisp);
  const Eigen::VectorXd of_prefixes = prefix_squared_errors(crisp, held_out, one, 1);
  Eigen::Index best_prefix = 0;
  double smallest = of_prefixes.minCoeff(&best_prefix);
  Partition chosen = prefix(crisp, best_prefix + 1);
  if (validity == ValidityChoice::crisp || crisp.num_leaves() == 1) return chosen;
  if (validity == ValidityChoice::blend) {
    smallest = std::numeric_limits<double>::infinity();
  }
  std::vector<Chunk> rows;
  for (Eigen::Index index = 0; index < num_chunks(held_out); ++index) {
    rows.push_back(fetch(held_out, index, crisp.outputs));
  }
  // A correction has rows for so many leaves.
  const Eigen::Index most =
      std::max<Eigen::Index>(2, others.count() / (rows_per_unknown * (std::ssize(others.regressors) + 1)));
  std::set<Eigen::Index> leaf_counts;
  for (const Eigen::Index leaves : {best_prefix + 1, crisp.num_leaves(), std::min(crisp.num_leaves(), most) / 2}) {
    leaf_counts.insert(std::clamp<Eigen::Index>(leaves, 2, std::min(crisp.num_leaves(), most)));
  }
  const GrownTree grown{crisp, jump_sizes(others, crisp, 1)};
  std::optional<BlendCorrection> best;
  const auto offer = [&](Partition candidate) {
    const double error = squared_error(candidate, held_out, rows, one);
    if (error < smallest) {
      smallest = error;
      chosen = std::move(candidate);
      return true;
    }
    return false;
  };
  for (const Eigen::Index leaves : leaf_counts) {
    for (const double jump : jumps) {
      for (const double width : widths) {
        BlendCorrection correction(others,
                                   prefix(blended(others, grown, {ValidityKind::blend, width, 1}, jump), leaves));
        if (offer(correction.corrected(first_ridge))) {
          best = std::move(correction);
        }
      }
    }
  }
  for (const double ridge : further_ridges) {
    if (best) {
      offer(best->corrected(ridge));
    }
  }
  return chosen;
}

}  // namespace llmt
