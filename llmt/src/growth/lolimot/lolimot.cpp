#include "growth/lolimot/lolimot.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

#include "base/count.hpp"
#include "base/parallel.hpp"
#include "constraints/signs.hpp"
#include "growth/gain_order.hpp"
#include "growth/lolimot/boxes.hpp"
#include "growth/worst_first.hpp"
#include "numerics/aicc.hpp"
#include "numerics/node_fit.hpp"

namespace llmt {
namespace {

// Rows with less validity than this take no part in a local estimate.
constexpr double least_local_validity = 1e-9;

// A local model with its box.
struct LocalModel {
  int node = 0;
  Box box;
  Eigen::VectorXd mu;           // validity function before normalisation, one per row
  Eigen::MatrixXd predictions;  // rows x outputs
  Node model;                   // value, slope, rank, rss, samples
  bool splittable = true;
};

// A cut of a box, with the local models of its two halves.
struct Split {
  double loss = std::numeric_limits<double>::infinity();  // of the whole model; infinite: the cut is not admissible
  double threshold = 0.0;
  LocalModel left;
  LocalModel right;
};

// Sums over the local models.
struct WholeModel {
  Eigen::VectorXd mu;         // sum of the validity functions, one per row
  Eigen::MatrixXd numerator;  // sum of validity function times prediction, rows x outputs
};

// Weighted squared error of every row, all outputs.
Eigen::VectorXd squared_errors(const LolimotData& data, const WholeModel& whole) {
  const Eigen::MatrixXd error = data.outputs - whole.mu.cwiseInverse().asDiagonal() * whole.numerator;
  return data.weights.cwiseProduct(error.cwiseAbs2() * data.output_weights);
}

// Weighted least squares with the validities of the local model as weights, as a correction of the parent's model.
void fit(const LolimotData& data, const Node& parent, const Eigen::VectorXd& validity, LocalModel& model) {
  std::vector<int> rows;
  for (int i = 0; i < validity.size(); ++i) {
    if (validity(i) > least_local_validity) rows.push_back(i);
  }
  const Eigen::MatrixXd x = data.deviations(rows, Eigen::all);
  const Eigen::MatrixXd residuals = (data.outputs(rows, Eigen::all) - x * parent.slope.transpose()).rowwise() -
                                    Eigen::RowVectorXd(parent.value.transpose());
  const Eigen::VectorXd weights = validity(rows).cwiseProduct(data.weights(rows));
  const NodeFit fitted = fit_node(x, residuals, weights);
  Node& node = model.model;
  node.rank = fitted.rank;
  node.rss = fitted.rss;
  node.value = parent.value + fitted.centre_change;
  node.slope = parent.slope + fitted.slope_change;
  if (!data.signs.empty()) keep_signs(data.signs, x, weights, node);
  node.mean = Eigen::VectorXd::Zero(data.deviations.cols());
  node.low = data.deviations.colwise().minCoeff().transpose();
  node.high = data.deviations.colwise().maxCoeff().transpose();
  model.predictions = (data.deviations * node.slope.transpose()).rowwise() + Eigen::RowVectorXd(node.value.transpose());
}

class LolimotTree {
 public:
  LolimotTree(const GrowthProblem& problem, const LolimotOptions& options)
      : data_(problem), options_(options), extent_{options.low, options.high} {}

  void open_root();

  // split_worst_first() calls these.
  Eigen::Index num_leaves() const { return std::ssize(models_); }
  bool is_exact() const { return loss() <= least_loss_; }
  double aicc() const;
  bool split_worst();

  // The nodes of the first leaves and the gains of their splits.
  GrownPartition first_leaves(Eigen::Index leaves) const;

 private:
  WholeModel whole_model() const;
  double loss() const { return squared_errors(data_, whole_model()).sum(); }
  LocalModel* worst_model(const WholeModel& whole, const Eigen::VectorXd& errors);
  std::optional<double> threshold(const LocalModel& model, Eigen::Index split_input) const;
  Split try_split(const LocalModel& model, Eigen::Index split_input, double at, const WholeModel& whole) const;
  Split best_split(const LocalModel& model, const WholeModel& whole, Eigen::Index& split_input) const;
  void make_split(LocalModel& model, Split split, Eigen::Index split_input, double gain);

  LolimotData data_;
  const LolimotOptions& options_;
  Box extent_;  // of the training rows
  double least_loss_ = least_loss * static_cast<double>(data_.outputs.cols());
  std::vector<Node> nodes_;
  std::vector<double> gains_;  // of the nodes' splits
  std::vector<LocalModel> models_;
};

void LolimotTree::open_root() {
  LocalModel root;
  root.box = extent_;
  root.mu = Eigen::VectorXd::Ones(data_.outputs.rows());
  root.model.samples = data_.outputs.rows();
  Node parentless;
  parentless.value = Eigen::VectorXd::Zero(data_.outputs.cols());
  parentless.slope = Eigen::MatrixXd::Zero(data_.outputs.cols(), data_.deviations.cols());
  fit(data_, parentless, root.mu, root);
  nodes_ = {root.model};
  models_ = {std::move(root)};
}

GrownPartition LolimotTree::first_leaves(Eigen::Index leaves) const {
  GrownPartition result;
  result.nodes = prefix(Partition{.outputs = {}, .nodes = nodes_}, leaves).nodes;
  result.gains = gains_of_splits(result.nodes, gains_);
  return result;
}

WholeModel LolimotTree::whole_model() const {
  WholeModel whole{Eigen::VectorXd::Zero(data_.outputs.rows()),
                   Eigen::MatrixXd::Zero(data_.outputs.rows(), data_.outputs.cols())};
  for (const LocalModel& model : models_) {
    whole.mu += model.mu;
    whole.numerator += model.mu.asDiagonal() * model.predictions;
  }
  return whole;
}

double LolimotTree::aicc() const {
  const double outputs = static_cast<double>(data_.outputs.cols());
  const WholeModel whole = whole_model();
  double effective = 0.0;
  for (const LocalModel& model : models_) {
    effective += effective_parameters(data_.deviations, data_.weights, model.mu.cwiseQuotient(whole.mu));
  }
  const double loss = std::max(squared_errors(data_, whole).sum(), least_loss_);
  return llmt::aicc(data_.weights.sum() * outputs, loss, effective * outputs);
}

// The splittable local model with the largest sum of validity times squared error; null if there is none.
LocalModel* LolimotTree::worst_model(const WholeModel& whole, const Eigen::VectorXd& errors) {
  LocalModel* worst = nullptr;
  double largest = 0.0;
  for (LocalModel& model : models_) {
    const double local = model.mu.cwiseQuotient(whole.mu).dot(errors);
    if (model.splittable && (worst == nullptr || local > largest)) {
      worst = &model;
      largest = local;
    }
  }
  return worst;
}

bool LolimotTree::split_worst() {
  const WholeModel whole = whole_model();
  const Eigen::VectorXd errors = squared_errors(data_, whole);
  while (LocalModel* const worst = worst_model(whole, errors)) {
    Eigen::Index split_input = 0;
    Split best = best_split(*worst, whole, split_input);
    data_.problem.searched(worst->model.samples);
    if (std::isfinite(best.loss)) {
      const double gain = errors.sum() - best.loss;
      make_split(*worst, std::move(best), split_input, gain);
      return true;
    }
    worst->splittable = false;
  }
  return false;
}

// Where a split input of a box is cut, if anywhere.
std::optional<double> LolimotTree::threshold(const LocalModel& model, Eigen::Index split_input) const {
  const std::optional<double> middle = middle_of(data_, model.box, split_input);
  if (!middle || !options_.data_driven) return middle;
  return best_threshold_of(data_, rows_in(data_, model.box, extent_), split_input);
}

// The cut of all split inputs that leaves the smallest error of the whole model; of infinite loss if none is
// admissible.
Split LolimotTree::best_split(const LocalModel& model, const WholeModel& whole, Eigen::Index& split_input) const {
  std::vector<Split> splits(data_.split_values.cols());
  parallel_for(std::ssize(splits), data_.problem.max_threads, [&](Eigen::Index j) {
    data_.problem.check(data_.outputs.rows());
    if (const std::optional<double> at = threshold(model, j)) splits[j] = try_split(model, j, *at, whole);
  });
  if (splits.empty()) return {};
  const auto best = std::ranges::min_element(splits, {}, &Split::loss);
  split_input = best - splits.begin();
  return std::move(*best);
}

Split LolimotTree::try_split(const LocalModel& model, Eigen::Index split_input, double at,
                             const WholeModel& whole) const {
  Split split;
  split.threshold = at;
  split.left.box = split.right.box = model.box;
  split.left.box.high(split_input) = at;
  split.right.box.low(split_input) = at;
  for (LocalModel* half : {&split.left, &split.right}) {
    half->mu = validity_function(data_, half->box, options_.width);
    half->model.samples = std::ssize(rows_in(data_, half->box, extent_));
  }
  WholeModel changed;
  const Eigen::VectorXd sum = whole.mu - model.mu + split.left.mu + split.right.mu;
  // Rounding must not make the sum smaller than its two new terms.
  changed.mu = sum.cwiseMax(split.left.mu + split.right.mu);
  for (LocalModel* half : {&split.left, &split.right}) {
    const Eigen::VectorXd validity = half->mu.cwiseQuotient(changed.mu);
    if (validity.dot(data_.weights) < static_cast<double>(data_.deviations.cols() + 1)) return split;
    fit(data_, model.model, validity, *half);
  }
  changed.numerator = whole.numerator - model.mu.asDiagonal() * model.predictions +
                      split.left.mu.asDiagonal() * split.left.predictions +
                      split.right.mu.asDiagonal() * split.right.predictions;
  split.loss = squared_errors(data_, changed).sum();
  return split;
}

// `model` is split: its left half takes its place, the right half comes last.
void LolimotTree::make_split(LocalModel& model, Split split, Eigen::Index split_input, double gain) {
  Node& parent = nodes_[model.node];
  parent.split_input = data_.problem.options.split_inputs[split_input];
  parent.threshold = split.threshold;
  parent.left = count_of(nodes_);
  parent.right = parent.left + 1;
  split.left.node = parent.left;
  split.right.node = parent.right;
  const double samples = static_cast<double>(split.left.model.samples + split.right.model.samples);
  parent.missing_left = samples > 0.0 ? static_cast<double>(split.left.model.samples) / samples : 0.5;
  gains_.resize(nodes_.size() + 2, 0.0);
  gains_[model.node] = gain;
  nodes_.push_back(split.left.model);
  nodes_.push_back(split.right.model);
  model = std::move(split.left);
  models_.push_back(std::move(split.right));
}

}  // namespace

GrownPartition grow_lolimot(const GrowthProblem& problem, const LolimotOptions& lolimot) {
  LolimotTree tree(problem, lolimot);
  tree.open_root();
  const GrowthEnd end = split_worst_first(tree, problem.options.max_leaves, lolimot.stop_by_aicc);
  GrownPartition result = tree.first_leaves(end.leaves);
  result.stop = end.stop;
  return result;
}

}  // namespace llmt
