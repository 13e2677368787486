#include "readable/equation_tree.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "partition/tree.hpp"
#include "readable/decimal.hpp"

namespace llmt {
namespace {

// Thresholds are rounded to a power of ten that is at most this part of the input's scale, times the coarseness.
constexpr double threshold_grain = 0.1;

// An equation has at least this many rows for each of its coefficients.
constexpr double rows_per_coefficient = 2.0;

// Terms of an equation, at most.
constexpr Eigen::Index most_terms = 40;

// Noise below this part of the output's scale is rounding.
constexpr double least_noise = 1e-9;

constexpr int schwarz_steps = 60;

constexpr double any_value = std::numeric_limits<double>::max();

bool is_presence(const Node& node) { return node.level_side.empty() && node.threshold == any_value; }

// -1 left, 1 right, 0: the value is missing or its level unknown.
int side_of(const Node& node, double value) {
  if (is_presence(node)) return std::isnan(value) ? 1 : -1;
  if (std::isnan(value)) return 0;
  if (node.level_side.empty()) return value <= node.threshold ? -1 : 1;
  const bool known = value >= 0.0 && value < static_cast<double>(node.level_side.size());
  return known ? node.level_side[static_cast<std::size_t>(value)] : 0;
}

// Whether several rows have one value among those between two thresholds, the upper one included: a round number at
// which many rows lie, such as a price limit, belongs to one side for a reason.
bool has_equal_values_between(double one, double other, const std::vector<int>& rows, const RowValues& values,
                              int input) {
  const auto [low, high] = std::minmax(one, other);
  std::vector<double> between;
  for (const int row : rows) {
    const double value = values.inputs(row, input);
    if (value > low && value <= high) between.push_back(value);
  }
  std::ranges::sort(between);
  return std::ranges::adjacent_find(between) != between.end();
}

}  // namespace

EquationTree::EquationTree(const Sample& sample, std::vector<Node> grown, std::vector<Term> terms, double coarseness)
    : sample_(sample), nodes_(std::move(grown)), terms_(std::move(terms)) {
  origin_.terms.resize(std::ssize(terms_));
  for (std::size_t t = 0; t < terms_.size(); ++t) {
    const Regressor& regressor = sample_.described.regressors[terms_[t].first];
    origin_.terms(t) = terms_[t].second < 0 ? regressor.centre : 0.0;
  }
  parents_ = parents_of(terms_);
  if (const std::vector<int>& signs = sample_.described.table->slope_signs; !signs.empty()) {
    for (const Term& term : terms_) {
      const Regressor& regressor = sample_.described.regressors[term.first];
      grains_.signs.push_back(regressor.level < 0 ? signs[regressor.input] : 0);
    }
  }
  settle_splits(coarseness);
  add_sums();
  price_nodes();
  choose_grains(coarseness);
}

// Sends the rows down the tree, and rounds each threshold on the way.
void EquationTree::settle_splits(double coarseness) {
  training_.resize(nodes_.size());
  held_out_.resize(nodes_.size());
  const auto count_up = [](std::vector<int>& rows, Eigen::Index count) {
    for (int row = 0; row < count; ++row) rows.push_back(row);
  };
  count_up(training_[0], sample_.training.count());
  count_up(held_out_[0], sample_.held_out.count());
  for (std::size_t i = 0; i < nodes_.size(); ++i) {
    Node& node = nodes_[i];
    if (node.is_leaf()) continue;
    if (training_[i].empty() || !settle(i, coarseness)) {
      make_leaf(node);
      continue;
    }
    for (const auto& [rows, values] : {std::pair{&training_, &sample_.training}, {&held_out_, &sample_.held_out}}) {
      for (const int row : (*rows)[i]) {
        const int side = side_of(node, values->inputs(row, node.split_input));
        const bool left = side == 0 ? node.missing_left == 1.0 : side < 0;
        (*rows)[left ? node.left : node.right].push_back(row);
      }
    }
  }
}

// Rounds the threshold of a node, and sends rows without a value where most rows go. False if no row goes one way.
bool EquationTree::settle(std::size_t i, double coarseness) {
  Node& node = nodes_[i];
  const RowValues& values = sample_.training;
  const bool on_number = node.level_side.empty() && !is_presence(node);
  if (on_number) {
    double below = -std::numeric_limits<double>::infinity();
    double above = -below;
    double low = above;
    double high = below;
    for (const int row : training_[i]) {
      const double value = values.inputs(row, node.split_input);
      if (std::isnan(value)) continue;
      low = std::min(low, value);
      high = std::max(high, value);
      if (value <= node.threshold) {
        below = std::max(below, value);
      } else {
        above = std::min(above, value);
      }
    }
    if (!std::isfinite(below) || !std::isfinite(above)) return false;
    const int grain = exponent_below(coarseness * threshold_grain * sample_.input_scale(node.split_input));
    const double in_gap = shortest_between(below, above);
    const double coarse = rounded(node.threshold, grain);
    // A number in the gap changes nothing. Else the rounding moves rows to the other side, but no equal ones.
    const bool stays = in_gap == rounded(in_gap, grain) || coarse < low || coarse >= high ||
                       has_equal_values_between(node.threshold, coarse, training_[i], values, node.split_input);
    node.threshold = stays ? in_gap : coarse;
  }
  double left = 0.0;
  double right = 0.0;
  for (const int row : training_[i]) {
    const int side = side_of(node, values.inputs(row, node.split_input));
    left += side < 0 ? values.weights(row) : 0.0;
    right += side > 0 ? values.weights(row) : 0.0;
  }
  node.missing_left = is_presence(node) ? 0.0 : left >= right ? 1.0 : 0.0;
  return left > 0.0 && right > 0.0;
}

// Sums of the leaves over their rows, and of the others over their children.
void EquationTree::add_sums() {
  const RowValues& values = sample_.training;
  const Eigen::Index size = std::ssize(terms_) + 1;
  Eigen::RowVectorXd mean(values.outputs.cols());
  for (Eigen::Index o = 0; o < mean.size(); ++o) {
    const auto add = [&](RowSpan block, WeightedMean& sum) {
      for (Eigen::Index i = block.begin; i < block.end; ++i) sum.add(values.outputs(i, o), values.weights(i));
    };
    mean(o) = sum_over(RowBlocks{values.outputs.rows()}, 1, WeightedMean{}, add).value();
  }
  sums_.resize(nodes_.size());
  for (std::size_t i = nodes_.size(); i-- > 0;) {
    LocalSums& sums = sums_[i];
    if (!nodes_[i].is_leaf()) {
      const LocalSums& left = sums_[nodes_[i].left];
      const LocalSums& right = sums_[nodes_[i].right];
      sums = {left.gram + right.gram, left.products + right.products, left.squares + right.squares};
      continue;
    }
    const std::vector<int>& rows = training_[i];
    const auto add = [&](RowSpan block, LocalSums& to) {
      Eigen::MatrixXd a(block.count(), size);
      Eigen::MatrixXd y(block.count(), mean.size());
      for (Eigen::Index r = 0; r < block.count(); ++r) {
        const int row = rows[block.begin + r];
        const double root = std::sqrt(values.weights(row));
        const double* deviations = values.deviations.row(row).data();
        a(r, 0) = root;
        for (std::size_t t = 0; t < terms_.size(); ++t) {
          const Term& term = terms_[t];
          a(r, t + 1) = root * deviations[term.first] * (term.second < 0 ? 1.0 : deviations[term.second]);
        }
        y.row(r) = root * (values.outputs.row(row) - mean);
      }
      to.gram.selfadjointView<Eigen::Lower>().rankUpdate(a.transpose());
      to.products += a.transpose() * y;
      to.squares += y.colwise().squaredNorm().transpose();
    };
    LocalSums zero{Eigen::MatrixXd::Zero(size, size), Eigen::MatrixXd::Zero(size, mean.size()),
                   Eigen::VectorXd::Zero(mean.size())};
    sums = sum_over(RowBlocks{std::ssize(rows)}, 1, std::move(zero), add);
    sums.gram.triangularView<Eigen::StrictlyUpper>() = sums.gram.transpose();
  }
  origin_.outputs = mean.transpose();
}

void EquationTree::price_nodes() {
  const double total = sample_.total_weight();
  const Eigen::Index outputs = sample_.output_weights.size();
  for (std::size_t i = 0; i < nodes_.size(); ++i) {
    const Node& node = nodes_[i];
    PricedNode priced{.left = node.left, .right = node.right, .split_size = 0, .errors = {0.0}, .sizes = {outputs}};
    if (!node.is_leaf()) {
      priced.split_size = outputs * (!node.level_side.empty() ? 3 + std::ranges::count(node.level_side, -1)
                                     : is_presence(node)      ? 3
                                                              : 4);
    }
    const auto most = static_cast<Eigen::Index>(static_cast<double>(training_[i].size()) / rows_per_coefficient) - 1;
    SelectionPath path;
    if (!training_[i].empty()) {
      path = signed_path(sums_[i], std::clamp<Eigen::Index>(most, 0, std::min(most_terms, std::ssize(terms_))));
      const Eigen::RowVectorXd errors = sample_.output_weights.transpose() * path.rss / total;
      priced.errors.assign(errors.begin(), errors.end());
      for (const Eigen::Index term : path.regressors) {
        priced.sizes.push_back(priced.sizes.back() + outputs * size_of_term(sample_, terms_[term]));
      }
    }
    paths_.push_back(std::move(path));
    priced_.push_back(std::move(priced));
  }
}

double EquationTree::schwarz_price() const {
  const double rows = static_cast<double>(sample_.training.count());
  double price = 0.0;
  double remaining = variance();
  constexpr double symbols = 4.0;  // of a term, or of a split
  for (int step = 0; step < schwarz_steps; ++step) {
    const double next = remaining * std::log(rows) / rows / symbols;
    if (step > 0 && next >= price) break;
    price = next;
    const std::vector<int> tree = cheapest_tree(priced_, price);
    remaining = 0.0;
    for (const int node : nodes_of(priced_, tree)) {
      if (tree[node] != stays_split) remaining += priced_[node].errors[tree[node]];
    }
    if (!(remaining > 0.0)) break;
  }
  return price;
}

void EquationTree::choose_grains(double coarseness) {
  const std::vector<int> tree = cheapest_tree(priced_, schwarz_price());
  Eigen::VectorXd noise = Eigen::VectorXd::Zero(sample_.output_weights.size());
  for (const int node : nodes_of(priced_, tree)) {
    if (tree[node] != stays_split) noise += paths_[node].rss.col(tree[node]);
  }
  const double total = sample_.total_weight();
  noise = (noise / total).cwiseSqrt().cwiseMax(least_noise * (paths_[0].rss.col(0) / total).cwiseSqrt());
  for (Eigen::Index o = 0; o < noise.size(); ++o) {
    // An output that never varies is all the same not to lose its digits.
    const double least = least_noise * std::abs(origin_.outputs(o));
    const double unit = coarseness * (noise(o) > 0.0 ? noise(o) : least > 0.0 ? least : 1.0);
    grains_.intercept.push_back(exponent_below(unit));
    std::vector<int>& slopes = grains_.slopes.emplace_back();
    for (std::size_t t = 0; t < terms_.size(); ++t) {
      const double n = sums_[0].gram(0, 0);
      const double mean = sums_[0].gram(t + 1, 0) / n;
      const double spread = std::sqrt(std::max(0.0, sums_[0].gram(t + 1, t + 1) / n - mean * mean));
      slopes.push_back(exponent_below(spread > 0.0 ? unit / spread : 1.0));
    }
  }
}

Eigen::VectorXd EquationTree::importance(const std::vector<int>& tree) const {
  Eigen::VectorXd gains = Eigen::VectorXd::Zero(sample_.input_scale.size());
  Eigen::VectorXd below = Eigen::VectorXd::Zero(std::ssize(nodes_));  // errors of the subtrees
  const std::vector<int> there = nodes_of(priced_, tree);
  for (std::size_t k = there.size(); k-- > 0;) {
    const int i = there[k];
    const std::vector<double>& errors = priced_[i].errors;
    if (tree[i] == stays_split) {
      below(i) = below(nodes_[i].left) + below(nodes_[i].right);
      gains(nodes_[i].split_input) += std::max(0.0, errors[equation_of(tree, i)] - below(i));
      continue;
    }
    below(i) = errors[tree[i]];
    for (int t = 0; t < tree[i]; ++t) {
      const Term& term = terms_[paths_[i].regressors[t]];
      for (const int factor : {term.first, term.second}) {
        if (factor >= 0) gains(sample_.described.regressors[factor].input) += errors[t] - errors[t + 1];
      }
    }
  }
  return gains;
}

// The number of terms of a node's own equation; an inner node, which predicts nothing, has as many as the leaf below
// it that has most, as far as it can.
int EquationTree::equation_of(const std::vector<int>& tree, int node) const {
  if (tree[node] != stays_split) return tree[node];
  const int most = std::max(equation_of(tree, nodes_[node].left), equation_of(tree, nodes_[node].right));
  return std::min(most, static_cast<int>(priced_[node].errors.size()) - 1);
}

}  // namespace llmt
