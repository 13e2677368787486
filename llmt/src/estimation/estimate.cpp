#include "estimation/estimate.hpp"

#include <utility>

#include "constraints/monotone_splits.hpp"
#include "estimation/joint_estimate.hpp"
#include "estimation/local_estimate.hpp"
#include "partition/tree.hpp"

namespace llmt {
namespace {

// Rows for each unknown of the sample from which a joint estimate on many rows starts. It is used where there are more
// than twice as many rows.
constexpr Eigen::Index first_sample_rows_per_unknown = 50;

}  // namespace

Partition blended(const TrainingRows& training, const GrownTree& grown, const Validity& validity, double jump) {
  Partition partition = grown.partition;
  partition.validity = validity;
  set_half_widths(partition, training.low(), training.high());
  limit_half_widths(partition, training);
  for (std::size_t i = 0; i < partition.nodes.size(); ++i) {
    if (grown.jumps(i) >= jump) partition.nodes[i].half_width = 0.0;
  }
  return partition;
}

Partition estimate(const TrainingRows& training, const GrownTree& grown, const Candidate& candidate, int max_threads,
                   Work& work) {
  Partition partition = grown_prefix(blended(training, grown, candidate.validity, candidate.jump), candidate.leaves);
  const Eigen::Index enough = first_sample_rows_per_unknown * candidate.leaves * (std::ssize(training.regressors) + 1);
  const bool is_crisp = candidate.validity.kind == ValidityKind::crisp;
  if (!is_crisp && candidate.estimation == Estimation::joint) {
    const Regularisation regularisation{candidate.ridge, candidate.shrinkage, candidate.sparse};
    if (training.count() > 2 * enough) {
      const TrainingRows sample = subsample(training, enough, max_threads);
      work.check();
      const LeafSums sums = sum_leaves(sample, std::move(partition), max_threads, candidate.sparse);
      return joint_from_sample(sums, training, candidate.leaves, regularisation, work);
    }
    const LeafSums sums = sum_leaves(training, std::move(partition), max_threads, candidate.sparse);
    return std::move(joint(sums, candidate.leaves, {regularisation}).front());
  }
  const LeafSums sums = sum_leaves(training, std::move(partition), max_threads, candidate.sparse);
  // Crisp leaves have the models of growth unless something was asked for that growth does not do.
  const bool asks_for_more = candidate.sparse || candidate.shrinkage > 0.0;
  if (is_crisp ? asks_for_more : candidate.estimation == Estimation::local) {
    return local(sums, candidate.leaves, candidate.shrinkage, candidate.sparse);
  }
  return as_grown(sums, candidate.leaves);
}

}  // namespace llmt
