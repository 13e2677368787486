#include "estimation/jumps.hpp"

#include <Eigen/QR>
#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "base/parallel.hpp"
#include "model/evaluator.hpp"
#include "numerics/f_distribution.hpp"

namespace llmt {
namespace {

// Rows of a band: this part of the smaller side, but so many per coefficient of a local model, and at most half a
// side: what is not narrow tells nothing.
constexpr double band_share = 0.2;
constexpr Eigen::Index least_rows_per_coefficient = 5;
constexpr Eigen::Index most_rows_per_coefficient = 100;
constexpr Eigen::Index least_rows = 10;

// Where one side has fewer rows per coefficient, the gap is a constant.
constexpr Eigen::Index rows_per_coefficient_of_gap = 3;

// A side on which rows lie denser may have this many times the rows of the other.
constexpr Eigen::Index densest = 4;

// The threshold is the best of many, so chance makes gaps: those more probable than this, by Chow's test corrected for
// the search as in growth, are none.
constexpr double significance = 0.05;

// Scatter below this part of the outputs' range is rounding.
constexpr double rounding = 1e-10;

// Rows of a node with a value of the split input, by their distance from the threshold.
struct Sides {
  std::vector<std::pair<double, int>> left;   // distance, position among the training rows
  std::vector<std::pair<double, int>> right;  // distances > 0
};

// How far from the threshold the `count` nearest rows reach; at least to the second distinct value. Ties stay
// together, so that the order of rows does not matter.
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
  const Eigen::Index share = static_cast<Eigen::Index>(band_share * static_cast<double>(smaller));
  const Eigen::Index wanted =
      std::min(std::max(share, std::min(least_rows_per_coefficient * coefficients, smaller / 2)),
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

double jump_size(const TrainingRows& training, const Partition& grown, const Node& node, Sides& sides) {
  // Products, which come last, matter little in a narrow band.
  const Eigen::Index regressors = std::ssize(training.regressors) - std::ssize(training.table->products);
  const std::vector<std::pair<double, int>> rows = band(sides, regressors + 1);
  Eigen::Index on_left = 0;
  std::vector<int> positions;
  for (const auto& [distance, row] : rows) {
    on_left += distance <= 0.0 ? 1 : 0;
    positions.push_back(row);
  }
  // The regressors along the plane, where rows are enough for a gap that depends on them.
  std::vector<Eigen::Index> along;
  const Eigen::Index fewer = std::min(on_left, std::ssize(rows) - on_left);
  for (Eigen::Index k = 0; k < regressors && fewer >= rows_per_coefficient_of_gap * (regressors + 1); ++k) {
    if (training.regressors[k].input != node.split_input) {
      along.push_back(k);
    }
  }
  const Chunk chunk = fetch(training, positions, grown.outputs);
  const Eigen::Index count = chunk.count();
  const Eigen::Index slopes = std::ssize(along);
  double largest = 0.0;
  for (const auto& [distance, row] : rows) {
    largest = std::max(largest, std::abs(distance));
  }
  // A continuous model with a kink at the threshold, and what a jump adds to it.
  Eigen::MatrixXd continuous(count, 3 + slopes);
  Eigen::MatrixXd jump = Eigen::MatrixXd::Zero(count, 1 + slopes);
  Eigen::MatrixXd plane(count, 1 + slopes);
  Eigen::MatrixXd residuals(count, std::ssize(grown.outputs));
  for (Eigen::Index i = 0; i < count; ++i) {
    const double root = std::sqrt(chunk.weights(i));
    const double distance = rows[i].first / largest;
    Eigen::RowVectorXd deviations = chunk.deviations.row(i);
    deviations = deviations.array().isNaN().select(node.mean.transpose(), deviations);
    residuals.row(i) = root * (chunk.outputs.row(i) - (node.value + node.slope * deviations.transpose()).transpose());
    plane(i, 0) = root;
    for (Eigen::Index k = 0; k < slopes; ++k) {
      const Eigen::Index regressor = along[k];
      plane(i, 1 + k) = root * (deviations(regressor) - node.mean(regressor)) / training.scale(regressor);
    }
    continuous.row(i) << plane.row(i), root * distance, root * std::max(0.0, distance);
    if (distance > 0.0) {
      jump.row(i) = plane.row(i);
    }
  }
  // What the continuous model leaves of the other columns, and of the residuals.
  const Eigen::ColPivHouseholderQR<Eigen::MatrixXd> first(continuous);
  for (Eigen::MatrixXd* columns : {&jump, &residuals}) {
    columns->applyOnTheLeft(first.householderQ().adjoint());
    columns->topRows(first.rank()).setZero();
  }
  Eigen::ColPivHouseholderQR<Eigen::MatrixXd> second(jump);
  second.setThreshold(1e-6);
  const Eigen::Index rank = second.rank();
  const Eigen::Index free = count - first.rank() - rank;
  if (rank == 0 || free < 1) return 0.0;
  residuals.applyOnTheLeft(second.householderQ().adjoint());
  // The gap on the plane is plane * inverse * the first rows of the residuals.
  Eigen::MatrixXd inverse = Eigen::MatrixXd::Identity(rank, rank);
  second.matrixR().topLeftCorner(rank, rank).triangularView<Eigen::Upper>().solveInPlace(inverse);
  const Eigen::MatrixXd kept = (plane * second.colsPermutation()).leftCols(rank) * inverse;
  const double weight = chunk.weights.sum();
  const double candidates = static_cast<double>(node.samples * std::ssize(training.table->split_inputs));
  double size = 0.0;
  for (Eigen::Index o = 0; o < residuals.cols(); ++o) {
    const OutputColumn& output = training.output_columns[grown.outputs[o]];
    const double least = rounding * (output.high - output.low);
    const double variance =
        residuals.col(o).tail(count - rank).squaredNorm() / static_cast<double>(free) + least * least;
    const double f = residuals.col(o).head(rank).squaredNorm() / static_cast<double>(rank) / variance;
    if (f_survival(f, static_cast<double>(rank), static_cast<double>(free)) * candidates < significance) {
      const double gap = (kept * residuals.col(o).head(rank)).squaredNorm() - variance * kept.squaredNorm();
      size += std::max(0.0, gap / weight) / variance;
    }
  }
  return std::sqrt(size / static_cast<double>(residuals.cols()));
}

// A jump that so many rows do not show is not worth keeping.
constexpr Eigen::Index enough_rows = 200000;

}  // namespace

Eigen::VectorXd jump_sizes(const TrainingRows& all, const Partition& grown, int max_threads) {
  const TrainingRows training = thinned(all, enough_rows);
  const Evaluator evaluator(grown, training.columns, std::ssize(training.regressors));
  std::vector<std::vector<int>> of_node(grown.nodes.size());  // positions of the rows in its box
  for (Eigen::Index index = 0; index < num_chunks(training); ++index) {
    const Chunk chunk = fetch(training, index, {});
    for (Eigen::Index row = 0; row < chunk.count(); ++row) {
      int leaf = 0;
      while (!grown.nodes[leaf].is_leaf()) {
        leaf = evaluator.child_of(leaf, chunk.inputs.row(row).data());
      }
      of_node[leaf].push_back(static_cast<int>(index * chunk_rows + row));
    }
  }
  Eigen::VectorXd sizes = Eigen::VectorXd::Zero(std::ssize(grown.nodes));
  parallel_for(std::ssize(grown.nodes), max_threads, [&](Eigen::Index index) {
    const Node& node = grown.nodes[index];
    if (node.is_leaf() || !node.level_side.empty() || node.is_oblique() ||
        node.threshold == std::numeric_limits<double>::max()) {
      return;
    }
    Sides sides;
    std::vector<int> open = {static_cast<int>(index)};
    while (!open.empty()) {
      const Node& below = grown.nodes[open.back()];
      const std::vector<int>& rows = of_node[open.back()];
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
    sizes(index) = jump_size(training, grown, node, sides);
  });
  return sizes;
}

}  // namespace llmt
