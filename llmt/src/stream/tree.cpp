#include "stream/tree.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "numerics/f_distribution.hpp"

namespace llmt {
namespace {

// An alternate takes the place of its branch if its errors are smaller by 3 standard errors. The comparison is made
// every 25 rows. After 20000 rows the alternate is dropped.
constexpr double duel_t = 3.0;
constexpr Eigen::Index duel_interval = 25;
constexpr Eigen::Index duel_rows = 20000;

// A split is taken back if the rows of an epoch do not show at this level that two models are better than one.
constexpr double pruning_level = 0.01;

// The first epoch has twice the rows that decided the split; each further epoch is twice as long as the one before.
constexpr Eigen::Index epoch_growth = 2;

// Models are solved for anew when their number of rows has grown by this factor.
constexpr double solve_growth = 1.05;

}  // namespace

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

double StreamTree::predict(const StreamRow& row) const { return llmt::predict(*root_, row); }

double StreamTree::learn(const StreamRow& row) { return learn(root_, row, !setting_.detect_drift); }

// `watched`: an alternate grows at the node or above already, so no alarm is needed.
double StreamTree::learn(std::unique_ptr<StreamNode>& slot, const StreamRow& row, bool watched) {
  StreamNode& node = *slot;
  for (Eigen::Index k = 0; k < setting_.inputs; ++k) {
    node.low(k) = row.x[k] < node.low(k) ? row.x[k] : node.low(k);
    node.high(k) = row.x[k] > node.high(k) ? row.x[k] : node.high(k);
  }
  const bool watched_here = watched || node.alternate;
  const Eigen::Index alarms = counts_.drifts;
  double error = 0.0;
  if (node.is_leaf()) {
    error = row.y - value_of(node, row.z);
    learn_leaf(node, row);
  } else {
    error = learn_inner(node, row, watched_here);
  }
  if (counts_.drifts != alarms) {
    node.rise.reset();  // the rise has been found further below
  } else if (node.rise.add(std::abs(error)) && !watched_here) {
    raise_alarm(node);
    return error;
  }
  if (node.alternate) {
    const double other = learn(node.alternate, row, true);
    node.duel.add(std::abs(error), std::abs(other));
    settle(slot);
  }
  return error;
}

double StreamTree::learn_inner(StreamNode& node, const StreamRow& row, bool watched) {
  const double x = row.x[node.input];
  const std::size_t side = side_of(node, x);
  products_.set(node.basis, row.z, row.y, row.weight);
  products_.add_to(node.sides[side]);
  const bool near = node.watch.concerns(x);
  const double other = near ? row.y - llmt::predict(*node.children[1 - side], row) : 0.0;
  const double error = learn(node.children[side], row, watched);
  if (near) {
    const double squared = error * error;
    node.threshold = side == 0 ? node.watch.add(x, squared, other * other) : node.watch.add(x, other * other, squared);
  }
  if (node.sides[0].rows + node.sides[1].rows >= node.epoch) {
    end_epoch(node, row.different);
  }
  return error;
}

// The models of the branch restart, and an alternate begins to grow beside it.
void StreamTree::raise_alarm(StreamNode& node) {
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
}

void StreamTree::learn_leaf(StreamNode& leaf, const StreamRow& row) {
  products_.set(leaf.basis, row.z, row.y, row.weight);
  products_.add_to(leaf.sums);
  if (static_cast<double>(leaf.sums.rows) >= solve_growth * static_cast<double>(leaf.solved_at)) {
    leaf.solved_at = leaf.sums.rows;
    if (row.different * static_cast<double>(leaf.sums.rows) >=
        static_cast<double>(few_rows_per_coefficient * setting_.coefficients())) {
      int rank = 0;
      leaf.model = leaf.basis.base + solve(setting_.shape, leaf.sums.gram.data(), setting_.shrinkage, rank);
    }
  }
  if (counts_.leaves >= setting_.max_leaves) {
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
  const Eigen::VectorXd change = solve(setting_.shape, leaf.sums.gram.data(), setting_.shrinkage, rank);
  leaf.model = leaf.basis.base + change;
  leaf.input = found.input;
  leaf.threshold = found.threshold;
  leaf.watch = {found.threshold, found.reach};
  leaf.gain = found.gain;
  leaf.epoch = epoch_growth * (found.left.rows + found.right.rows);
  for (std::size_t side = 0; side < 2; ++side) {
    leaf.sides[side] = found.left;
    leaf.sides[side].clear();
    leaf.children[side] = make_child(leaf, change, side == 0 ? found.left : found.right);
  }
  leaf.children[0]->high(found.input) = found.threshold;
  leaf.children[1]->low(found.input) = found.threshold;
  ++counts_.splits;
  recount();
}

// A child that begins with the sums of its rows in the parent, about their mean. `change`: of the parent's model from
// its base.
std::unique_ptr<StreamNode> StreamTree::make_child(const StreamNode& parent, const Eigen::VectorXd& change,
                                                   const Sums& sums) const {
  Eigen::VectorXd shift(setting_.inputs);
  for (Eigen::Index k = 0; k < setting_.inputs; ++k) {
    shift(k) = sums.gram[setting_.shape.at(k + 1, 0)] / sums.gram[0];
  }
  auto child = make_node({parent.basis.origin + shift, shifted_model(parent.model, shift)});
  child->sums = sums;
  rebase(setting_.shape, shift, change, child->sums.gram);
  child->solved_at = sums.rows;
  int rank = 0;
  child->model = child->basis.base + solve(setting_.shape, child->sums.gram.data(), setting_.shrinkage, rank);
  child->low = parent.low;
  child->high = parent.high;
  return child;
}

void StreamTree::end_epoch(StreamNode& node, double different) {
  Sums both = node.sides[0];
  both.add(setting_.shape, node.sides[1]);
  const bool last = node.children[0]->is_leaf() && node.children[1]->is_leaf() && !node.children[0]->alternate &&
                    !node.children[1]->alternate;
  const bool undone = last && !is_needed(both, node.sides, different);
  node.sums.add(setting_.shape, both);
  if (undone) {
    undo_split(node);
    return;
  }
  node.sides[0].clear();
  node.sides[1].clear();
  node.epoch *= epoch_growth;
}

// Chow's test on the rows of an epoch: one model against two. A split is kept if there are too few rows for a test.
bool StreamTree::is_needed(const Sums& both, const std::array<Sums, 2>& sides, double different) {
  const std::array<const double*, 3> grams = {both.gram.data(), sides[0].gram.data(), sides[1].gram.data()};
  std::array<double, 3> rss{};
  std::array<int, 3> rank{};
  residuals_.evaluate(grams.data(), 3, rss.data(), rank.data());
  const double added = std::max(1.0, static_cast<double>(rank[1] + rank[2] - rank[0]));
  const double freedom = different * static_cast<double>(both.rows) - rank[1] - rank[2];
  if (!(freedom > 0.0)) return true;
  const double two = rss[1] + rss[2];
  const double variance = two / std::max(1.0, freedom);
  return chow_p_value(rss[0] - two, added, variance, freedom) < pruning_level;
}

void StreamTree::undo_split(StreamNode& node) {
  node.children = {};
  node.sides = {};
  node.input = -1;
  node.solved_at = 0;
  int rank = 0;
  node.model = own_model(setting_, node, rank);
  ++counts_.prunes;
  recount();
}

// Lets the alternate take the place of the branch, or drops it.
void StreamTree::settle(std::unique_ptr<StreamNode>& slot) {
  StreamNode& node = *slot;
  if (node.duel.rows() % duel_interval != 0 || node.duel.rows() < few_rows_per_coefficient * setting_.coefficients()) {
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

// Scales the sums of the branch down to the weight of few rows, so that new rows soon outweigh them.
void StreamTree::restart(StreamNode& node) const {
  const Eigen::Index kept = few_rows_per_coefficient * setting_.coefficients();
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
