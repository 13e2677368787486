#include "growth/lolimot/lolimot.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <optional>

#include "base/parallel.hpp"
#include "constraints/signs.hpp"
#include "growth/search/split_search.hpp"
#include "model/evaluator.hpp"
#include "numerics/aicc.hpp"
#include "numerics/node_fit.hpp"

namespace llmt {
namespace {

// AICc has to improve within this many further leaves.
constexpr Eigen::Index patience = 10;

// Rows with less validity than this take no part in a local estimate.
constexpr double negligible = 1e-9;

// A local model with its validity function.
struct LocalModel {
  int node = 0;
  Eigen::VectorXd low;  // box, of the split inputs
  Eigen::VectorXd high;
  Eigen::VectorXd mu;           // validity function before normalisation, one per row
  Eigen::MatrixXd predictions;  // rows x outputs
  Node model;                   // value, slope, rank, rss, samples
  bool splittable = true;
};

class Lolimot {
 public:
  Lolimot(const GrowthProblem& problem, const LolimotOptions& options) : problem_(problem), options_(options) {
    const TrainingRows& training = *problem.training;
    const Table& table = *training.table;
    deviations_.resize(training.count(), std::ssize(training.regressors));
    for (Eigen::Index index = 0; index < num_chunks(training); ++index) {
      const Chunk chunk = fetch(training, index, {});
      deviations_.middleRows(index * chunk_rows, chunk.count()) =
          chunk.deviations.array().isNaN().select(0.0, chunk.deviations);
    }
    split_values_ = table.inputs(training.rows, problem.options.split_inputs);
    outputs_ = table.outputs(training.rows, problem.outputs);
    weights_ = training.weight_unit * table.weights(training.rows);
    const Eigen::RowVectorXd mean = weights_.transpose() * outputs_ / weights_.sum();
    output_weights_ = (weights_.asDiagonal() * (outputs_.rowwise() - mean).cwiseAbs2())
                          .colwise()
                          .sum()
                          .transpose()
                          .unaryExpr([](double squares) { return squares > 0.0 ? 1.0 / squares : 1.0; });
    floor_ = 1e-24 * static_cast<double>(outputs_.cols());
    signs_ = coefficient_signs(training);
  }

  GrownPartition run() {
    LocalModel root;
    root.low = options_.low;
    root.high = options_.high;
    root.mu = Eigen::VectorXd::Ones(outputs_.rows());
    root.model.samples = outputs_.rows();
    Node parentless;
    parentless.value = Eigen::VectorXd::Zero(outputs_.cols());
    parentless.slope = Eigen::MatrixXd::Zero(outputs_.cols(), deviations_.cols());
    fit(root, parentless, root.mu);
    nodes_ = {root.model};
    models_ = {std::move(root)};
    StopReason stop = StopReason::leaf_samples;
    double best_criterion = criterion();
    Eigen::Index best_leaves = 1;
    while (true) {
      if (problem_.options.max_leaves > 0 && std::ssize(models_) >= problem_.options.max_leaves) {
        stop = StopReason::max_leaves;
        break;
      }
      if (loss() <= floor_) {
        stop = StopReason::exact_fit;
        break;
      }
      if (!split_worst()) break;
      if (options_.stop_by_aicc) {
        const double now = criterion();
        if (now < best_criterion) {
          best_criterion = now;
          best_leaves = std::ssize(models_);
        } else if (std::ssize(models_) >= best_leaves + patience) {
          stop = StopReason::aicc;
          break;
        }
      }
    }
    if (options_.stop_by_aicc && best_leaves < std::ssize(models_)) {
      nodes_ = prefix(Partition{.outputs = {}, .nodes = std::move(nodes_)}, best_leaves).nodes;
      stop = StopReason::aicc;
    }
    gains_.resize(nodes_.size());
    for (std::size_t i = 0; i < nodes_.size(); ++i) {
      gains_[i] = nodes_[i].is_leaf() ? 0.0 : gains_[i];
    }
    return {.nodes = std::move(nodes_), .stop = stop, .gains = std::move(gains_)};
  }

 private:
  Eigen::VectorXd validity_function(const Eigen::VectorXd& low, const Eigen::VectorXd& high) const {
    const Eigen::MatrixXd& values = split_values_;
    Eigen::VectorXd exponent = Eigen::VectorXd::Zero(values.rows());
    for (Eigen::Index j = 0; j < values.cols(); ++j) {
      const double sigma = options_.width * (high(j) - low(j));
      if (!(sigma > 0.0) || is_categorical(j)) continue;
      const double centre = 0.5 * (low(j) + high(j));
      for (Eigen::Index i = 0; i < values.rows(); ++i) {
        const double z = std::isnan(values(i, j)) ? 0.0 : (values(i, j) - centre) / sigma;
        exponent(i) -= 0.5 * z * z;
      }
    }
    // Far boxes underflow to zero; a row's own box never does for any usual number of inputs, and the floor keeps the
    // sum positive for the others.
    return exponent.array().exp().max(1e-280);
  }

  // Weighted least squares with weights `validity`, as a correction of the parent's model.
  void fit(LocalModel& model, const Node& parent, const Eigen::VectorXd& validity) const {
    std::vector<int> rows;
    for (Eigen::Index i = 0; i < validity.size(); ++i) {
      if (validity(i) > negligible) {
        rows.push_back(static_cast<int>(i));
      }
    }
    const Eigen::MatrixXd x = deviations_(rows, Eigen::all);
    const Eigen::MatrixXd residuals = (outputs_(rows, Eigen::all) - x * parent.slope.transpose()).rowwise() -
                                      Eigen::RowVectorXd(parent.value.transpose());
    const Eigen::VectorXd weights = validity(rows).cwiseProduct(weights_(rows));
    const NodeFit fitted = fit_node(x, residuals, weights);
    Node& node = model.model;
    node.rank = fitted.rank;
    node.rss = fitted.rss;
    node.value = parent.value + fitted.centre_change;
    node.slope = parent.slope + fitted.slope_change;
    if (!signs_.empty()) {
      keep_signs(signs_, x, weights, node);
    }
    node.mean = Eigen::VectorXd::Zero(deviations_.cols());
    node.low = deviations_.colwise().minCoeff().transpose();
    node.high = deviations_.colwise().maxCoeff().transpose();
    model.predictions = (deviations_ * node.slope.transpose()).rowwise() + Eigen::RowVectorXd(node.value.transpose());
  }

  Eigen::VectorXd sum_of_mu() const {
    Eigen::VectorXd sum = Eigen::VectorXd::Zero(outputs_.rows());
    for (const LocalModel& model : models_) {
      sum += model.mu;
    }
    return sum;
  }

  Eigen::MatrixXd numerator() const {
    Eigen::MatrixXd sum = Eigen::MatrixXd::Zero(outputs_.rows(), outputs_.cols());
    for (const LocalModel& model : models_) {
      sum += model.mu.asDiagonal() * model.predictions;
    }
    return sum;
  }

  // Weighted squared error of every row under sums of mu times prediction, and of mu.
  Eigen::VectorXd squared_errors(const Eigen::MatrixXd& numerator, const Eigen::VectorXd& mu) const {
    const Eigen::MatrixXd error = outputs_ - mu.cwiseInverse().asDiagonal() * numerator;
    return weights_.cwiseProduct(error.cwiseAbs2() * output_weights_);
  }

  double loss() const { return squared_errors(numerator(), sum_of_mu()).sum(); }

  // AICc with the effective number of parameters of local estimation.
  double criterion() const {
    const double rows = weights_.sum() * static_cast<double>(outputs_.cols());
    const Eigen::VectorXd total = sum_of_mu();
    double effective = 0.0;
    for (const LocalModel& model : models_) {
      effective += effective_parameters(deviations_, weights_, model.mu.cwiseQuotient(total));
    }
    return aicc(rows, std::max(loss(), floor_), effective * static_cast<double>(outputs_.cols()));
  }

  // Where input j of a box is split, if anywhere.
  std::optional<double> threshold(const LocalModel& model, Eigen::Index j) const {
    if (is_categorical(j) || !(model.low(j) < model.high(j))) return std::nullopt;
    if (!options_.data_driven) return 0.5 * (model.low(j) + model.high(j));
    const std::vector<int> rows = rows_in(model);
    std::vector<int> order;
    for (std::size_t k = 0; k < rows.size(); ++k) {
      if (!std::isnan(split_values_(rows[k], j))) {
        order.push_back(static_cast<int>(k));
      }
    }
    const auto value = [&](int k) { return split_values_(rows[k], j); };
    std::ranges::stable_sort(order, [&](int a, int b) { return value(a) < value(b); });
    const Eigen::Index smallest = problem_.options.min_leaf_samples;
    if (std::ssize(order) < 2 * smallest) return std::nullopt;
    const NodeFit crisp = fit_node(deviations_(rows, Eigen::all), outputs_(rows, Eigen::all), weights_(rows));
    std::vector<double> values;
    for (const int k : order) {
      values.push_back(value(k));
    }
    const double rss = output_weights_.dot(crisp.rss);
    const SearchNode node{crisp.features, output_weights_, rss};
    InputSearch search(node, values, order, smallest);
    search.search_edges();
    search.refine(std::numeric_limits<double>::infinity());
    const SplitCandidate found = search.best();
    if (found.input < 0) return std::nullopt;
    const double low = values[found.left - 1];
    const double high = values[found.left];
    return std::min(low + 0.5 * (high - low), std::nextafter(high, low));
  }

  // Rows whose values lie in the box; rows without a value only in boxes that are not cut there.
  std::vector<int> rows_in(const LocalModel& model) const {
    std::vector<int> rows;
    for (Eigen::Index i = 0; i < split_values_.rows(); ++i) {
      bool inside = true;
      for (Eigen::Index j = 0; j < split_values_.cols() && inside; ++j) {
        const double x = split_values_(i, j);
        inside = std::isnan(x) ? model.low(j) == options_.low(j) && model.high(j) == options_.high(j)
                               : (x > model.low(j) || model.low(j) == options_.low(j)) && x <= model.high(j);
      }
      if (inside) {
        rows.push_back(static_cast<int>(i));
      }
    }
    return rows;
  }

  struct Split {
    double loss = std::numeric_limits<double>::infinity();
    double threshold = 0.0;
    LocalModel left;
    LocalModel right;
  };

  // Splits the worst local model that can be split; false if there is none.
  bool split_worst() {
    const Eigen::MatrixXd numerators = numerator();
    const Eigen::VectorXd total = sum_of_mu();
    const Eigen::VectorXd errors = squared_errors(numerators, total);
    while (true) {
      Eigen::Index worst = -1;
      double largest = 0.0;
      for (Eigen::Index m = 0; m < std::ssize(models_); ++m) {
        const LocalModel& model = models_[m];
        const double local = model.mu.cwiseQuotient(total).dot(errors);
        if (model.splittable && (worst < 0 || local > largest)) {
          worst = m;
          largest = local;
        }
      }
      if (worst < 0) return false;
      LocalModel& model = models_[worst];
      std::vector<Split> splits(split_values_.cols());
      parallel_for(std::ssize(splits), problem_.max_threads, [&](Eigen::Index j) {
        if (const std::optional<double> at = threshold(model, j)) {
          splits[j] = try_split(model, j, *at, numerators, total);
        }
      });
      const auto best =
          std::ranges::min_element(splits, [](const Split& a, const Split& b) { return a.loss < b.loss; });
      if (best == splits.end() || !std::isfinite(best->loss)) {
        model.splittable = false;
        continue;
      }
      const Eigen::Index input = best - splits.begin();
      Node& parent = nodes_[model.node];
      parent.split_input = problem_.options.split_inputs[input];
      parent.threshold = best->threshold;
      parent.left = static_cast<int>(nodes_.size());
      parent.right = parent.left + 1;
      best->left.node = parent.left;
      best->right.node = parent.right;
      const double samples = static_cast<double>(best->left.model.samples + best->right.model.samples);
      parent.missing_left = samples > 0.0 ? static_cast<double>(best->left.model.samples) / samples : 0.5;
      gains_.resize(nodes_.size() + 2, 0.0);
      gains_[model.node] = errors.sum() - best->loss;
      nodes_.push_back(best->left.model);
      nodes_.push_back(best->right.model);
      model = std::move(best->left);
      models_.push_back(std::move(best->right));
      return true;
    }
  }

  Split try_split(const LocalModel& model, Eigen::Index j, double at, const Eigen::MatrixXd& numerators,
                  const Eigen::VectorXd& total) const {
    Split split;
    split.threshold = at;
    for (LocalModel* half : {&split.left, &split.right}) {
      half->low = model.low;
      half->high = model.high;
    }
    split.left.high(j) = at;
    split.right.low(j) = at;
    for (LocalModel* half : {&split.left, &split.right}) {
      half->mu = validity_function(half->low, half->high);
      half->model.samples = std::ssize(rows_in(*half));
    }
    const Eigen::VectorXd sum = total - model.mu + split.left.mu + split.right.mu;
    const Eigen::VectorXd safe_sum = sum.cwiseMax(split.left.mu + split.right.mu);
    for (LocalModel* half : {&split.left, &split.right}) {
      const Eigen::VectorXd validity = half->mu.cwiseQuotient(safe_sum);
      if (validity.dot(weights_) < static_cast<double>(deviations_.cols() + 1)) return split;
      fit(*half, model.model, validity);
    }
    const Eigen::MatrixXd changed = numerators - model.mu.asDiagonal() * model.predictions +
                                    split.left.mu.asDiagonal() * split.left.predictions +
                                    split.right.mu.asDiagonal() * split.right.predictions;
    split.loss = squared_errors(changed, safe_sum).sum();
    return split;
  }

  bool is_categorical(Eigen::Index split_input) const {
    const int input = problem_.options.split_inputs[split_input];
    return problem_.training->table->num_levels[input] > 0;
  }

  const GrowthProblem& problem_;
  const LolimotOptions& options_;
  Eigen::MatrixXd deviations_;    // rows x regressors; a missing value is 0
  Eigen::MatrixXd split_values_;  // rows x split inputs
  Eigen::MatrixXd outputs_;
  Eigen::VectorXd weights_;
  Eigen::VectorXd output_weights_;
  double floor_ = 0.0;
  std::vector<int> signs_;  // of the coefficients
  std::vector<Node> nodes_;
  std::vector<double> gains_;  // of the nodes' splits
  std::vector<LocalModel> models_;
};

}  // namespace

GrownPartition grow_lolimot(const GrowthProblem& problem, const LolimotOptions& lolimot) {
  return Lolimot(problem, lolimot).run();
}

}  // namespace llmt
