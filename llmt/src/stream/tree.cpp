#include "stream/tree.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "numerics/f_distribution.hpp"

namespace llmt {
namespace {

// RiseDetector: rows that the usual error is a mean of, rows before it counts, the rise that is put up with, and the
// alarm: the sum of the errors' excesses over usual * (1 + tolerated). Errors count as at most `largest` usual ones,
// so that outliers raise no alarm.
constexpr double memory = 5000.0;
constexpr Eigen::Index settling = 300;
constexpr double tolerated = 0.1;
constexpr double largest = 4.0;
constexpr double alarm = 80.0;

// A duel is about so many rows, decided at this many standard errors, and given up after so many rows.
constexpr double duel_memory = 500.0;
constexpr double duel_t = 3.0;
constexpr Eigen::Index duel_rows = 20000;
constexpr Eigen::Index duel_interval = 25;

// A split is taken back if as many new rows as decided it, and again, tell no difference at this level.
constexpr double pruning_level = 0.01;

// So many rows beside a threshold tell whether it should move: by how many standard errors of what that gains.
constexpr Eigen::Index watch_rows = 200;
constexpr Eigen::Index watch_interval = 50;
constexpr double watch_t = 4.0;

// Models are solved for anew when their rows have grown by this factor.
constexpr double solve_growth = 1.05;

double value_of(const StreamNode& node, const double* z) {
  double value = node.model(0);
  for (Eigen::Index k = 0; k < node.basis.origin.size(); ++k) {
    const double deviation = z[k] - node.basis.origin(k);
    value += deviation == deviation ? node.model(k + 1) * deviation : 0.0;
  }
  return value;
}

Eigen::Index leaves_of(const StreamNode& node) {
  return (node.is_leaf() ? 1 : leaves_of(*node.children[0]) + leaves_of(*node.children[1])) +
         (node.alternate ? leaves_of(*node.alternate) : 0);
}

Eigen::Index bytes_of(const StreamNode& node) {
  std::size_t doubles = 3 * node.model.size() + 3 * node.low.size();
  for (const Sums* sums : {&node.sums, &node.sides[0], &node.sides[1]}) {
    doubles += sums->gram.capacity();
  }
  Eigen::Index bytes = static_cast<Eigen::Index>(sizeof(StreamNode) + doubles * sizeof(double));
  bytes += node.search ? node.search->bytes() : 0;
  for (const StreamNode* below : {node.children[0].get(), node.children[1].get(), node.alternate.get()}) {
    bytes += below != nullptr ? bytes_of(*below) : 0;
  }
  return bytes;
}

}  // namespace

bool RiseDetector::add(double absolute_error) {
  ++rows_;
  if (rows_ > settling) {
    const double multiple = absolute_error < largest * usual_ ? absolute_error / usual_ : largest;
    excess_ = std::max(0.0, excess_ + multiple - 1.0 - tolerated);
  }
  usual_ += (absolute_error - usual_) / std::min(static_cast<double>(rows_), memory);
  return excess_ > alarm;
}

void Duel::add(double first, double second) {
  ++rows_;
  const double keep = 1.0 - 1.0 / duel_memory;
  const double difference = first - second;
  weight_ = keep * weight_ + 1.0;
  mean_ += (difference - mean_) / weight_;
  square_ += (difference * difference - square_) / weight_;
}

double Duel::t() const {
  const double variance = square_ - mean_ * mean_;
  return variance > 0.0 ? mean_ / std::sqrt(variance / weight_) : 0.0;
}

double ThresholdWatch::add(double x, double squared_left, double squared_right) {
  const double width = reach_ / static_cast<double>(half);
  const double position = (x - threshold_) / width + static_cast<double>(half);
  const std::size_t bin = std::min(2 * half - 1, static_cast<std::size_t>(std::max(0.0, position)));
  const double difference = squared_left - squared_right;
  sums_[bin] += difference;
  squares_[bin] += difference * difference;
  ++rows_;
  if (rows_ < watch_rows && rows_ % watch_interval != 0) return threshold_;
  // Rows between the threshold and a better one are on the wrong side: of all edges the one that gains most.
  double most = 0.0;
  double to = threshold_;
  for (const int sign : {1, -1}) {
    double gain = 0.0;
    double square = 0.0;
    for (std::size_t k = 0; k < half; ++k) {
      const std::size_t at = sign > 0 ? half + k : half - 1 - k;
      gain -= sign * sums_[at];
      square += squares_[at];
      if (gain > most && gain > watch_t * std::sqrt(square)) {
        most = gain;
        to = threshold_ + sign * static_cast<double>(k + 1) * width;
      }
    }
  }
  if (to != threshold_) {
    *this = ThresholdWatch(to, reach_);
  } else if (rows_ >= watch_rows) {
    *this = ThresholdWatch(to, 0.5 * reach_);  // it stays, and is looked at more closely
  }
  return to;
}

Sums all_sums(const StreamSetting& setting, const StreamNode& node) {
  Sums sums = node.sums;
  if (!node.is_leaf()) {
    sums.add(setting.shape, node.sides[0]);
    sums.add(setting.shape, node.sides[1]);
  }
  return sums;
}

Eigen::VectorXd own_model(const StreamSetting& setting, const StreamNode& node, int& rank) {
  return node.basis.base + solve(setting.shape, all_sums(setting, node).gram.data(), setting.options.shrinkage, rank);
}

StreamTree::StreamTree(const StreamSetting& setting, const Eigen::VectorXd& first_model)
    : setting_(setting), products_(setting.shape), residuals_(setting.shape, Eigen::VectorXd::Ones(1)) {
  root_ = make_node({Eigen::VectorXd::Zero(setting.inputs), first_model});
}

std::unique_ptr<StreamNode> StreamTree::make_node(Basis basis) const {
  auto node = std::make_unique<StreamNode>();
  node->model = basis.base;
  node->basis = std::move(basis);
  node->sums.gram.assign(setting_.shape.size(), 0.0);
  node->low.setConstant(setting_.inputs, std::numeric_limits<double>::infinity());
  node->high = -node->low;
  return node;
}

double StreamTree::predict(const StreamRow& row) const { return predict(*root_, row); }

double StreamTree::predict(const StreamNode& top, const StreamRow& row) {
  const StreamNode* node = &top;
  while (!node->is_leaf()) {
    node = node->children[side_of(*node, row.x[node->input])].get();
  }
  return value_of(*node, row.z);
}

double StreamTree::learn(const StreamRow& row) { return learn(root_, row, !setting_.detect_drift); }

// `watched`: an alternate grows at or above the node already, no alarm is needed.
double StreamTree::learn(std::unique_ptr<StreamNode>& slot, const StreamRow& row, bool watched) {
  StreamNode& node = *slot;
  for (Eigen::Index k = 0; k < setting_.inputs; ++k) {
    node.low(k) = row.x[k] < node.low(k) ? row.x[k] : node.low(k);
    node.high(k) = row.x[k] > node.high(k) ? row.x[k] : node.high(k);
  }
  const bool watched_here = watched || node.alternate;
  const Eigen::Index alarms = alarms_;
  double error = 0.0;
  if (node.is_leaf()) {
    error = row.y - value_of(node, row.z);
    learn_leaf(node, row);
  } else {
    const std::size_t side = side_of(node, row.x[node.input]);
    products_.set(node.basis, row.z, row.y, row.weight);
    products_.add_to(node.sides[side]);
    const bool beside = node.watch.concerns(row.x[node.input]);
    const double other = beside ? row.y - predict(*node.children[1 - side], row) : 0.0;
    error = learn(node.children[side], row, watched_here);
    if (beside) {
      const double squared = error * error;
      node.threshold = side == 0 ? node.watch.add(row.x[node.input], squared, other * other)
                                 : node.watch.add(row.x[node.input], other * other, squared);
    }
    if (node.sides[0].rows + node.sides[1].rows >= node.epoch) {
      end_epoch(node, row.different);
    }
  }
  if (alarms_ != alarms) {
    node.rise.reset();  // what has risen is known
  } else if (node.rise.add(std::abs(error)) && !watched_here) {
    ++alarms_;
    ++counts_.drifts;
    if (on_drift) {
      on_drift([&](const double* x) {
        const StreamNode* at = root_.get();
        while (at != &node && !at->is_leaf()) {
          at = at->children[side_of(*at, x[at->input])].get();
        }
        return at == &node;
      });
    }
    restart(node);
    Basis basis = node.basis;
    basis.base = node.model;
    node.alternate = make_node(std::move(basis));
    node.duel = {};
    recount();
    return error;
  }
  if (node.alternate) {
    const double other = learn(node.alternate, row, true);
    node.duel.add(std::abs(error), std::abs(other));
    settle(slot);
  }
  return error;
}

void StreamTree::learn_leaf(StreamNode& leaf, const StreamRow& row) {
  products_.set(leaf.basis, row.z, row.y, row.weight);
  products_.add_to(leaf.sums);
  if (static_cast<double>(leaf.sums.rows) >= solve_growth * static_cast<double>(leaf.solved_at)) {
    leaf.solved_at = leaf.sums.rows;
    if (row.different * static_cast<double>(leaf.sums.rows) >= static_cast<double>(2 * setting_.coefficients())) {
      int rank = 0;
      leaf.model = leaf.basis.base + solve(setting_.shape, leaf.sums.gram.data(), setting_.options.shrinkage, rank);
    }
  }
  if (counts_.leaves >= setting_.options.max_leaves) {
    leaf.search.reset();
    return;
  }
  if (!leaf.search) {
    leaf.search = std::make_unique<LeafSearch>(setting_);
  }
  leaf.search->add(row, leaf.basis, products_);
  if (const std::optional<StreamSplit> found = leaf.search->test(leaf.low, leaf.high, row.different)) {
    split(leaf, *found);
  }
}

void StreamTree::split(StreamNode& leaf, const StreamSplit& found) {
  leaf.search.reset();
  int rank = 0;
  const Eigen::VectorXd change = solve(setting_.shape, leaf.sums.gram.data(), setting_.options.shrinkage, rank);
  leaf.model = leaf.basis.base + change;
  leaf.input = found.input;
  leaf.threshold = found.threshold;
  leaf.watch = {found.threshold, found.reach};
  leaf.gain = found.gain;
  leaf.epoch = 2 * (found.left.rows + found.right.rows);
  for (std::size_t side = 0; side < 2; ++side) {
    leaf.sides[side] = found.left;
    leaf.sides[side].clear();
    const Sums& sums = side == 0 ? found.left : found.right;
    Eigen::VectorXd shift(setting_.inputs);
    for (Eigen::Index k = 0; k < setting_.inputs; ++k) {
      shift(k) = sums.gram[setting_.shape.at(k + 1, 0)] / sums.gram[0];
    }
    auto child = make_node({leaf.basis.origin + shift, shifted_model(leaf.model, shift)});
    child->sums = sums;
    rebase(setting_.shape, shift, change, child->sums.gram);
    child->solved_at = sums.rows;
    child->model = child->basis.base + solve(setting_.shape, child->sums.gram.data(), setting_.options.shrinkage, rank);
    child->low = leaf.low;
    child->high = leaf.high;
    (side == 0 ? child->high : child->low)(found.input) = found.threshold;
    leaf.children[side] = std::move(child);
  }
  ++counts_.splits;
  recount();
}

// The split of a node above two leaves is tested on the rows of the epoch: one model against two.
void StreamTree::end_epoch(StreamNode& node, double different) {
  Sums both = node.sides[0];
  both.add(setting_.shape, node.sides[1]);
  const bool last = node.children[0]->is_leaf() && node.children[1]->is_leaf() && !node.children[0]->alternate &&
                    !node.children[1]->alternate;
  if (last) {
    const std::array<const double*, 3> grams = {both.gram.data(), node.sides[0].gram.data(), node.sides[1].gram.data()};
    std::array<double, 3> rss{};
    std::array<int, 3> rank{};
    residuals_.evaluate(grams.data(), 3, rss.data(), rank.data());
    const double added = rank[1] + rank[2] - rank[0];
    const double freedom = different * static_cast<double>(both.rows) - rank[1] - rank[2];
    const double two = rss[1] + rss[2];
    const double f = ((rss[0] - two) / std::max(1.0, added)) / (two / std::max(1.0, freedom));
    if (freedom > 0.0 && !(f_survival(f, std::max(1.0, added), freedom) < pruning_level)) {
      node.sums.add(setting_.shape, both);
      node.children = {};
      node.sides = {};
      node.input = -1;
      node.solved_at = 0;
      int rank_of_model = 0;
      node.model = own_model(setting_, node, rank_of_model);
      ++counts_.prunes;
      recount();
      return;
    }
  }
  node.sums.add(setting_.shape, both);
  node.sides[0].clear();
  node.sides[1].clear();
  node.epoch *= 2;
}

// The alternate takes the place of the branch, or goes.
void StreamTree::settle(std::unique_ptr<StreamNode>& slot) {
  StreamNode& node = *slot;
  if (node.duel.rows() % duel_interval != 0 || node.duel.rows() < 2 * setting_.coefficients()) {
    return;
  }
  const double t = node.duel.t();
  if (t > duel_t) {
    slot = std::move(node.alternate);
    ++counts_.replacements;
    recount();
  } else if (node.duel.rows() >= duel_rows) {
    node.alternate.reset();
    recount();
  }
}

// Everything at and below the node counts as if it came from few rows.
void StreamTree::restart(StreamNode& node) const {
  const Eigen::Index kept = 2 * setting_.coefficients();
  if (!node.is_leaf()) {
    node.sums.add(setting_.shape, node.sides[0]);
    node.sums.add(setting_.shape, node.sides[1]);
    node.sides[0].clear();
    node.sides[1].clear();
    restart(*node.children[0]);
    restart(*node.children[1]);
  }
  if (node.sums.rows > kept) {
    const double factor = static_cast<double>(kept) / static_cast<double>(node.sums.rows);
    for (double& sum : node.sums.gram) {
      sum *= factor;
    }
    node.sums.rows = kept;
  }
  node.solved_at = 0;
  node.search.reset();
  node.rise.reset();
  node.alternate.reset();
}

void StreamTree::recount() { counts_.leaves = leaves_of(*root_); }

Eigen::Index StreamTree::bytes() const { return bytes_of(*root_); }

}  // namespace llmt
