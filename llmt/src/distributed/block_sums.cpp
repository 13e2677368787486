#include "distributed/block_sums.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <stdexcept>

#include "base/parallel.hpp"
#include "data/row_hash.hpp"
#include "data/row_weight.hpp"
#include "stream/sums.hpp"

namespace llmt::distributed {
namespace {

// Blocks that are summed at a time.
constexpr Eigen::Index blocks_at_once = 4;

[[noreturn]] void refuse(const std::string& reason) {
  throw std::invalid_argument("llmt::distributed::sums: " + reason);
}

void check_rows(const Rows& rows, const StateData& data) {
  if (data.step == Step::finished) refuse("the fit is finished");
  if (rows.first_block < 0) refuse(fmt::format("first_block is {}, it must be at least 0", rows.first_block));
  if (rows.inputs.cols() != data.inputs()) {
    refuse(fmt::format("the rows have {} inputs, the fit has {}", rows.inputs.cols(), data.inputs()));
  }
  if (rows.inputs.rows() != rows.output.size()) {
    refuse(fmt::format("{} rows of inputs, {} of the output", rows.inputs.rows(), rows.output.size()));
  }
  if (rows.weights.size() != (data.is_weighted() ? rows.output.size() : 0)) {
    refuse(fmt::format("{} weights of {} rows, and the fit has {}", rows.weights.size(), rows.output.size(),
                       data.is_weighted() ? "weights" : "none: see Options::weighted"));
  }
}

bool is_level(const StateData& data, double value, Eigen::Index input) {
  return value >= 0.0 && value < static_cast<double>(data.levels[input].size()) && value == std::floor(value);
}

void check_value(const StateData& data, double value, Eigen::Index row, Eigen::Index column) {
  const bool is_output = column == data.inputs();
  const bool may_be_missing = !is_output && (data.step == Step::describe || data.rows <= data.options.branch_rows);
  if (may_be_missing && std::isnan(value)) return;
  const bool is_category = data.is_category(column);
  if (is_category ? is_level(data, value, column) : std::abs(value) <= largest_magnitude) return;
  refuse(fmt::format("row {}, column \"{}\" is {}, it must be {}", row,
                     to_string(is_output ? data.output_name : data.input_names[column]), value,
                     is_category
                         ? fmt::format("the number of a category: there are {}, from 0 on", data.levels[column].size())
                         : fmt::format("a number of at most {:g}", largest_magnitude)));
}

void check_weight(double weight, Eigen::Index row) {
  if (is_row_weight(weight)) return;
  refuse(fmt::format("row {}: the weight is {}, it must be {}", row, weight, words_of_row_weight));
}

Sample sample_of(const StateData& data, const Block& block) {
  std::vector<std::pair<std::uint64_t, Eigen::Index>> hashed;
  const std::uint64_t of_block = row_hash(0, static_cast<double>(block.number));
  for (Eigen::Index row = block.span.begin; row < block.span.end; ++row) {
    if (block.weight(row) == 0.0) continue;
    hashed.emplace_back(row_hash(of_block, static_cast<double>(row - block.span.begin)), row);
  }
  Sample sample;
  sample.most = data.options.sample_rows;
  const Eigen::Index kept = std::min(sample.most, std::ssize(hashed));
  std::ranges::nth_element(hashed, hashed.begin() + kept);
  hashed.resize(kept);
  std::ranges::sort(hashed);
  for (const auto& [hash, row] : hashed) {
    sample.hashes.push_back(hash);
    for (Eigen::Index column = 0; column < data.row_columns(); ++column) sample.values.push_back(block.at(row, column));
  }
  return sample;
}

void describe(const StateData& data, const Block& block, Description& sum) {
  const Eigen::Index columns = data.inputs() + 1;
  for (Eigen::Index row = block.span.begin; row < block.span.end; ++row) {
    const double weight = block.weight(row);
    check_weight(weight, row);
    if (weight == 0.0) continue;
    ++sum.rows;
    sum.weight += weight;
    sum.fractional += weight == std::floor(weight) ? 0 : 1;
  }
  sum.range.resize(columns);
  sum.total.assign(columns, 0.0);
  sum.missing.assign(data.inputs(), 0);
  for (Eigen::Index column = 0; column < columns; ++column) {
    for (Eigen::Index row = block.span.begin; row < block.span.end; ++row) {
      const double value = block.at(row, column);
      check_value(data, value, row, column);
      const double weight = block.weight(row);
      if (weight == 0.0) continue;
      if (std::isnan(value)) {
        ++sum.missing[column];
      } else {
        sum.range[column].widen(value);
        sum.total[column] += weight * value;
      }
    }
  }
  sum.sample = sample_of(data, block);
}

// Scales the rows of a pass and finds their nodes.
class Placed {
 public:
  explicit Placed(const StateData& data) : data_(data), numbers_(data.numbers()), z_(std::ssize(numbers_)) {
    if (data.nodes.front().fate != Fate::inner) return;
    int rank = 0;
    root_ = model_of(data, data.nodes.front(), rank);
  }

  /// Returns whether the row takes part.
  bool set(const Block& block, Eigen::Index row) {
    const Eigen::Index inputs = data_.inputs();
    for (Eigen::Index j = 0; j <= inputs; ++j) check_value(data_, block.at(row, j), row, j);
    check_weight(block.weight(row), row);
    if (block.weight(row) == 0.0) return false;
    weight_ = data_.weight_scale * block.weight(row);
    for (Eigen::Index k = 0; k < z_.size(); ++k) {
      const Eigen::Index j = numbers_[k];
      z_(k) = (block.rows.inputs(row, j) - data_.mean(j)) / data_.scale(j);
    }
    y_ = (block.rows.output(row) - data_.mean(inputs)) / data_.scale(inputs);
    node_ = 0;
    while (data_.nodes[node_].fate == Fate::inner) {
      const TopNode& node = data_.nodes[node_];
      const double value = block.rows.inputs(row, node.input);
      const bool is_left =
          node.level_side.empty() ? value <= node.threshold : node.level_side[static_cast<std::size_t>(value)] < 0;
      node_ = is_left ? node.left : node.right;
    }
    return true;
  }

  const Eigen::VectorXd& z() const { return z_; }
  double y() const { return y_; }
  double weight() const { return weight_; }
  Eigen::Index node() const { return node_; }

  void widen(Extent& root_residual) const {
    if (root_.size() == 0) return;
    root_residual.widen(data_.scale(data_.inputs()) * (y_ - root_(0) - root_.tail(z_.size()).dot(z_)));
  }

 private:
  const StateData& data_;
  std::vector<Eigen::Index> numbers_;
  Eigen::VectorXd root_;  // the root's model, once it is known
  Eigen::VectorXd z_;
  double y_ = 0.0;
  double weight_ = 1.0;
  Eigen::Index node_ = 0;
};

// Numbers of bins: the number of edges below a value, by bisection without branches; or a category's own number.
class BinFinder {
 public:
  BinFinder(const std::vector<double>& edges, bool is_category) : is_category_(is_category) {
    padded_.fill(std::numeric_limits<double>::infinity());
    std::ranges::copy(edges, padded_.begin());
  }

  Eigen::Index operator()(double value) const {
    if (is_category_) return static_cast<Eigen::Index>(value);
    std::size_t below = 0;
    for (std::size_t step = padded_.size() / 2; step > 0; step /= 2) {
      below += padded_[below + step - 1] < value ? step : 0;
    }
    return static_cast<Eigen::Index>(below);
  }

 private:
  bool is_category_;
  std::array<double, 256> padded_{};
};

void grow(const StateData& data, const Block& block, BlockSum& sum) {
  const GramShape shape = data.shape();
  const Eigen::Index inputs = data.inputs();
  const std::vector<Eigen::Index> first = first_bins(data);
  std::vector<BinFinder> finders;
  for (Eigen::Index j = 0; j < inputs; ++j) finders.emplace_back(data.edges[j], data.is_category(j));
  std::vector<NodeSums*> sums(data.nodes.size(), nullptr);
  std::vector<Basis> basis(data.nodes.size());
  const Eigen::Index regressors = shape.coefficients() - 1;
  for (const Eigen::Index node : data.asked) {
    basis[node] = {Eigen::VectorXd::Zero(regressors), data.nodes[node].base};
  }
  RowProducts products(shape);
  Placed placed(data);
  for (Eigen::Index row = block.span.begin; row < block.span.end; ++row) {
    if (!placed.set(block, row)) continue;
    placed.widen(sum.root_residual);
    const Eigen::Index node = placed.node();
    if (basis[node].base.size() == 0) continue;
    NodeSums*& of_node = sums[node];
    if (of_node == nullptr) {
      of_node = &sum.nodes[node];
      of_node->grams.assign(first.back() * shape.size(), 0.0);
      of_node->counts.assign(first.back(), 0);
      of_node->held_out.assign(shape.size(), 0.0);
      of_node->range.resize(regressors);
    }
    products.set(basis[node], placed.z().data(), placed.y(), placed.weight());
    for (Eigen::Index j = 0; j < inputs; ++j) {
      const Eigen::Index bin = first[j] + finders[j](block.rows.inputs(row, j));
      products.add_to(of_node->grams.data() + bin * shape.size());
      ++of_node->counts[bin];
    }
    for (Eigen::Index k = 0; k < regressors; ++k) of_node->range[k].widen(placed.z()(k));
    if (is_held_out(block.number)) products.add_to(of_node->held_out.data());
  }
}

void gather(const StateData& data, const Block& block, BlockSum& sum) {
  const Eigen::Index columns = data.row_columns();
  std::vector<std::vector<double>*> rows(data.nodes.size(), nullptr);
  Placed placed(data);
  for (Eigen::Index row = block.span.begin; row < block.span.end; ++row) {
    if (!placed.set(block, row)) continue;
    placed.widen(sum.root_residual);
    const Eigen::Index node = placed.node();
    if (!std::ranges::binary_search(data.asked, node)) continue;
    if (rows[node] == nullptr) rows[node] = &sum.branches[node].pieces.emplace_back();
    for (Eigen::Index column = 0; column < columns; ++column) rows[node]->push_back(block.at(row, column));
  }
}

void check_block(const StateData& data, const Block& block) {
  for (Eigen::Index row = block.span.begin; row < block.span.end; ++row) {
    for (Eigen::Index j = 0; j <= data.inputs(); ++j) check_value(data, block.at(row, j), row, j);
    check_weight(block.weight(row), row);
  }
}

std::uint64_t fingerprint_of(const StateData& data, const Block& block) {
  std::uint64_t sum = 0;
  for (Eigen::Index row = block.span.begin; row < block.span.end; ++row) {
    const auto place = static_cast<double>(row - block.span.begin);
    std::uint64_t hash = row_hash(static_cast<std::uint64_t>(block.number), place);
    for (Eigen::Index column = 0; column < data.row_columns(); ++column) hash = row_hash(hash, block.at(row, column));
    sum += hash;
  }
  return sum;
}

BlockSum sum_block(const StateData& data, const Block& block) {
  BlockSum sum;
  sum.fingerprint = fingerprint_of(data, block);
  if (data.step == Step::describe) describe(data, block, sum.description);
  if (data.step == Step::grow) grow(data, block, sum);
  if (data.step == Step::gather) gather(data, block, sum);
  if (data.step == Step::blend) {
    check_block(data, block);
    add_joint(data, block, sum.joint);
  }
  return sum;
}

}  // namespace

BranchRows& BranchRows::operator+=(BranchRows&& next) {
  std::ranges::move(next.pieces, std::back_inserter(pieces));
  return *this;
}

Sums sums(const Rows& rows, const State& state, int max_threads) {
  const StateData& data = state.data();
  check_rows(rows, data);
  auto result = std::make_unique<SumsData>();
  result->mark = data.mark;
  result->step = data.step;
  result->inputs = data.inputs();
  result->regressors = data.shape().coefficients() - 1;
  result->columns = data.row_columns();
  result->unknowns = data.step == Step::blend ? unknowns_of(data) : 0;
  result->bins = data.step == Step::describe ? 0 : first_bins(data).back();
  const RowBlocks blocks{rows.output.size(), data.options.block_rows};
  if (blocks.count() == 0) return Sums(std::move(result));
  Run run{rows.first_block, rows.first_block + blocks.count(), {}};
  for (Eigen::Index first = 0; first < blocks.count(); first += blocks_at_once) {
    std::vector<BlockSum> made(std::min(blocks_at_once, blocks.count() - first));
    parallel_for(std::ssize(made), max_threads, [&](Eigen::Index k) {
      made[k] = sum_block(data, {rows, blocks[first + k], rows.first_block + first + k});
    });
    for (Eigen::Index k = 0; k < std::ssize(made); ++k) run.sums.push(rows.first_block + first + k, std::move(made[k]));
  }
  result->runs.push_back(std::move(run));
  return Sums(std::move(result));
}

}  // namespace llmt::distributed
