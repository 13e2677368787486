#include "evaluator.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

namespace llmt {
namespace {

/// Predictions may differ from the root's model by more than its residuals did, by this fraction of their range.
constexpr double output_margin = 0.1;

/// Validities below this share of the largest are left out of Gaussians.
constexpr double negligible_log = -40.0;

/// 1 left of -1, 0 right of 1, and one or two continuous derivatives.
double transition(double u, int smoothness) {
  if (u <= -1.0) {
    return 1.0;
  }
  if (u >= 1.0) {
    return 0.0;
  }
  const double v = 0.5 * (u + 1.0);
  return smoothness == 1 ? 1.0 - v * v * (3.0 - 2.0 * v) : 1.0 - v * v * v * (10.0 - v * (15.0 - 6.0 * v));
}

double transition_derivative(double u, int smoothness) {
  if (!(std::abs(u) < 1.0)) {
    return 0.0;
  }
  const double v = 0.5 * (u + 1.0);
  const double bump = v * (1.0 - v);
  return smoothness == 1 ? -3.0 * bump : -15.0 * bump * bump;
}

/// `x` held to low ... high, with a parabola of length `round` at the ends; and its derivative.
struct Held {
  double value;
  double derivative;
};

Held hold(double x, double low, double high) {
  const double round = rounding_of_hold * (high - low);
  if (x > high) {
    const double beyond = x - high;
    return beyond >= round ? Held{high + 0.5 * round, 0.0}
                           : Held{x - 0.5 * beyond * beyond / round, 1.0 - beyond / round};
  }
  if (x < low) {
    const double beyond = low - x;
    return beyond >= round ? Held{low - 0.5 * round, 0.0}
                           : Held{x + 0.5 * beyond * beyond / round, 1.0 - beyond / round};
  }
  return {x, 1.0};
}

}  // namespace

double deviation_at(const std::vector<InputColumn>& inputs, const Regressor& regressor, double x) {
  if (regressor.level < 0) {
    return x - regressor.centre;
  }
  const double levels = static_cast<double>(inputs[static_cast<std::size_t>(regressor.input)].levels.size());
  const bool known = x >= 0.0 && x < levels;
  return known ? (x == static_cast<double>(regressor.level) ? 1.0 : 0.0) - regressor.centre
               : std::numeric_limits<double>::quiet_NaN();
}

void deviations_at(const std::vector<InputColumn>& inputs, const std::vector<Regressor>& regressors, const double* row,
                   double* deviations) {
  for (std::size_t k = 0; k < regressors.size(); ++k) {
    deviations[k] = deviation_at(inputs, regressors[k], row[regressors[k].input]);
  }
}

void make_leaf(Node& node) {
  node.left = node.right = node.split_input = -1;
  node.threshold = 0.0;
  node.half_width = 0.0;
  node.level_side.clear();
}

std::vector<int> parents_of(const Partition& partition) {
  std::vector<int> parents(partition.nodes.size(), -1);
  for (std::size_t i = 0; i < partition.nodes.size(); ++i) {
    const Node& node = partition.nodes[i];
    if (!node.is_leaf()) {
      parents[static_cast<std::size_t>(node.left)] = static_cast<int>(i);
      parents[static_cast<std::size_t>(node.right)] = static_cast<int>(i);
    }
  }
  return parents;
}

Boxes boxes_of(const Partition& partition, const Eigen::VectorXd& low, const Eigen::VectorXd& high) {
  const std::ptrdiff_t nodes = std::ssize(partition.nodes);
  Boxes boxes{low.replicate(1, nodes), high.replicate(1, nodes)};
  for (std::ptrdiff_t i = 0; i < nodes; ++i) {
    const Node& node = partition.nodes[static_cast<std::size_t>(i)];
    if (node.is_leaf()) {
      continue;
    }
    for (const int child : {node.left, node.right}) {
      boxes.low.col(child) = boxes.low.col(i);
      boxes.high.col(child) = boxes.high.col(i);
    }
    if (node.level_side.empty() && node.threshold < std::numeric_limits<double>::max()) {
      boxes.high(node.split_input, node.left) = std::min(boxes.high(node.split_input, i), node.threshold);
      boxes.low(node.split_input, node.right) = std::max(boxes.low(node.split_input, i), node.threshold);
    }
  }
  return boxes;
}

void set_half_widths(Partition& partition, const Eigen::VectorXd& low, const Eigen::VectorXd& high) {
  const Boxes boxes = boxes_of(partition, low, high);
  const double width = partition.validity.kind == ValidityKind::blend ? partition.validity.width : 0.0;
  for (std::size_t i = 0; i < partition.nodes.size(); ++i) {
    Node& node = partition.nodes[i];
    node.half_width = 0.0;
    if (!node.is_leaf() && node.level_side.empty() && node.threshold < std::numeric_limits<double>::max()) {
      const std::ptrdiff_t box = static_cast<std::ptrdiff_t>(i);
      const double extent = std::min(node.threshold - boxes.low(node.split_input, box),
                                     boxes.high(node.split_input, box) - node.threshold);
      node.half_width = std::max(0.0, width * extent);
    }
  }
}

Evaluator::Evaluator(const Partition& partition, const std::vector<InputColumn>& inputs, std::ptrdiff_t regressors)
    : kind_(partition.validity.kind),
      smoothness_(partition.validity.smoothness),
      outputs_(std::ssize(partition.outputs)),
      regressors_(regressors),
      inputs_(std::ssize(inputs)),
      parents_(parents_of(partition)),
      outer_slope_(partition.outer_slope.size() > 0 ? partition.outer_slope : partition.nodes.front().slope) {
  if (partition.residual_range.size() > 0) {
    const Eigen::VectorXd margin = output_margin * (partition.residual_range.col(1) - partition.residual_range.col(0));
    residual_range_ = partition.residual_range;
    residual_range_.col(0) -= margin;
    residual_range_.col(1) += margin;
  }
  for (const Node& node : partition.nodes) {
    Branch branch{.left = node.left,
                  .right = node.right,
                  .input = node.split_input,
                  .threshold = node.threshold,
                  .per_half_width = node.half_width > 0.0 ? 1.0 / node.half_width : 0.0,
                  .half_width = node.half_width,
                  .missing_left = node.missing_left,
                  .first_level = -1,
                  .levels = 0};
    if (!node.level_side.empty()) {
      branch.first_level = static_cast<int>(level_side_.size());
      branch.levels = static_cast<int>(node.level_side.size());
      level_side_.insert(level_side_.end(), node.level_side.begin(), node.level_side.end());
    }
    branches_.push_back(branch);
    for (std::ptrdiff_t o = 0; o < outputs_; ++o) {
      coefficients_.push_back(node.value(o));
      for (std::ptrdiff_t k = 0; k < regressors_; ++k) {
        coefficients_.push_back(node.slope(o, k));
      }
    }
    for (const Eigen::VectorXd* values : {&node.low, &node.high, &node.mean}) {
      ranges_.insert(ranges_.end(), values->begin(), values->end());
    }
  }
  if (kind_ == ValidityKind::gaussian) {
    Eigen::VectorXd low(inputs_);
    Eigen::VectorXd high(inputs_);
    for (std::ptrdiff_t j = 0; j < inputs_; ++j) {
      low(j) = inputs[static_cast<std::size_t>(j)].low;
      high(j) = inputs[static_cast<std::size_t>(j)].high;
    }
    const Boxes boxes = boxes_of(partition, low, high);
    std::vector<bool> is_split(inputs.size(), false);
    for (const Node& node : partition.nodes) {
      if (!node.is_leaf() && node.level_side.empty() && node.threshold < std::numeric_limits<double>::max()) {
        is_split[static_cast<std::size_t>(node.split_input)] = true;
      }
    }
    for (std::size_t i = 0; i < partition.nodes.size(); ++i) {
      if (!partition.nodes[i].is_leaf()) {
        continue;
      }
      const std::ptrdiff_t box = static_cast<std::ptrdiff_t>(i);
      Gaussian gaussian{static_cast<int>(i), 0.5 * (boxes.low.col(box) + boxes.high.col(box)),
                        Eigen::VectorXd::Zero(inputs_)};
      for (std::ptrdiff_t j = 0; j < inputs_; ++j) {
        const double sigma = partition.validity.width * (boxes.high(j, box) - boxes.low(j, box));
        // Where no leaf was cut, all Gaussians are alike and cancel.
        if (is_split[static_cast<std::size_t>(j)] && sigma > 0.0) {
          gaussian.per_sigma(j) = 1.0 / sigma;
        }
      }
      gaussians_.push_back(std::move(gaussian));
    }
  }
}

double Evaluator::left_share(int node, const double* row) const {
  const Branch& branch = branches_[static_cast<std::size_t>(node)];
  const double x = row[branch.input];
  if (branch.first_level >= 0) {
    const int side = x >= 0.0 && x < branch.levels
                         ? level_side_[static_cast<std::size_t>(branch.first_level + static_cast<int>(x))]
                         : 0;
    return side < 0 ? 1.0 : side > 0 ? 0.0 : branch.missing_left;
  }
  if (std::isnan(x)) {
    return branch.missing_left;
  }
  const double distance = x - branch.threshold;
  if (branch.per_half_width == 0.0) {
    return distance <= 0.0 ? 1.0 : 0.0;
  }
  return transition(distance * branch.per_half_width, smoothness_);
}

double Evaluator::left_share_derivative(int node, const double* row) const {
  const Branch& branch = branches_[static_cast<std::size_t>(node)];
  if (branch.first_level >= 0 || branch.per_half_width == 0.0) {
    return 0.0;
  }
  return transition_derivative((row[branch.input] - branch.threshold) * branch.per_half_width, smoothness_) *
         branch.per_half_width;
}

int Evaluator::child_of(int node, const double* row) const {
  const Branch& branch = branches_[static_cast<std::size_t>(node)];
  if (branch.first_level < 0 && !std::isnan(row[branch.input])) {
    return row[branch.input] <= branch.threshold ? branch.left : branch.right;
  }
  return left_share(node, row) >= 0.5 ? branch.left : branch.right;
}

bool Evaluator::is_ambiguous(const double* row) const {
  std::vector<int> open = {0};
  while (!open.empty()) {
    const int node = open.back();
    open.pop_back();
    const Branch& branch = branches_[static_cast<std::size_t>(node)];
    if (branch.left < 0) {
      continue;
    }
    const double left = left_share(node, row);
    if (std::isnan(row[branch.input]) && left > 1.0 - clear_share && left < clear_share) {
      return true;
    }
    if (left > 0.0) {
      open.push_back(branch.left);
    }
    if (left < 1.0) {
      open.push_back(branch.right);
    }
  }
  return false;
}

int Evaluator::find_leaf(const double* row) const {
  int node = 0;
  while (branches_[static_cast<std::size_t>(node)].left >= 0) {
    node = child_of(node, row);
  }
  return node;
}

void Evaluator::activate(const double* row, std::vector<Activation>& active) const {
  active.clear();
  if (kind_ != ValidityKind::gaussian) {
    // Leaves stand before position `next`, nodes still to be opened behind it; never more than there are leaves.
    active.resize(branches_.size() / 2 + 1);
    Activation* const entries = active.data();
    const Branch* const branches = branches_.data();
    entries[0] = {0, 1.0};
    std::size_t next = 0;
    std::size_t count = 1;
    while (next < count) {
      Activation at = entries[next];
      for (const Branch* branch = branches + at.node; branch->left >= 0; branch = branches + at.node) {
        const double x = row[branch->input];
        double left = 0.0;
        if (branch->first_level < 0 && x == x) {
          const double u = (x - branch->threshold) * branch->per_half_width;
          if (branch->per_half_width == 0.0) {
            left = x <= branch->threshold ? 1.0 : 0.0;
          } else if (u <= -1.0 || u >= 1.0) {
            left = u < 0.0 ? 1.0 : 0.0;
          } else {
            left = transition(u, smoothness_);
          }
        } else {
          left = left_share(at.node, row);
        }
        if (left >= 1.0) {
          at.node = branch->left;
        } else if (left <= 0.0) {
          at.node = branch->right;
        } else {
          entries[count++] = {branch->right, at.validity * (1.0 - left)};
          at = {branch->left, at.validity * left};
        }
      }
      entries[next++] = at;
    }
    active.resize(count);
    return;
  }
  double largest = -std::numeric_limits<double>::infinity();
  for (const Gaussian& gaussian : gaussians_) {
    double exponent = 0.0;
    for (std::ptrdiff_t j = 0; j < inputs_; ++j) {
      const double z = gaussian.per_sigma(j) > 0.0 && !std::isnan(row[j])
                           ? (row[j] - gaussian.centre(j)) * gaussian.per_sigma(j)
                           : 0.0;
      exponent -= 0.5 * z * z;
    }
    active.push_back({gaussian.node, exponent});
    largest = std::max(largest, exponent);
  }
  std::erase_if(active, [&](const Activation& entry) { return !(entry.validity - largest >= negligible_log); });
  double sum = 0.0;
  for (Activation& entry : active) {
    entry.validity = std::exp(entry.validity - largest);
    sum += entry.validity;
  }
  for (Activation& entry : active) {
    entry.validity /= sum;
  }
}

void Evaluator::guarded(int node, const double* deviations, double* values) const {
  constexpr std::ptrdiff_t at_once = 64;
  for (std::ptrdiff_t o = 0; o < outputs_; ++o) {
    values[o] = value(node, o);
  }
  for (std::ptrdiff_t begin = 0; begin < regressors_; begin += at_once) {
    const std::ptrdiff_t end = std::min(regressors_, begin + at_once);
    std::array<double, at_once> below;
    const auto add = [&](int at, std::ptrdiff_t k, double change) {
      for (std::ptrdiff_t o = 0; o < outputs_; ++o) {
        values[o] += slopes(at, o)[k] * change;
      }
    };
    bool outside = false;
    for (std::ptrdiff_t k = begin; k < end; ++k) {
      const bool missing = std::isnan(deviations[k]);
      const double held = missing ? mean(node)[k] : hold(deviations[k], low(node)[k], high(node)[k]).value;
      add(node, k, held);
      below[static_cast<std::size_t>(k - begin)] = held;
      outside = outside || (!missing && held != deviations[k]);
    }
    for (int at = parents_[static_cast<std::size_t>(node)]; outside && at >= 0;
         at = parents_[static_cast<std::size_t>(at)]) {
      outside = false;
      for (std::ptrdiff_t k = begin; k < end; ++k) {
        double& reached = below[static_cast<std::size_t>(k - begin)];
        if (std::isnan(deviations[k]) || reached == deviations[k]) {
          continue;
        }
        const double held = hold(deviations[k], low(at)[k], high(at)[k]).value;
        add(at, k, held - reached);
        reached = held;
        outside = outside || held != deviations[k];
      }
    }
  }
}

void Evaluator::local(int node, const double* deviations, double* values) const {
  const double* lows = low(node);
  const double* highs = high(node);
  std::ptrdiff_t inside = 0;
  for (std::ptrdiff_t k = 0; k < regressors_; ++k) {
    inside +=
        static_cast<std::ptrdiff_t>(deviations[k] >= lows[k]) & static_cast<std::ptrdiff_t>(deviations[k] <= highs[k]);
  }
  if (inside != regressors_) {
    guarded(node, deviations, values);
    return;
  }
  for (std::ptrdiff_t o = 0; o < outputs_; ++o) {
    const double* slope = slopes(node, o);
    double sum = slope[-1];
    for (std::ptrdiff_t k = 0; k < regressors_; ++k) {
      sum += slope[k] * deviations[k];
    }
    values[o] = sum;
  }
}

double Evaluator::root_value(std::ptrdiff_t output, const double* deviations) const {
  double sum = value(0, output);
  for (std::ptrdiff_t k = 0; k < regressors_; ++k) {
    const double held = std::isnan(deviations[k]) ? mean(0)[k] : hold(deviations[k], low(0)[k], high(0)[k]).value;
    sum += slopes(0, output)[k] * held;
  }
  return sum;
}

void Evaluator::finish(const double* deviations, double* values) const {
  for (std::ptrdiff_t o = 0; o < residual_range_.rows(); ++o) {
    const double root = root_value(o, deviations);
    values[o] = root + hold(values[o] - root, residual_range_(o, 0), residual_range_(o, 1)).value;
  }
  for (std::ptrdiff_t k = 0; k < regressors_; ++k) {
    if (deviations[k] < low(0)[k] || deviations[k] > high(0)[k]) {
      const double beyond = deviations[k] - hold(deviations[k], low(0)[k], high(0)[k]).value;
      for (std::ptrdiff_t o = 0; o < outputs_; ++o) {
        values[o] += outer_slope_(o, k) * beyond;
      }
    }
  }
}

void Evaluator::blend(const std::vector<Activation>& active, const double* deviations, double* values) const {
  if (active.size() == 1) {
    local(active.front().node, deviations, values);
    return;
  }
  std::fill(values, values + outputs_, 0.0);
  constexpr std::ptrdiff_t small = 8;
  std::array<double, small> few;
  std::vector<double> many;
  double* of_leaf = few.data();
  if (outputs_ > small) {
    many.resize(static_cast<std::size_t>(outputs_));
    of_leaf = many.data();
  }
  for (const Activation& entry : active) {
    local(entry.node, deviations, of_leaf);
    for (std::ptrdiff_t o = 0; o < outputs_; ++o) {
      values[o] += entry.validity * of_leaf[o];
    }
  }
}

void Evaluator::combine(const std::vector<Activation>& active, const double* deviations, double* values) const {
  blend(active, deviations, values);
  finish(deviations, values);
}

void Evaluator::local_slopes(int node, const double* deviations, double validity, Eigen::MatrixXd& by_regressor) const {
  for (std::ptrdiff_t k = 0; k < regressors_; ++k) {
    double below = 0.0;  // derivative of the held deviation of the node below
    for (int at = node; at >= 0; at = parents_[static_cast<std::size_t>(at)]) {
      const double derivative = hold(deviations[k], low(at)[k], high(at)[k]).derivative;
      for (std::ptrdiff_t o = 0; o < outputs_; ++o) {
        by_regressor(o, k) += validity * slopes(at, o)[k] * (derivative - below);
      }
      below = derivative;
      if (derivative == 1.0) {
        break;
      }
    }
  }
}

void Evaluator::derivatives(const double* row, const double* deviations, Eigen::MatrixXd& by_input,
                            Eigen::MatrixXd& by_regressor) const {
  by_input.setZero(outputs_, inputs_);
  by_regressor.setZero(outputs_, regressors_);
  std::vector<Activation> active;
  activate(row, active);
  for (const Activation& entry : active) {
    local_slopes(entry.node, deviations, entry.validity, by_regressor);
  }
  if (kind_ == ValidityKind::gaussian) {
    add_gaussian_derivatives(active, row, deviations, by_input);
  } else {
    add_blend_derivatives(0, 1.0, row, deviations, by_input);
  }
  // The holds of finish().
  Eigen::VectorXd values(outputs_);
  blend(active, deviations, values.data());
  for (std::ptrdiff_t o = 0; o < residual_range_.rows(); ++o) {
    const double derivative =
        hold(values(o) - root_value(o, deviations), residual_range_(o, 0), residual_range_(o, 1)).derivative;
    by_input.row(o) *= derivative;
    by_regressor.row(o) *= derivative;
    for (std::ptrdiff_t k = 0; k < regressors_; ++k) {
      by_regressor(o, k) +=
          (1.0 - derivative) * slopes(0, o)[k] * hold(deviations[k], low(0)[k], high(0)[k]).derivative;
    }
  }
  for (std::ptrdiff_t k = 0; k < regressors_; ++k) {
    by_regressor.col(k) += outer_slope_.col(k) * (1.0 - hold(deviations[k], low(0)[k], high(0)[k]).derivative);
  }
}

// d Phi_i = Phi_i (d l_i - sum_k Phi_k d l_k), l_i the exponent.
void Evaluator::add_gaussian_derivatives(const std::vector<Activation>& active, const double* row,
                                         const double* deviations, Eigen::MatrixXd& by_input) const {
  std::vector<const Gaussian*> of_node(branches_.size(), nullptr);
  for (const Gaussian& gaussian : gaussians_) {
    of_node[static_cast<std::size_t>(gaussian.node)] = &gaussian;
  }
  const Eigen::Map<const Eigen::VectorXd> x(row, inputs_);
  Eigen::VectorXd mean = Eigen::VectorXd::Zero(inputs_);
  std::vector<Eigen::VectorXd> exponents;
  for (const Activation& entry : active) {
    const Gaussian& gaussian = *of_node[static_cast<std::size_t>(entry.node)];
    exponents.push_back(-((x - gaussian.centre).array() * gaussian.per_sigma.array().square()).matrix());
    mean += entry.validity * exponents.back();
  }
  Eigen::VectorXd values(outputs_);
  for (std::size_t i = 0; i < active.size(); ++i) {
    local(active[i].node, deviations, values.data());
    by_input += active[i].validity * values * (exponents[i] - mean).transpose();
  }
}

// The value of a subtree is g V_left + (1 - g) V_right: its derivative by g is V_left - V_right.
Eigen::VectorXd Evaluator::add_blend_derivatives(int node, double validity, const double* row, const double* deviations,
                                                 Eigen::MatrixXd& by_input) const {
  const Branch& branch = branches_[static_cast<std::size_t>(node)];
  if (branch.left < 0) {
    Eigen::VectorXd leaf(outputs_);
    local(node, deviations, leaf.data());
    return leaf;
  }
  const double left = left_share(node, row);
  if (left >= 1.0 || left <= 0.0) {
    return add_blend_derivatives(left >= 1.0 ? branch.left : branch.right, validity, row, deviations, by_input);
  }
  const Eigen::VectorXd of_left = add_blend_derivatives(branch.left, validity * left, row, deviations, by_input);
  const Eigen::VectorXd of_right =
      add_blend_derivatives(branch.right, validity * (1.0 - left), row, deviations, by_input);
  by_input.col(branch.input) += validity * left_share_derivative(node, row) * (of_left - of_right);
  return left * of_left + (1.0 - left) * of_right;
}

}  // namespace llmt
