#include "estimation/joint_estimate.hpp"

#include <map>
#include <utility>

#include "estimation/local_estimate.hpp"
#include "estimation/sums/assembly.hpp"
#include "numerics/conjugate_gradients.hpp"
#include "partition/evaluator.hpp"
#include "partition/imputed.hpp"

namespace llmt {
namespace {

// Steps of conjugate gradients from an estimate on a sample towards that on all rows. The sample's factor makes each of
// them gain about one digit. The length of each step is measured on all rows: where a leaf has next to no rows in the
// sample, a step of length one would go far astray.
constexpr int steps_on_all_rows = 2;

// Sums over rows of weight x validity x regressors x residual, for the coefficients of a prefix's leaves.
class GradientSum {
 public:
  GradientSum(const TrainingRows& rows, const Partition& partition, const JointEquations& equations,
              const Eigen::VectorXd& scale, int max_threads)
      : partition_(partition),
        equations_(equations),
        scale_(scale),
        evaluator_(partition, rows.columns, scale.size()),
        leaves_out_ambiguous_(leaves_out_ambiguous(rows, evaluator_, max_threads)),
        has_missing_(rows.has_missing) {}

  // Adds sum_n q_n Phi_i a r over a chunk to `sums`. r is what the coefficients leave of the outputs; or of zero.
  void add(const Chunk& chunk, const Eigen::MatrixXd& coefficients, bool of_outputs, Eigen::MatrixXd& sums) const {
    std::vector<Activation> active;
    RowMajor regressors;
    for (Eigen::Index row = 0; row < chunk.count(); ++row) {
      const double* inputs = chunk.inputs.row(row).data();
      if (leaves_out_ambiguous_ && evaluator_.is_ambiguous(inputs)) continue;
      evaluator_.activate(inputs, active);
      set_regressors(chunk, row, active, regressors);
      for (Eigen::Index o = 0; o < coefficients.cols(); ++o) {
        const double target = of_outputs ? chunk.outputs(row, o) : 0.0;
        add_row(active, regressors, coefficients.col(o).data(), target, chunk.weights(row), sums.col(o).data());
      }
    }
  }

 private:
  // Regressors [1, x] as each active leaf sees them. One line serves all leaves if no value is missing.
  void set_regressors(const Chunk& chunk, Eigen::Index row, const std::vector<Activation>& active,
                      RowMajor& regressors) const {
    const Eigen::Index lines = has_missing_ ? std::ssize(active) : 1;
    regressors.resize(lines, scale_.size() + 1);
    for (Eigen::Index line = 0; line < lines; ++line) {
      const Node& node = partition_.nodes[active[line].node];
      regressors(line, 0) = 1.0;
      for (Eigen::Index k = 0; k < scale_.size(); ++k) {
        regressors(line, k + 1) = imputed(node, k, chunk.deviations(row, k)) / scale_(k);
      }
    }
  }

  void add_row(const std::vector<Activation>& active, const RowMajor& regressors, const double* coefficients,
               double target, double weight, double* sums) const {
    const Eigen::Index size = regressors.cols();
    const auto line_of = [&](std::size_t entry) { return regressors.row(has_missing_ ? entry : 0).data(); };
    const auto begin_of = [&](std::size_t entry) { return equations_.position[active[entry].node] * size; };
    double residual = target;
    for (std::size_t entry = 0; entry < active.size(); ++entry) {
      const double* of_leaf = coefficients + begin_of(entry);
      const double* line = line_of(entry);
      double value = 0.0;
      for (Eigen::Index k = 0; k < size; ++k) {
        value += of_leaf[k] * line[k];
      }
      residual -= active[entry].validity * value;
    }
    residual *= weight;
    for (std::size_t entry = 0; entry < active.size(); ++entry) {
      double* to = sums + begin_of(entry);
      const double* line = line_of(entry);
      for (Eigen::Index k = 0; k < size; ++k) {
        to[k] += active[entry].validity * residual * line[k];
      }
    }
  }

  const Partition& partition_;
  const JointEquations& equations_;
  const Eigen::VectorXd& scale_;
  const Evaluator evaluator_;
  const bool leaves_out_ambiguous_;
  const bool has_missing_;
};

}  // namespace

std::vector<Partition> joint(const LeafSums& sums, Eigen::Index leaves,
                             const std::vector<Regularisation>& regularisations) {
  const JointEquations equations = joint_equations(sums, leaves);
  std::vector<Partition> results;
  std::map<std::pair<double, bool>, std::vector<Eigen::MatrixXd>> of_nodes;  // of each shrinkage, full or sparse
  std::map<double, ActiveInequalities> active;  // of each shrinkage, on which the inner nodes depend
  for (const Regularisation& regularisation : regularisations) {
    const auto [entry, is_new] = of_nodes.try_emplace({regularisation.shrinkage, regularisation.sparse});
    if (is_new) {
      entry->second = local_models(sums, 2 * equations.leaves - 1, regularisation.shrinkage, regularisation.sparse);
    }
    const JointSolution solution = solve(sums, equations, regularisation, entry->second);
    results.push_back(constrained(sums, equations.leaf_nodes, solution.estimate, active[regularisation.shrinkage]));
  }
  return results;
}

Partition joint_from_sample(const LeafSums& sample, const TrainingRows& all, Eigen::Index leaves,
                            const Regularisation& regularisation, Work& work) {
  const JointEquations equations = joint_equations(sample, leaves);
  JointSolution solution =
      solve(sample, equations, regularisation,
            local_models(sample, 2 * equations.leaves - 1, regularisation.shrinkage, regularisation.sparse));
  Eigen::MatrixXd& coefficients = solution.estimate.leaf_coefficients;
  const Partition partition = prefix(sample.partition, leaves);
  const GradientSum gradient_sum(all, partition, equations, sample.training->scale, sample.max_threads);
  const auto gradient = [&](const Eigen::MatrixXd& at, bool of_outputs) -> Eigen::MatrixXd {
    Eigen::MatrixXd zero = Eigen::MatrixXd::Zero(at.rows(), at.cols());
    const auto add = [&](const Chunk& chunk, Eigen::MatrixXd& sums) {
      work.check();
      gradient_sum.add(chunk, at, of_outputs, sums);
    };
    return sum_over(all, partition.outputs, sample.max_threads, std::move(zero), add);
  };
  const auto times_matrix = [&](const Eigen::MatrixXd& change) -> Eigen::MatrixXd {
    return times_regularisation(sample, equations, regularisation, change) - gradient(change, false);
  };
  const auto precondition = [&](const Eigen::MatrixXd& residual) { return times_inverse(solution, residual); };
  const Eigen::MatrixXd residual =
      gradient(coefficients + sample.root.replicate(std::ssize(equations.leaf_nodes), 1), true) +
      times_regularisation(sample, equations, regularisation, solution.anchors - coefficients);
  conjugate_gradients(times_matrix, precondition, steps_on_all_rows, 0.0, residual, coefficients);
  work.check();
  ActiveInequalities none;
  Partition result = constrained(sample, equations.leaf_nodes, solution.estimate, none);
  result.residual_range = residual_range(all, result.nodes.front(), result.outputs, sample.max_threads);
  return result;
}

}  // namespace llmt
