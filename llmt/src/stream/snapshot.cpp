#include "stream/snapshot.hpp"

#include <algorithm>
#include <array>
#include <limits>
#include <optional>
#include <set>

#include "estimation/estimate.hpp"
#include "estimation/jumps.hpp"
#include "estimation/squared_errors.hpp"
#include "estimation/sums/leaf_sums.hpp"
#include "partition/tree.hpp"
#include "stream/blend_correction.hpp"

namespace llmt {
namespace {

// Number of held-out rows, and of other rows, from which on there is a choice.
constexpr Eigen::Index enough_rows = 20;

// A correction has at least this many rows for each of its unknowns.
constexpr Eigen::Index rows_per_unknown = 10;

// The candidates. The ridges but the first are tried with the shape that is best with the first.
constexpr std::array<double, 3> widths = {0.5, 1.0, 2.0};
constexpr double first_ridge = 0.1;
constexpr std::array<double, 4> further_ridges = {1e-3, 0.01, 1.0, 10.0};
constexpr std::array<double, 2> jumps = {no_jump, 1.0};

// The range over both parts of the rows.
Eigen::MatrixXd range_of_residuals(const TrainingRows& others, const TrainingRows& held_out,
                                   const Partition& partition) {
  const Node& root = partition.nodes.front();
  const Eigen::MatrixXd first = residual_range(others, root, partition.outputs, 1);
  const Eigen::MatrixXd second = residual_range(held_out, root, partition.outputs, 1);
  Eigen::MatrixXd range(first.rows(), 2);
  range << first.col(0).cwiseMin(second.col(0)), first.col(1).cwiseMax(second.col(1));
  return range;
}

// Leaf counts of blends: that of the best crisp tree, all, and half of those for which there are rows.
std::set<Eigen::Index> leaf_counts(const TrainingRows& others, Eigen::Index best_crisp, Eigen::Index all) {
  const Eigen::Index coefficients = std::ssize(others.regressors) + 1;
  const Eigen::Index enough_for = std::max<Eigen::Index>(2, others.count() / (rows_per_unknown * coefficients));
  const Eigen::Index most = std::min(all, enough_for);
  std::set<Eigen::Index> counts;
  for (const Eigen::Index leaves : {best_crisp, all, most / 2}) {
    counts.insert(std::clamp<Eigen::Index>(leaves, 2, most));
  }
  return counts;
}

// The best of the partitions that are offered, by their squared error on the held-out rows.
class BestPartition {
 public:
  // A candidate takes the place of `first` if its error is below `error`.
  BestPartition(const TrainingRows& held_out, Partition first, double error)
      : held_out_(held_out), rows_(fetch_all(held_out, first.outputs)), best_(std::move(first)), smallest_(error) {}

  // Whether the candidate is the best so far.
  bool offer(Partition candidate) {
    const double error = squared_errors(candidate, held_out_, rows_, Eigen::VectorXd::Ones(1)).sum();
    if (!(error < smallest_)) return false;
    smallest_ = error;
    best_ = std::move(candidate);
    return true;
  }

  Partition take() { return std::move(best_); }

 private:
  const TrainingRows& held_out_;
  std::vector<Chunk> rows_;
  Partition best_;
  double smallest_;
};

void offer_blends(const TrainingRows& others, const Partition& crisp, Eigen::Index best_crisp, BestPartition& best) {
  const GrownTree grown{crisp, jump_sizes(others, crisp, 1)};
  std::optional<BlendCorrection> best_correction;
  for (const Eigen::Index leaves : leaf_counts(others, best_crisp, crisp.num_leaves())) {
    for (const double jump : jumps) {
      for (const double width : widths) {
        const Validity validity{ValidityKind::blend, width};
        BlendCorrection correction(others, grown_prefix(blended(others, grown, validity, jump), leaves));
        if (best.offer(correction.corrected(first_ridge))) {
          best_correction = std::move(correction);
        }
      }
    }
  }
  if (!best_correction) return;
  for (const double ridge : further_ridges) {
    best.offer(best_correction->corrected(ridge));
  }
}

}  // namespace

Partition choose(const TrainingRows& others, const TrainingRows& held_out, Partition crisp, ValidityChoice validity) {
  if (held_out.count() < enough_rows || others.count() < enough_rows) return crisp;
  crisp.residual_range = range_of_residuals(others, held_out, crisp);
  const Eigen::VectorXd of_prefixes = prefix_squared_errors(crisp, crisp, held_out, Eigen::VectorXd::Ones(1), 1);
  Eigen::Index best_prefix = 0;
  double smallest = of_prefixes.minCoeff(&best_prefix);
  Partition chosen = grown_prefix(crisp, best_prefix + 1);
  if (validity == ValidityChoice::crisp || crisp.num_leaves() == 1) return chosen;
  if (validity == ValidityChoice::blend) {
    smallest = std::numeric_limits<double>::infinity();
  }
  BestPartition best(held_out, std::move(chosen), smallest);
  offer_blends(others, crisp, best_prefix + 1, best);
  return best.take();
}

}  // namespace llmt
