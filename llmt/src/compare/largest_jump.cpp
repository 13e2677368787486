#include <algorithm>
#include <cmath>
#include <limits>

#include "llmt/compare.hpp"
#include "model/codes.hpp"
#include "model/evaluator.hpp"

namespace llmt {
namespace {

constexpr Eigen::Index most_rows = 1000;

// Moves a row to either side of the plane of a node's split: along the split input, or in an oblique split
// orthogonally to the plane, every input measured by its training range. Inputs without a value stay.
std::pair<Eigen::VectorXd, Eigen::VectorXd> sides_of_plane(const Model& model, const Node& node,
                                                           const Eigen::VectorXd& row) {
  std::pair<Eigen::VectorXd, Eigen::VectorXd> sides{row, row};
  if (!node.is_oblique()) {
    sides.first(node.split_input) = node.threshold;
    sides.second(node.split_input) = std::nextafter(node.threshold, std::numeric_limits<double>::infinity());
    return sides;
  }
  Eigen::VectorXd way = Eigen::VectorXd::Zero(row.size());  // by which s grows by 1
  double side = 0.0;
  double scale = 0.0;
  for (Eigen::Index j = 0; j < row.size(); ++j) {
    const InputColumn& input = model.inputs()[j];
    if (node.direction(j) != 0.0 && !std::isnan(row(j))) {
      const double range = input.high - input.low;
      side += node.direction(j) * (row(j) - input.centre);
      scale += std::abs(node.direction(j)) * (range + std::abs(row(j)) + std::abs(input.centre));
      way(j) = node.direction(j) * range * range;
    }
  }
  const double square = node.direction.dot(way);
  if (square > 0.0) {
    // Far enough from the plane for rounding, too near for the local models to differ by it.
    const double step = 1e-12 * scale;
    sides.first += (node.threshold - step - side) / square * way;
    sides.second += (node.threshold + step - side) / square * way;
  }
  return sides;
}

}  // namespace

double largest_jump(const Model& model, const Eigen::Ref<const Eigen::MatrixXd>& told) {
  const Eigen::MatrixXd inputs = at_positions(model.inputs(), told);
  const Eigen::Index step = std::max<Eigen::Index>(1, (inputs.rows() + most_rows - 1) / most_rows);
  double largest = 0.0;
  for (const Partition& partition : model.partitions()) {
    const Evaluator evaluator(partition, model.inputs(), std::ssize(model.regressors()));
    // Rows just left and right of each split that may jump. Splits with a transition do not; Gaussians never do.
    std::vector<Eigen::VectorXd> left;
    std::vector<Eigen::VectorXd> right;
    for (Eigen::Index row = 0; row < inputs.rows() && partition.validity.kind != ValidityKind::gaussian; row += step) {
      const Eigen::VectorXd x = inputs.row(row).transpose();
      for (Eigen::Index index = 0; index >= 0;) {
        const Node& node = partition.nodes[index];
        if (node.is_leaf()) break;
        if (node.level_side.empty() && node.half_width == 0.0) {
          auto [first, second] = sides_of_plane(model, node, x);
          left.push_back(std::move(first));
          right.push_back(std::move(second));
        }
        if (!node.level_side.empty() || (!node.is_oblique() && std::isnan(x(node.split_input)))) {
          break;  // what lies below a set of levels has no plane of its own here
        }
        index = evaluator.child_of(static_cast<int>(index), x.data());
      }
    }
    if (left.empty()) continue;
    Eigen::MatrixXd at_left(std::ssize(left), model.num_inputs());
    Eigen::MatrixXd at_right(std::ssize(left), model.num_inputs());
    for (std::size_t k = 0; k < left.size(); ++k) {
      at_left.row(k) = left[k].transpose();
      at_right.row(k) = right[k].transpose();
    }
    const int output = partition.outputs.front();
    largest = std::max(
        largest, (model.predict(at_left).col(output) - model.predict(at_right).col(output)).cwiseAbs().maxCoeff());
  }
  return largest;
}

}  // namespace llmt
