#include "growth/hilomot/hilomot.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>
#include <optional>

#include "base/count.hpp"
#include "growth/growth_data.hpp"
#include "growth/hilomot/cut.hpp"
#include "growth/worst_first.hpp"
#include "numerics/aicc.hpp"
#include "numerics/node_fit.hpp"

namespace llmt {
namespace {

// Rows with less validity than this take no part in growth below.
constexpr double least_child_validity = 1e-5;

// Least squares weighted with the leaf's validity, as a correction of the parent's model.
Node local_model(const GrowthData& data, const HilomotInputs& inputs, const HilomotLeaf& leaf, const Node& parent) {
  const RowMajor x = inputs.deviations(leaf.rows, Eigen::all);
  const Eigen::MatrixXd residuals = (data.outputs(leaf.rows, Eigen::all) - x * parent.slope.transpose()).rowwise() -
                                    Eigen::RowVectorXd(parent.value.transpose());
  const NodeFit fitted = fit_node(x, residuals, leaf.validity.cwiseProduct(data.weights(leaf.rows)));
  Node node;
  node.rank = fitted.rank;
  node.rss = fitted.rss;
  node.value = parent.value + fitted.centre_change;
  node.slope = parent.slope + fitted.slope_change;
  node.mean = Eigen::VectorXd::Zero(inputs.deviations.cols());
  node.low = fitted.low;
  node.high = fitted.high;
  return node;
}

// In the leaf's rows, rows x outputs.
Eigen::MatrixXd predictions(const HilomotInputs& inputs, const HilomotLeaf& leaf, const Node& model) {
  return (inputs.deviations(leaf.rows, Eigen::all) * model.slope.transpose()).rowwise() +
         Eigen::RowVectorXd(model.value.transpose());
}

// The rows of a leaf where a child's validity, one entry per row of the leaf, is not negligible.
HilomotLeaf child_of(const HilomotLeaf& leaf, const Eigen::VectorXd& validity) {
  HilomotLeaf child;
  std::vector<double> kept;
  for (std::size_t i = 0; i < leaf.rows.size(); ++i) {
    if (const double here = validity(i); here > least_child_validity) {
      child.rows.push_back(leaf.rows[i]);
      kept.push_back(here);
    }
  }
  child.validity = Eigen::Map<const Eigen::VectorXd>(kept.data(), std::ssize(kept));
  return child;
}

// Writes a cut into a node: a plane in the inputs' units (docs/algorithms/hilomot.md, H.1), or sets of levels.
void set_split(const HilomotInputs& inputs, Eigen::Index columns, const HilomotCut& cut, Node& node) {
  if (cut.normal.size() == 0) {
    node.split_input = cut.input;
    node.level_side = cut.level_side;
    node.missing_left = cut.missing_left;
    return;
  }
  node.direction = Eigen::VectorXd::Zero(columns);
  double largest = 0.0;
  for (std::size_t k = 0; k < inputs.numeric.size(); ++k) {
    const double weight = cut.normal(k);
    node.direction(inputs.numeric[k]) = weight / inputs.spreads[k];
    if (std::abs(weight) > largest) {
      largest = std::abs(weight);
      node.split_input = inputs.numeric[k];
    }
  }
  node.threshold = cut.threshold;
  node.half_width = cut.half_width;
}

class HilomotTree {
 public:
  HilomotTree(const GrowthProblem& problem, const HilomotOptions& options)
      : data_(problem), options_(options), inputs_(data_), leaf_of_row_(data_.training.count(), 0) {}

  void open_root();

  // split_worst_first() calls these.
  Eigen::Index num_leaves() const { return std::ssize(leaves_); }
  bool is_exact() const;
  double aicc() const;
  bool split_worst();

  Eigen::Index evaluations() const { return evaluations_; }  // gates that were tried

  // The nodes of the first leaves, in the outputs' units.
  std::vector<Node> nodes(Eigen::Index leaves) const;

 private:
  double local_loss(const HilomotLeaf& leaf) const;
  void describe(HilomotLeaf& leaf) const;
  void split(HilomotLeaf& leaf, const HilomotCut& cut);
  Eigen::Index send_rows_down(const HilomotLeaf& leaf, const HilomotCut& cut, int left);

  GrowthData data_;
  HilomotOptions options_;
  HilomotInputs inputs_;
  std::vector<Node> nodes_;  // in scaled outputs
  std::vector<HilomotLeaf> leaves_;
  Eigen::MatrixXd predicted_;     // of the whole model, rows x outputs
  std::vector<int> leaf_of_row_;  // node of the leaf on whose side of all planes a row lies
  Eigen::Index evaluations_ = 0;
};

void HilomotTree::open_root() {
  HilomotLeaf root;
  root.rows.resize(leaf_of_row_.size());
  std::iota(root.rows.begin(), root.rows.end(), 0);
  root.validity = Eigen::VectorXd::Ones(std::ssize(root.rows));
  Node parentless;
  parentless.value = Eigen::VectorXd::Zero(data_.outputs.cols());
  parentless.slope = Eigen::MatrixXd::Zero(data_.outputs.cols(), inputs_.deviations.cols());
  nodes_ = {local_model(data_, inputs_, root, parentless)};
  nodes_[0].samples = data_.training.count();
  predicted_ = predictions(inputs_, root, nodes_[0]);
  describe(root);
  leaves_ = {std::move(root)};
}

bool HilomotTree::is_exact() const {
  const Eigen::RowVectorXd squares = data_.weights.transpose() * (data_.outputs - predicted_).cwiseAbs2();
  return (squares.transpose().array() <= data_.total_weight * data_.rounding.array().square()).all();
}

double HilomotTree::aicc() const {
  const double outputs = static_cast<double>(data_.outputs.cols());
  double effective = 0.0;
  for (const HilomotLeaf& leaf : leaves_) {
    effective += outputs * leaf.effective;
  }
  // The weights of the directions are fitted too.
  for (const Node& node : nodes_) {
    effective += static_cast<double>((node.direction.array() != 0.0).count());
  }
  const double loss = data_.weights.dot((data_.outputs - predicted_).cwiseAbs2() * data_.output_weights);
  return llmt::aicc(data_.total_weight * outputs, std::max(loss, least_loss * outputs), effective);
}

// Weighted squared error of the whole model where the leaf is valid, all outputs.
double HilomotTree::local_loss(const HilomotLeaf& leaf) const {
  const Eigen::MatrixXd error = data_.outputs(leaf.rows, Eigen::all) - predicted_(leaf.rows, Eigen::all);
  const Eigen::VectorXd of_row = data_.weights(leaf.rows).cwiseProduct(error.cwiseAbs2() * data_.output_weights);
  return leaf.validity.dot(of_row);
}

void HilomotTree::describe(HilomotLeaf& leaf) const {
  if (!options_.stop_by_aicc) return;
  leaf.effective =
      effective_parameters(inputs_.deviations(leaf.rows, Eigen::all), data_.weights(leaf.rows), leaf.validity);
}

bool HilomotTree::split_worst() {
  while (true) {
    HilomotLeaf* worst = nullptr;
    double largest = 0.0;
    for (HilomotLeaf& leaf : leaves_) {
      if (!leaf.splittable) continue;
      const double loss = local_loss(leaf);
      if (worst == nullptr || loss > largest) {
        worst = &leaf;
        largest = loss;
      }
    }
    if (worst == nullptr) return false;
    const std::optional<HilomotCut> cut = best_cut(data_, inputs_, *worst, options_.models, evaluations_);
    data_.problem.searched(std::ssize(worst->rows));
    if (cut) {
      split(*worst, *cut);
      return true;
    }
    worst->splittable = false;
  }
}

void HilomotTree::split(HilomotLeaf& leaf, const HilomotCut& cut) {
  Node& parent = nodes_[leaf.node];
  parent.left = count_of(nodes_);
  parent.right = parent.left + 1;
  set_split(inputs_, std::ssize(data_.training.columns), cut, parent);
  const Eigen::Index on_left = send_rows_down(leaf, cut, parent.left);
  const std::array<Eigen::VectorXd, 2> shares = {cut.share, 1.0 - cut.share.array()};
  const Eigen::MatrixXd before = predictions(inputs_, leaf, parent);
  Eigen::MatrixXd change = -(leaf.validity.asDiagonal() * before);
  std::array<HilomotLeaf, 2> children;
  std::array<Node, 2> models;
  for (std::size_t side = 0; side < 2; ++side) {
    const Eigen::VectorXd validity = leaf.validity.cwiseProduct(shares[side]);
    children[side] = child_of(leaf, validity);
    children[side].node = side == 0 ? parent.left : parent.right;
    children[side].normal = cut.normal;
    models[side] = local_model(data_, inputs_, children[side], parent);
    models[side].samples = side == 0 ? on_left : parent.samples - on_left;
    change += validity.asDiagonal() * predictions(inputs_, leaf, models[side]);
    describe(children[side]);
  }
  predicted_(leaf.rows, Eigen::all) += change;
  nodes_.push_back(std::move(models[0]));
  nodes_.push_back(std::move(models[1]));
  leaf = std::move(children[0]);
  leaves_.push_back(std::move(children[1]));
}

// Moves the rows in the leaf's part of the space to the two children, nodes `left` and `left` + 1. Returns the number
// of rows on the left.
Eigen::Index HilomotTree::send_rows_down(const HilomotLeaf& leaf, const HilomotCut& cut, int left) {
  Eigen::Index on_left = 0;
  for (std::size_t i = 0; i < leaf.rows.size(); ++i) {
    int& of_row = leaf_of_row_[leaf.rows[i]];
    if (of_row != leaf.node) continue;
    const bool goes_left = cut.share(i) >= 0.5;
    of_row = goes_left ? left : left + 1;
    if (goes_left) ++on_left;
  }
  return on_left;
}

std::vector<Node> HilomotTree::nodes(Eigen::Index leaves) const {
  std::vector<Node> result = prefix(Partition{.outputs = {}, .nodes = nodes_}, leaves).nodes;
  for (Node& node : result) {
    node.value = data_.output_mean + data_.output_scale.cwiseProduct(node.value);
    node.slope = data_.output_scale.asDiagonal() * node.slope;
    node.rss = data_.output_scale.cwiseAbs2().cwiseProduct(node.rss);
  }
  return result;
}

}  // namespace

GrownPartition grow_hilomot(const GrowthProblem& problem, const HilomotOptions& hilomot) {
  HilomotTree tree(problem, hilomot);
  tree.open_root();
  const GrowthEnd end = split_worst_first(tree, problem.options.max_leaves, hilomot.stop_by_aicc);
  return {tree.nodes(end.leaves), end.stop, {.exact_nodes = 0, .evaluations = tree.evaluations()}};
}

}  // namespace llmt
