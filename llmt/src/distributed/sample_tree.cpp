#include "distributed/sample_tree.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>
#include <stdexcept>
#include <utility>

#include "distributed/top_model.hpp"
#include "llmt/fit.hpp"
#include "partition/leaf_validities.hpp"
#include "stream/sums.hpp"

namespace llmt::distributed {
namespace {

// The ridge of the joint equations, as a multiple of their diagonal: for directions that no row determines.
constexpr double joint_ridge = 1e-6;

const Partition& tree_of(const StateData& data) { return data.sample->partitions().front(); }

// [1, z] of the regressors of the sample's model at a row, in the scales of the table.
class ScaledRow {
 public:
  explicit ScaledRow(const StateData& data) : data_(data), features_(1 + std::ssize(data.sample->regressors())) {
    features_(0) = 1.0;
  }

  const Eigen::VectorXd& of(const Eigen::VectorXd& inputs) {
    const std::vector<Regressor>& regressors = data_.sample->regressors();
    for (Eigen::Index r = 0; r < std::ssize(regressors); ++r) {
      const Regressor& from = regressors[r];
      const double x = inputs(from.input);
      const double value = from.level < 0 ? x : (x == static_cast<double>(from.level) ? 1.0 : 0.0);
      features_(r + 1) = (value - from.centre) / scale_of(data_, from);
    }
    return features_;
  }

  static double scale_of(const StateData& data, const Regressor& regressor) {
    return regressor.level < 0 ? data.scale(regressor.input) : 1.0;
  }

 private:
  const StateData& data_;
  Eigen::VectorXd features_;
};

// Of each node the place of its leaf among the leaves; -1: an inner node.
std::vector<Eigen::Index> leaf_places(const Partition& tree) {
  std::vector<Eigen::Index> places;
  Eigen::Index next = 0;
  for (const Node& node : tree.nodes) places.push_back(node.is_leaf() ? next++ : -1);
  return places;
}

// Squares of the residuals after a change of the coefficients.
double squares_after(const Eigen::MatrixXd& gram, const Eigen::VectorXd& change) {
  const Eigen::Index count = change.size();
  const auto products = gram.topLeftCorner(count, count).selfadjointView<Eigen::Lower>();
  const double squares =
      gram(count, count) - 2.0 * gram.row(count).head(count).dot(change) + change.dot((products * change).eval());
  return std::max(squares, 0.0);
}

Eigen::VectorXd solve_joint(const Eigen::MatrixXd& gram) {
  const Eigen::Index count = gram.rows() - 1;
  Eigen::MatrixXd equations = gram.topLeftCorner(count, count);
  for (Eigen::Index k = 0; k < count; ++k) {
    const double own = equations(k, k);
    equations(k, k) = own > 0.0 ? own * (1.0 + joint_ridge) : 1.0;  // what does not vary does not change
  }
  return equations.selfadjointView<Eigen::Lower>().ldlt().solve(gram.row(count).head(count).transpose());
}

// Akaike's final prediction error (1970): the error on new rows of a model that has `count` coefficients.
double expected_error(double squares, double rows, double count) {
  return count < rows ? squares / rows * (rows + count) / (rows - count) : std::numeric_limits<double>::infinity();
}

// The coefficients of a tree; its splits, each chosen among m, count as log m (Foster & George 1994).
double count_of(const StateData& data, const Partition& tree, Eigen::Index coefficients) {
  const double of_split = std::log(static_cast<double>(first_bins(data).back()));
  return static_cast<double>(coefficients) + of_split * static_cast<double>(tree.num_leaves() - 1);
}

double count_of(const StateData& data, const Partition& tree) {
  Eigen::Index coefficients = 0;
  for (const Node& node : tree.nodes) coefficients += node.is_leaf() ? node.rank : 0;
  return count_of(data, tree, coefficients);
}

// What the nodes say of the rows in their boxes.
void describe_nodes(const StateData& data, const JointSums& sums, Partition& tree) {
  const std::vector<Eigen::Index> places = leaf_places(tree);
  const double unit = data.scale(data.inputs());
  for (std::size_t at = tree.nodes.size(); at-- > 0;) {  // children behind their parents
    Node& node = tree.nodes[at];
    const Eigen::Index before = node.samples;
    if (node.is_leaf()) {
      node.samples = sums.leaf_rows[places[at]];
      node.rss = Eigen::VectorXd::Constant(1, unit * unit * sums.leaf_squares[places[at]]);
      const double more = static_cast<double>(std::max<Eigen::Index>(node.samples, 1)) /
                          static_cast<double>(std::max<Eigen::Index>(before, 1));
      node.inverse_gram /= std::max(more, 1.0);
    } else {
      node.samples = tree.nodes[node.left].samples + tree.nodes[node.right].samples;
      node.rss *= static_cast<double>(node.samples) / static_cast<double>(std::max<Eigen::Index>(before, 1));
    }
  }
}

// The sample's model with the fitted coefficients, and the ranges of all rows.
Model joined(const StateData& data, const JointSums& sums, const Eigen::VectorXd& change) {
  const Model& sample = *data.sample;
  Partition tree = tree_of(data);
  const std::vector<Regressor>& regressors = sample.regressors();
  const Eigen::Index each = 1 + std::ssize(regressors);
  const double unit = data.scale(data.inputs());
  const std::vector<Eigen::Index> places = leaf_places(tree);
  for (std::size_t at = 0; at < tree.nodes.size(); ++at) {
    Node& node = tree.nodes[at];
    if (!node.level_side.empty()) node.level_side.resize(data.levels[node.split_input].size(), 0);
    if (!node.is_leaf()) continue;
    const auto own = change.segment(places[at] * each, each);
    node.value(0) += unit * own(0);
    for (Eigen::Index r = 0; r + 1 < each; ++r) {
      node.slope(0, r) += unit * own(r + 1) / ScaledRow::scale_of(data, regressors[r]);
    }
  }
  describe_nodes(data, sums, tree);
  const Extent& range = data.range[data.inputs()];
  if (tree.residual_range.size() > 0) {
    tree.residual_range = Eigen::RowVector2d(sums.root_residual.low, sums.root_residual.high);
  }
  if (tree.output_range.size() > 0 && std::isfinite(tree.output_range(0, 0))) {
    tree.output_range = Eigen::RowVector2d(range.low, range.high);
  }
  std::vector<InputColumn> inputs = sample.inputs();
  for (std::size_t j = 0; j < inputs.size(); ++j) {
    inputs[j].low = data.range[j].low;
    inputs[j].high = data.range[j].high;
    inputs[j].levels = to_strings(data.levels[j]);
  }
  return Model(std::move(inputs), {{to_string(data.output_name), range.low, range.high}}, regressors,
               {std::move(tree)});
}

// Puts the linear model of the root in place of top and branches if that is expected to predict no worse.
void take_root(StateData& data, JointSums& sums) {
  TopNode& root = data.nodes.front();
  if (root.fate != Fate::inner) return;
  int rank = 0;
  const Eigen::VectorXd change = solve(data.shape(), root.gram.data(), 0.0, rank);
  const double squares = remaining(data.shape(), root.gram.data(), change);
  const double error = expected_error(squares, data.weight, rank);
  const double of_tree = count_of(data, data.result->partitions().front());
  if (error > expected_error(sums.tree_squares, data.weight, of_tree)) return;
  root.fate = Fate::leaf;
  root.held_out_rmse = data.scale(data.inputs()) * std::sqrt(error);
  data.nodes.resize(1);
  data.result = assemble(data);
  data.model = to_text(to_json(*data.result));
  sums.tree_squares = squares;
}

}  // namespace

void take_sample(StateData& data, const Sample& sample, const Progress& progress, int max_threads) {
  const Eigen::Index rows = std::ssize(sample.hashes);
  const Eigen::Index columns = data.row_columns();
  using RowMajorMatrix = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
  const Eigen::Map<const RowMajorMatrix> values(sample.values.data(), rows, columns);
  TrainingData rows_of_sample{.inputs = values.leftCols(data.inputs()), .outputs = values.col(data.inputs())};
  if (data.is_weighted()) rows_of_sample.weights = data.weight_scale * values.col(data.inputs() + 1);
  for (const std::vector<Text>& levels : data.levels) rows_of_sample.levels.push_back(to_strings(levels));
  rows_of_sample.input_names = to_strings(data.input_names);
  rows_of_sample.output_names = {to_string(data.output_name)};
  rows_of_sample.may_have_codes = false;
  FitOptions options = branch_options(data.options, max_threads);
  options.intervals = false;
  const FitResult result =
      fit(PreparedFit(std::make_shared<const TrainingData>(std::move(rows_of_sample)), options), progress);
  data.sample = result.model;
  if (unknowns_of(data) <= most_unknowns) {
    data.sample_model = to_text(to_json(result.model));
  }
  data.sample.reset();  // finish_state() reads it where it is needed
}

void add_joint(const StateData& data, const Block& block, JointSums& sums) {
  const Partition& tree = tree_of(data);
  const LeafValidities validities(tree, data.sample->inputs());
  const std::vector<Eigen::Index> places = leaf_places(tree);
  const Eigen::Index count = block.span.count();
  const Eigen::MatrixXd rows = block.rows.inputs.middleRows(block.span.begin, count);
  const double unit = data.scale(data.inputs());
  const auto residuals_of = [&](const Model& model) -> Eigen::VectorXd {
    return (block.rows.output.segment(block.span.begin, count) - model.predict(rows, 1).col(0)) / unit;
  };
  const Eigen::VectorXd residuals = residuals_of(*data.sample);
  const Eigen::VectorXd of_tree = residuals_of(*data.result);
  ScaledRow scaled(data);
  const Eigen::Index each = 1 + std::ssize(data.sample->regressors());
  const Eigen::Index unknowns = unknowns_of(data);
  sums.gram = Eigen::MatrixXd::Zero(unknowns + 1, unknowns + 1);
  sums.leaf_rows.assign(tree.num_leaves(), 0);
  sums.leaf_squares.assign(tree.num_leaves(), 0.0);
  std::vector<Activation> active;
  const Node& root = tree.nodes.front();
  for (Eigen::Index i = 0; i < count; ++i) {
    const Eigen::Index row = block.span.begin + i;
    if (block.weight(row) == 0.0) continue;
    const double weight = data.weight_scale * block.weight(row);
    const Eigen::VectorXd inputs = rows.row(i).transpose();
    const Eigen::VectorXd& z = scaled.of(inputs);
    double of_root = root.value(0);
    for (Eigen::Index r = 0; r + 1 < each; ++r) {
      of_root += root.slope(0, r) * z(r + 1) * ScaledRow::scale_of(data, data.sample->regressors()[r]);
    }
    sums.root_residual.widen(block.rows.output(row) - of_root);
    validities.activate(inputs.data(), active);
    const double residual = residuals(i);
    for (const Activation& one : active) {
      const Eigen::Index begin = places[one.node] * each;
      for (const Activation& other : active) {
        if (places[other.node] > places[one.node]) continue;
        sums.gram.block(begin, places[other.node] * each, each, each).noalias() +=
            (weight * one.validity * other.validity) * z * z.transpose();
      }
      sums.gram.row(unknowns).segment(begin, each) += (weight * one.validity * residual) * z.transpose();
    }
    sums.gram(unknowns, unknowns) += weight * residual * residual;
    sums.tree_squares += weight * of_tree(i) * of_tree(i);
    int leaf = 0;
    while (validities.left(leaf) >= 0) leaf = validities.child_of(leaf, inputs.data());
    ++sums.leaf_rows[places[leaf]];
    sums.leaf_squares[places[leaf]] += weight * residual * residual;
  }
}

void take_joint(StateData& data, JointSums sums) {
  if (std::ssize(sums.leaf_rows) != tree_of(data).num_leaves()) {
    throw std::runtime_error("llmt::distributed::advance: the sums have not the leaves of the sample's tree");
  }
  take_root(data, sums);
  const Eigen::VectorXd change = solve_joint(sums.gram);
  const double own = count_of(data, tree_of(data), unknowns_of(data));
  const double error = expected_error(squares_after(sums.gram, change), data.weight, own);
  const double of_other = count_of(data, data.result->partitions().front());
  if (change.allFinite() && error < expected_error(sums.tree_squares, data.weight, of_other)) {
    data.model = to_text(to_json(joined(data, sums, change)));
    data.is_blended = 1;
    data.sample_rmse = data.scale(data.inputs()) * std::sqrt(error);
  }
  data.sample_model.clear();
  data.sample.reset();
  data.result.reset();
}

}  // namespace llmt::distributed
