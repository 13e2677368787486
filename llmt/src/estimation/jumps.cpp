#include "estimation/jumps.hpp"

#include <Eigen/QR>
#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "base/parallel.hpp"
#include "numerics/f_distribution.hpp"
#include "partition/evaluator.hpp"
#include "partition/imputed.hpp"

namespace llmt {
namespace {

// With more rows than this, jumps are measured on a sample.
constexpr Eigen::Index most_rows_measured = 200000;

// A band holds 20 % of the rows on the smaller side, at least 5 and at most 100 rows per coefficient of a local model.
// For the lower bound it takes at most half of that side: a wide band would measure curvature. With fewer than 10 rows
// the jump counts as 0.
constexpr double part_of_smaller_side = 0.2;
constexpr Eigen::Index least_rows_per_coefficient = 5;
constexpr Eigen::Index most_rows_per_coefficient = 100;
constexpr Eigen::Index least_rows = 10;

// The gap is a constant where one side of the band has fewer rows per coefficient than this.
constexpr Eigen::Index rows_per_coefficient_of_gap = 3;

// Bands are equally wide. On the side where rows lie denser a band holds at most this many times the wanted rows.
constexpr Eigen::Index densest = 4;

// The threshold is the best of many, so chance makes gaps. A gap counts as 0 if Chow's test, corrected for the search
// as in growth, does not reject at this level that there is none.
constexpr double significance = 0.05;

// Scatter below this part of the outputs' range is rounding.
constexpr double rounding_of_range = 1e-10;

// Columns of the gap below this part of the largest, after those of the continuous model are taken off, count as zero.
constexpr double least_part_of_gap = 1e-6;

// Rows of a node with a value of the split input, by their distance from the threshold.
struct Sides {
  std::vector<std::pair<double, int>> left;   // distance, position among the training rows
  std::vector<std::pair<double, int>> right;  // distances > 0
};

// The distance from the threshold that the `count` nearest rows reach, but at least the second distinct one; -1 if
// there is one distance only. Rows of equal distance belong together, so that the order of rows does not matter.
double reach(std::vector<std::pair<double, int>>& side, Eigen::Index count) {
  std::nth_element(side.begin(), side.begin() + (count - 1), side.end());
  const double last = side[count - 1].first;
  const double nearest = std::ranges::min_element(side)->first;
  double second = std::numeric_limits<double>::infinity();
  for (const auto& [distance, row] : side) {
    second = distance > nearest ? std::min(second, distance) : second;
  }
  return std::isfinite(second) ? std::max(last, second) : -1.0;
}

// The rows of the bands on both sides; empty if there are not enough different values.
std::vector<std::pair<double, int>> band(Sides& sides, Eigen::Index coefficients) {
  const Eigen::Index smaller = std::min(std::ssize(sides.left), std::ssize(sides.right));
  const Eigen::Index part = static_cast<Eigen::Index>(part_of_smaller_side * static_cast<double>(smaller));
  const Eigen::Index wanted = std::min(std::max(part, std::min(least_rows_per_coefficient * coefficients, smaller / 2)),
                                       most_rows_per_coefficient * coefficients);
  const double left = wanted >= least_rows ? reach(sides.left, wanted) : -1.0;
  const double right = wanted >= least_rows ? reach(sides.right, wanted) : -1.0;
  std::vector<std::pair<double, int>> rows;
  if (left < 0.0 || right < 0.0) return rows;
  for (auto* side : {&sides.left, &sides.right}) {
    const double most = reach(*side, std::min(std::ssize(*side), densest * wanted));
    const double width = std::min(std::max(left, right), most);
    for (const auto& [distance, row] : *side) {
      if (distance <= width) {
        rows.emplace_back(side == &sides.left ? -distance : distance, row);
      }
    }
  }
  std::ranges::sort(rows, [](const auto& a, const auto& b) { return a.second < b.second; });
  return rows;
}

// The regressors along the plane, if each side of the band has enough rows for a gap that depends on them.
std::vector<Eigen::Index> regressors_of_gap(const TrainingRows& training, const Node& node, Eigen::Index regressors,
                                            const std::vector<std::pair<double, int>>& rows) {
  const Eigen::Index on_left = std::ranges::count_if(rows, [](const auto& row) { return row.first <= 0.0; });
  const Eigen::Index fewer = std::min(on_left, std::ssize(rows) - on_left);
  std::vector<Eigen::Index> along;
  for (Eigen::Index k = 0; k < regressors && fewer >= rows_per_coefficient_of_gap * (regressors + 1); ++k) {
    if (training.regressors[k].input != node.split_input) along.push_back(k);
  }
  return along;
}

// The regression of the rows of a band; lines are multiplied by the root of the weight.
struct BandRegression {
  Eigen::MatrixXd plane;       // constant and regressors along the plane
  Eigen::MatrixXd continuous;  // columns of a continuous model with a kink at the threshold
  Eigen::MatrixXd jump;        // what a jump adds to them: `plane` on the right, 0 on the left
  Eigen::MatrixXd residuals;   // of the node's model, one column for each output
  double weight;               // of all rows
};

BandRegression regression(const TrainingRows& training, const Partition& grown, const Node& node,
                          const std::vector<std::pair<double, int>>& rows, const std::vector<Eigen::Index>& along) {
  std::vector<int> positions;
  double largest = 0.0;
  for (const auto& [distance, row] : rows) {
    positions.push_back(row);
    largest = std::max(largest, std::abs(distance));
  }
  const Chunk chunk = fetch(training, positions, grown.outputs);
  const Eigen::Index count = chunk.count();
  const Eigen::Index slopes = std::ssize(along);
  BandRegression result{Eigen::MatrixXd(count, 1 + slopes), Eigen::MatrixXd(count, 3 + slopes),
                        Eigen::MatrixXd::Zero(count, 1 + slopes), Eigen::MatrixXd(count, std::ssize(grown.outputs)),
                        chunk.weights.sum()};
  for (Eigen::Index i = 0; i < count; ++i) {
    const double root = std::sqrt(chunk.weights(i));
    const double distance = rows[i].first / largest;
    const Eigen::VectorXd deviations = imputed(node, chunk.deviations.row(i));
    result.residuals.row(i) = root * (chunk.outputs.row(i) - (node.value + node.slope * deviations).transpose());
    result.plane(i, 0) = root;
    for (Eigen::Index k = 0; k < slopes; ++k) {
      const Eigen::Index regressor = along[k];
      result.plane(i, 1 + k) = root * (deviations(regressor) - node.mean(regressor)) / training.scale(regressor);
    }
    result.continuous.row(i) << result.plane.row(i), root * distance, root * std::max(0.0, distance);
    if (distance > 0.0) {
      result.jump.row(i) = result.plane.row(i);
    }
  }
  return result;
}

// Eq. (V.4), the mean over the outputs. `candidates`: thresholds among which growth chose.
double root_mean_square_gap(BandRegression band, const std::vector<double>& least_scatter, double candidates) {
  // Project the other columns and the residuals onto the complement of the continuous model.
  const Eigen::ColPivHouseholderQR<Eigen::MatrixXd> first(band.continuous);
  for (Eigen::MatrixXd* columns : {&band.jump, &band.residuals}) {
    columns->applyOnTheLeft(first.householderQ().adjoint());
    columns->topRows(first.rank()).setZero();
  }
  Eigen::ColPivHouseholderQR<Eigen::MatrixXd> second(band.jump);
  second.setThreshold(least_part_of_gap);
  const Eigen::Index rank = second.rank();
  const Eigen::Index count = band.residuals.rows();
  const Eigen::Index freedom = count - first.rank() - rank;
  if (rank == 0 || freedom < 1) return 0.0;
  band.residuals.applyOnTheLeft(second.householderQ().adjoint());
  // The gap on the plane is plane * inverse * the first rows of the residuals.
  Eigen::MatrixXd inverse = Eigen::MatrixXd::Identity(rank, rank);
  second.matrixR().topLeftCorner(rank, rank).triangularView<Eigen::Upper>().solveInPlace(inverse);
  const Eigen::MatrixXd to_gap = (band.plane * second.colsPermutation()).leftCols(rank) * inverse;
  double sum = 0.0;
  for (Eigen::Index o = 0; o < band.residuals.cols(); ++o) {
    const auto of_jump = band.residuals.col(o).head(rank);
    const double variance = band.residuals.col(o).tail(count - rank).squaredNorm() / static_cast<double>(freedom) +
                            least_scatter[o] * least_scatter[o];
    const double p_value =
        chow_p_value(of_jump.squaredNorm(), static_cast<double>(rank), variance, static_cast<double>(freedom));
    if (p_value * candidates < significance) {
      const double gap = (to_gap * of_jump).squaredNorm() - variance * to_gap.squaredNorm();
      sum += std::max(0.0, gap / band.weight) / variance;
    }
  }
  return std::sqrt(sum / static_cast<double>(band.residuals.cols()));
}

double jump_size(const TrainingRows& training, const Partition& grown, const Node& node, Sides& sides) {
  // Products, which come last, matter little in a narrow band.
  const Eigen::Index regressors = std::ssize(training.regressors) - std::ssize(training.table->products);
  const std::vector<std::pair<double, int>> rows = band(sides, regressors + 1);
  if (rows.empty()) return 0.0;
  const std::vector<Eigen::Index> along = regressors_of_gap(training, node, regressors, rows);
  std::vector<double> least_scatter;
  for (const int output : grown.outputs) {
    const OutputColumn& column = training.output_columns[output];
    least_scatter.push_back(rounding_of_range * (column.high - column.low));
  }
  const double candidates = static_cast<double>(node.samples * std::ssize(training.table->split_inputs));
  return root_mean_square_gap(regression(training, grown, node, rows, along), least_scatter, candidates);
}

// The rows of a node that have a value of its split input.
Sides sides_of(const TrainingRows& training, const Partition& grown, int index,
               const std::vector<std::vector<int>>& rows_of_leaf) {
  const Node& node = grown.nodes[index];
  Sides sides;
  std::vector<int> open = {index};
  while (!open.empty()) {
    const Node& below = grown.nodes[open.back()];
    const std::vector<int>& rows = rows_of_leaf[open.back()];
    open.pop_back();
    if (!below.is_leaf()) {
      open.push_back(below.left);
      open.push_back(below.right);
    }
    for (const int row : rows) {
      const double distance = training.table->inputs(training.rows[row], node.split_input) - node.threshold;
      if (!std::isnan(distance)) {
        (distance > 0.0 ? sides.right : sides.left).emplace_back(std::abs(distance), row);
      }
    }
  }
  return sides;
}

// A missing value scatters the residual of its row by more than many splits jump. So only the rows without a missing
// value are taken if they are at least half of all.
TrainingRows rows_to_measure_on(const TrainingRows& all) {
  if (!all.table->inputs.hasNaN()) return all;
  TrainingRows complete = all;
  std::erase_if(complete.rows, [&](int row) { return all.table->inputs.row(row).hasNaN(); });
  return 2 * complete.count() >= all.count() ? complete : all;
}

}  // namespace

Eigen::VectorXd jump_sizes(const TrainingRows& all, const Partition& grown, int max_threads) {
  const TrainingRows training = subsample(rows_to_measure_on(all), most_rows_measured, max_threads);
  const Evaluator evaluator(grown, training.columns, std::ssize(training.regressors));
  std::vector<int> leaf_of_row(training.count(), 0);
  parallel_for(num_chunks(training), max_threads, [&](Eigen::Index index) {
    const Chunk chunk = fetch(training, index, {});
    for (Eigen::Index row = 0; row < chunk.count(); ++row) {
      int& leaf = leaf_of_row[index * block_rows + row];
      while (!grown.nodes[leaf].is_leaf()) leaf = evaluator.child_of(leaf, chunk.inputs.row(row).data());
    }
  });
  std::vector<std::vector<int>> rows_of_leaf(grown.nodes.size());  // their positions; empty for inner nodes
  for (int row = 0; row < std::ssize(leaf_of_row); ++row) rows_of_leaf[leaf_of_row[row]].push_back(row);
  Eigen::VectorXd sizes = Eigen::VectorXd::Zero(std::ssize(grown.nodes));
  parallel_for(std::ssize(grown.nodes), max_threads, [&](Eigen::Index index) {
    const Node& node = grown.nodes[index];
    const bool splits_by_presence = node.threshold == std::numeric_limits<double>::max();
    if (node.is_leaf() || !node.level_side.empty() || node.is_oblique() || splits_by_presence) return;
    Sides sides = sides_of(training, grown, static_cast<int>(index), rows_of_leaf);
    sizes(index) = jump_size(training, grown, node, sides);
  });
  return sizes;
}

}  // namespace llmt
