#include "fit/equal_row_errors.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "estimation/squared_errors.hpp"

namespace llmt {
namespace {

// Sums of weighted squares, one entry an output, and of their weights.
struct Squares {
  Eigen::VectorXd sum;
  double weight = 0.0;
  Eigen::Index rows = 0;

  Eigen::VectorXd root_mean() const {
    if (weight > 0.0) return (sum / weight).cwiseSqrt();
    return Eigen::VectorXd::Constant(sum.size(), std::numeric_limits<double>::quiet_NaN());
  }
};

void add_errors(const Partition& partition, const FoldRows& fold, std::vector<int> rows, Squares& squares) {
  if (rows.empty()) return;
  const TrainingRows some = query_rows(*fold.held_out.table, std::move(rows), fold.training);
  const std::vector<Chunk> chunks = fetch_all(some, partition.outputs);
  for (Eigen::Index o = 0; o < squares.sum.size(); ++o) {
    const Eigen::VectorXd one = Eigen::VectorXd::Unit(squares.sum.size(), o);
    squares.sum(o) += squared_errors(partition, fold.training, chunks, one).sum();
  }
  for (const Chunk& chunk : chunks) squares.weight += chunk.weights.sum();
  squares.rows += some.count();
}

// The scatter of the rows of a kind about their mean, over all kinds.
Eigen::VectorXd scatter(const Table& table, const std::vector<int>& kind, const std::vector<int>& outputs) {
  const Eigen::Index kinds = *std::ranges::max_element(kind) + 1;
  const Eigen::Index rows = std::ssize(kind);
  Eigen::VectorXd weight = Eigen::VectorXd::Zero(kinds);
  for (Eigen::Index i = 0; i < rows; ++i) weight(kind[i]) += table.weights(i);
  Eigen::VectorXd result(std::ssize(outputs));
  for (std::size_t o = 0; o < outputs.size(); ++o) {
    const auto values = table.outputs.col(outputs[o]);
    Eigen::VectorXd mean = Eigen::VectorXd::Zero(kinds);
    for (Eigen::Index i = 0; i < rows; ++i) mean(kind[i]) += table.weights(i) / weight(kind[i]) * values(i);
    double squares = 0.0;
    for (Eigen::Index i = 0; i < rows; ++i) squares += table.weights(i) * std::pow(values(i) - mean(kind[i]), 2);
    const double freedom = static_cast<double>(rows - kinds) / static_cast<double>(rows);
    result(static_cast<Eigen::Index>(o)) = std::sqrt(squares / weight.sum() / freedom);
  }
  return result;
}

}  // namespace

std::optional<EqualRowErrors> equal_row_errors(const Training& training, const std::vector<Partition>& of_folds) {
  const std::vector<int>& kind = training.kept->kind;
  if (kind.empty() || of_folds.empty()) return std::nullopt;
  const std::vector<int>& outputs = of_folds.front().outputs;
  Squares of_new{Eigen::VectorXd::Zero(std::ssize(outputs))};
  Squares of_known = of_new;
  for (std::size_t f = 0; f < of_folds.size(); ++f) {
    const FoldRows& fold = training.folds[f];
    std::vector<bool> is_trained(kind.size(), false);
    for (const Eigen::Index row : training.kept->folds[f].train) is_trained[kind[row]] = true;
    std::vector<int> rows_new;
    std::vector<int> rows_known;
    for (const int row : fold.held_out.rows) (is_trained[kind[row]] ? rows_known : rows_new).push_back(row);
    add_errors(of_folds[f], fold, std::move(rows_new), of_new);
    add_errors(of_folds[f], fold, std::move(rows_known), of_known);
  }
  EqualRowErrors errors{.rmse_new = of_new.root_mean(),
                        .rmse_known = of_known.root_mean(),
                        .rows_new = of_new.rows,
                        .rows_known = of_known.rows};
  if (training.kept->has_repeats) errors.rmse_known = scatter(*training.table, kind, outputs);
  return errors;
}

}  // namespace llmt
