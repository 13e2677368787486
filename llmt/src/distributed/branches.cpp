// Branches that fit() finishes, and the model of top and branches.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <stdexcept>

#include "distributed/growth.hpp"
#include "estimation/estimate.hpp"
#include "estimation/leaf_statistics.hpp"
#include "llmt/fit.hpp"
#include "llmt/intervals.hpp"
#include "numerics/gram.hpp"
#include "stream/sums.hpp"

namespace llmt::distributed {
namespace {

std::vector<std::string> names_of(const std::vector<Text>& texts) {
  std::vector<std::string> names;
  for (const Text& text : texts) names.push_back(to_string(text));
  return names;
}

// The rows of a branch as fit() takes them. Pieces are freed on the way.
TrainingData data_of(const StateData& data, const TopNode& node, BranchRows rows) {
  TrainingData result;
  const Eigen::Index inputs = data.inputs();
  result.inputs.resize(node.rows, inputs);
  result.outputs.resize(node.rows, 1);
  Eigen::Index next = 0;
  for (std::vector<double>& piece : rows.pieces) {
    const Eigen::Index count = std::ssize(piece) / (inputs + 1);
    if (count > node.rows - next) break;
    using RowMajorMatrix = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
    const Eigen::Map<const RowMajorMatrix> values(piece.data(), count, inputs + 1);
    result.inputs.middleRows(next, count) = values.leftCols(inputs);
    result.outputs.middleRows(next, count) = values.rightCols(1);
    next += count;
    std::vector<double>().swap(piece);
  }
  if (next != node.rows) {
    throw std::runtime_error(fmt::format(
        "llmt::distributed::advance: a branch has not the {} rows that it had: the table changed", node.rows));
  }
  result.input_names = names_of(data.input_names);
  result.output_names = {to_string(data.output_name)};
  return result;
}

// A node of the top with the local model of its sums.
Node node_of_sums(const StateData& data, const TopNode& from) {
  const Eigen::Index inputs = data.inputs();
  const GramShape shape = data.shape();
  const Eigen::VectorXd scale = data.scale.head(inputs);
  const double unit = data.scale(inputs);
  Node node;
  const Eigen::VectorXd model = model_of(data, from, node.rank);
  const Eigen::VectorXd change = model - from.base;
  node.samples = from.rows;
  node.rss = Eigen::VectorXd::Constant(1, unit * unit * remaining(shape, from.gram.data(), change));
  node.value = Eigen::VectorXd::Constant(1, data.mean(inputs) + unit * model(0));
  node.slope = (unit * model.tail(inputs).cwiseQuotient(scale)).transpose();
  node.mean.resize(inputs);
  for (Eigen::Index k = 0; k < inputs; ++k) {
    node.mean(k) = scale(k) * std::clamp(from.gram[shape.at(k + 1, 0)] / from.gram[0], from.low(k), from.high(k));
  }
  node.low = scale.cwiseProduct(from.low);
  node.high = scale.cwiseProduct(from.high);
  if (from.fate == Fate::inner) {
    node.split_input = static_cast<int>(from.input);
    node.threshold = from.threshold;
  } else {
    const Eigen::MatrixXd gram = matrix_of(shape, from.gram.data()).topLeftCorner(inputs + 1, inputs + 1);
    // A regressor that does not vary is 0 in all rows.
    const Eigen::VectorXd roots = (gram.diagonal().array() > 0.0).select(gram.diagonal(), gram(0, 0)).cwiseSqrt();
    Eigen::VectorXd units(inputs + 1);
    units << 1.0, scale.cwiseInverse();
    node.inverse_gram = units.asDiagonal() * inverse_gram(gram, roots) * units.asDiagonal();
  }
  return node;
}

// The nodes of a branch's model about the means of the whole table: deviations of the branch are those of the table
// plus `shift`.
void append_branch(const StateData& data, const Model& model, std::size_t root, std::vector<Node>& nodes) {
  const Eigen::Index inputs = data.inputs();
  const std::vector<Regressor>& regressors = model.regressors();
  const Eigen::Index own = std::ssize(regressors);
  const int offset = static_cast<int>(nodes.size()) - 1;  // node k > 0 of the branch becomes k + offset
  const std::vector<Node>& branch = model.partitions().front().nodes;
  for (std::size_t k = 0; k < branch.size(); ++k) {
    Node node = branch[k];
    const Node from = node;
    node.slope = Eigen::MatrixXd::Zero(1, inputs);
    node.mean = node.low = node.high = Eigen::VectorXd::Zero(inputs);
    Eigen::MatrixXd change = Eigen::MatrixXd::Zero(own + 1, inputs + 1);  // [1, deviations] of the branch
    change(0, 0) = 1.0;
    for (Eigen::Index r = 0; r < own; ++r) {
      const int input = regressors[r].input;
      const double shift = regressors[r].centre - data.mean(input);
      node.value(0) -= from.slope(0, r) * shift;
      node.slope(0, input) = from.slope(0, r);
      node.mean(input) = from.mean(r) + shift;
      node.low(input) = from.low(r) + shift;
      node.high(input) = from.high(r) + shift;
      change(r + 1, 0) = -shift;
      change(r + 1, input + 1) = 1.0;
    }
    if (from.inverse_gram.size() > 0) node.inverse_gram = change.transpose() * from.inverse_gram * change;
    if (!node.is_leaf()) {
      node.left += offset;
      node.right += offset;
    }
    if (k == 0) {
      nodes[root] = std::move(node);
    } else {
      nodes.push_back(std::move(node));
    }
  }
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
      const auto weighted = [&](Eigen::Index child) {
        return static_cast<double>(data.nodes[child].rows) * square[child] / static_cast<double>(node.rows);
      };
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

Model assemble(const StateData& data) {
  const Eigen::Index inputs = data.inputs();
  std::vector<InputColumn> columns;
  std::vector<Regressor> regressors;
  for (Eigen::Index j = 0; j < inputs; ++j) {
    columns.push_back({.name = to_string(data.input_names[j]),
                       .low = data.range[j].low,
                       .high = data.range[j].high,
                       .centre = data.mean(j)});
    regressors.push_back({.input = static_cast<int>(j), .centre = data.mean(j)});
  }
  Partition partition;
  partition.outputs = {0};
  partition.nodes.resize(data.nodes.size());
  for (std::size_t at = 0; at < data.nodes.size(); ++at) {
    const TopNode& from = data.nodes[at];
    if (from.fate == Fate::done) {
      const Model branch = from_json(to_string(from.branch), "a branch");
      const Validity validity = branch.partitions().front().validity;
      if (validity.kind != ValidityKind::crisp) {
        partition.validity = {validity.kind, std::max(partition.validity.width, validity.width)};
      }
      append_branch(data, branch, at, partition.nodes);
      continue;
    }
    partition.nodes[at] = node_of_sums(data, from);
    if (from.fate == Fate::inner) {
      partition.nodes[at].left = static_cast<int>(from.left);
      partition.nodes[at].right = static_cast<int>(from.right);
      const double rows = static_cast<double>(data.nodes[from.left].rows);
      partition.nodes[at].missing_left = rows / static_cast<double>(from.rows);
    }
  }
  partition.outer_slope = agreed_slope(partition);
  if (data.root_residual.low <= data.root_residual.high) {
    partition.residual_range = Eigen::RowVector2d(data.root_residual.low, data.root_residual.high);
  }
  const Extent& range = data.range[inputs];
  return Model(std::move(columns), {{to_string(data.output_name), range.low, range.high}}, std::move(regressors),
               {std::move(partition)});
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
    if (!is_all) {
      options.intervals = false;
      options.choose_inputs = false;
      branch.may_have_codes = false;
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
  data.blocks = next;
  ++data.passes;
  // Before the root's model is known, its residuals have no range.
  const bool has_root_model = data.step != Step::describe && data.nodes.front().fate == Fate::inner;
  if (has_root_model) data.root_residual = total.root_residual;
  if (data.step == Step::describe) take_description(data, std::move(total.description));
  if (data.step == Step::grow) take_nodes(data, std::move(total.nodes));
  if (data.step == Step::gather) take_branches(data, std::move(total.branches), progress, max_threads);
  ask(data);
  if (data.step == Step::finished) finish(data);
  return finish_state(std::move(data));
}

}  // namespace llmt::distributed
