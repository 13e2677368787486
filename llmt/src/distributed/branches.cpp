// Branches that fit() finishes, and the choice of the size of the top.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "distributed/growth.hpp"
#include "distributed/top_model.hpp"
#include "llmt/fit.hpp"
#include "llmt/intervals.hpp"
#include "numerics/gram.hpp"
#include "stream/sums.hpp"

namespace llmt::distributed {
namespace {

// The rows of a branch as fit() takes them. Pieces are freed on the way.
TrainingData data_of(const StateData& data, const TopNode& node, BranchRows rows) {
  TrainingData result;
  const Eigen::Index inputs = data.inputs();
  const Eigen::Index columns = data.row_columns();
  const bool is_all = node.rows == data.rows;
  Eigen::Index given = 0;
  for (const std::vector<double>& piece : rows.pieces) given += std::ssize(piece) / columns;
  if (given != node.rows) {
    throw std::runtime_error(fmt::format(
        "llmt::distributed::advance: a branch has {} rows, and had {}: the table changed", given, node.rows));
  }
  result.inputs.resize(node.rows, inputs);
  result.outputs.resize(node.rows, 1);
  if (data.is_weighted()) result.weights.resize(node.rows);
  Eigen::Index next = 0;
  for (std::vector<double>& piece : rows.pieces) {
    const Eigen::Index count = std::ssize(piece) / columns;
    using RowMajorMatrix = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
    const Eigen::Map<const RowMajorMatrix> values(piece.data(), count, columns);
    result.inputs.middleRows(next, count) = values.leftCols(inputs);
    result.outputs.middleRows(next, count) = values.col(inputs);
    if (data.is_weighted()) {
      result.weights.segment(next, count) = (is_all ? 1.0 : data.weight_scale) * values.col(inputs + 1);
    }
    next += count;
    std::vector<double>().swap(piece);
  }
  result.input_names = to_strings(data.input_names);
  result.output_names = {to_string(data.output_name)};
  for (const std::vector<Text>& levels : data.levels) result.levels.push_back(to_strings(levels));
  return result;
}

// Mean square of the residuals of a node's own model on the rows of held-out blocks, when it is made of the others;
// NaN if there are too few.
double held_out_square(const StateData& data, const TopNode& node) {
  const GramShape shape = data.shape();
  std::vector<double> others = node.gram;
  for (std::size_t k = 0; k < others.size(); ++k) others[k] -= node.held_out[k];
  const auto enough = static_cast<double>(2 * shape.coefficients());
  if (!(node.held_out[0] >= enough && others[0] >= enough)) return std::nan("");
  int rank = 0;
  const Eigen::VectorXd change = solve(shape, others.data(), 0.0, rank);
  const double unit = data.scale(data.inputs());
  return unit * unit * remaining(shape, node.held_out.data(), change) / node.held_out[0];
}

// Takes a split back if the node's own linear model has no larger held-out error than what lies below. Children stand
// behind their parents.
void prune(StateData& data) {
  std::vector<double> square(data.nodes.size());
  for (std::size_t at = data.nodes.size(); at-- > 0;) {
    TopNode& node = data.nodes[at];
    if (node.fate == Fate::done) {
      square[at] = node.held_out_rmse * node.held_out_rmse;
      continue;
    }
    square[at] = held_out_square(data, node);
    if (node.fate == Fate::inner) {
      const auto weighted = [&](Eigen::Index child) { return data.nodes[child].weight * square[child] / node.weight; };
      const double below = weighted(node.left) + weighted(node.right);
      if (square[at] <= below) {
        node.fate = Fate::leaf;
      } else {
        square[at] = below;
      }
    }
    node.held_out_rmse = std::sqrt(square[at]);
  }
}

// The nodes that are left, in order of growth, and the positions that they had.
void keep_reachable(StateData& data) {
  std::vector<TopNode> kept = {std::move(data.nodes[0])};
  for (std::size_t at = 0; at < kept.size(); ++at) {
    if (kept[at].fate != Fate::inner) continue;
    const Eigen::Index left = kept[at].left;
    kept[at].left = std::ssize(kept);
    kept[at].right = kept[at].left + 1;
    TopNode first = std::move(data.nodes[left]);
    TopNode second = std::move(data.nodes[left + 1]);
    kept.push_back(std::move(first));
    kept.push_back(std::move(second));
  }
  data.nodes = std::move(kept);
}

}  // namespace

void take_branches(StateData& data, std::map<Eigen::Index, BranchRows> rows, const Progress& progress,
                   int max_threads) {
  const bool is_all = data.nodes.size() == 1;
  Work work(progress);
  for (const Eigen::Index at : data.asked) {
    TopNode& node = data.nodes[at];
    TrainingData branch = data_of(data, node, std::move(rows[at]));
    FitOptions options = branch_options(data.options, max_threads);
    branch.may_have_codes = is_all && data.options.may_have_codes != 0;
    if (!is_all) {
      options.intervals = false;
      options.choose_inputs = false;
    }
    Work part(work, 1.0 / static_cast<double>(data.asked.size()));
    const FitResult result =
        fit(PreparedFit(std::make_shared<const TrainingData>(std::move(branch)), options), part.progress());
    node.branch = to_text(to_json(result.model, result.intervals));
    node.held_out_rmse = result.summary.partitions.front().chosen.rmse;
    node.fate = Fate::done;
  }
  work.finish();
}

void finish(StateData& data) {
  if (data.nodes.size() == 1 && data.nodes[0].fate == Fate::done) {
    data.model = data.nodes[0].branch;
    return;
  }
  prune(data);
  keep_reachable(data);
  data.model = to_text(to_json(assemble(data)));
}

State advance(const State& state, Sums sums, const Progress& progress, int max_threads) {
  StateData data = state.data();
  const auto refuse = [](const std::string& why) { throw std::invalid_argument("llmt::distributed::advance: " + why); };
  if (data.step == Step::finished) refuse("the fit is finished");
  SumsData* const given = sums.data();
  if (given == nullptr || given->runs.empty())
    throw std::runtime_error("llmt::distributed::advance: there are no rows");
  if (given->mark != data.mark) refuse("the sums belong to another state");
  Eigen::Index next = 0;
  for (const Run& run : given->runs) {
    if (run.first > next) refuse(fmt::format("blocks {} to {} are missing", next, run.first - 1));
    next = run.last;
  }
  if (data.blocks > 0 && next != data.blocks) {
    refuse(fmt::format("there are {} blocks, the first pass had {}", next, data.blocks));
  }
  BlockSum total = std::move(given->runs.front().sums).total(next);
  sums = Sums();
  if (data.passes == 0) data.fingerprint = total.fingerprint;
  if (data.fingerprint != total.fingerprint) {
    throw std::runtime_error("llmt::distributed::advance: the rows are not those of the first pass: the table changed");
  }
  data.blocks = next;
  ++data.passes;
  // Before the root's model is known, its residuals have no range.
  const bool has_root_model =
      data.step != Step::describe && data.step != Step::blend && data.nodes.front().fate == Fate::inner;
  if (has_root_model) data.root_residual = total.root_residual;
  if (data.step == Step::describe) {
    take_description(data, total.description);
    if (data.rows > data.options.branch_rows) take_sample(data, total.description.sample, progress, max_threads);
  }
  if (data.step == Step::grow) take_nodes(data, std::move(total.nodes));
  if (data.step == Step::gather) take_branches(data, std::move(total.branches), progress, max_threads);
  if (data.step == Step::blend) {
    take_joint(data, std::move(total.joint));
    data.step = Step::finished;
    return finish_state(std::move(data));
  }
  ask(data);
  if (data.step == Step::finished) {
    finish(data);
    if (!data.sample_model.empty()) data.step = Step::blend;
  }
  return finish_state(std::move(data));
}

}  // namespace llmt::distributed
