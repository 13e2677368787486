#include "oracles/predict_oracle.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace oracle {
namespace {

bool is_number_split(const llmt::Node& node) { return node.level_side.empty(); }

// The value of an input, where it is missing that of the level for it, if there is one.
double value_of(const llmt::Model& model, int input, const Eigen::VectorXd& row) {
  const std::vector<std::string>& levels = model.inputs()[input].levels;
  const bool is_level = std::isnan(row(input)) && !levels.empty() && levels.back().empty();
  return is_level ? static_cast<double>(levels.size()) - 1.0 : row(input);
}

// What a split compares.
double side(const llmt::Model& model, const llmt::Node& node, const Eigen::VectorXd& row) {
  if (node.direction.size() == 0) return value_of(model, node.split_input, row);
  double sum = 0.0;
  for (Eigen::Index j = 0; j < row.size(); ++j) {
    const double centre = model.inputs()[j].centre;
    sum += node.direction(j) == 0.0 || std::isnan(row(j)) ? 0.0 : node.direction(j) * (row(j) - centre);
  }
  return sum;
}

double share_of_left(const llmt::Model& model, const llmt::Partition& partition, const llmt::Node& node,
                     const Eigen::VectorXd& row) {
  const double x = side(model, node, row);
  if (!is_number_split(node)) {
    const bool known = x >= 0.0 && x < static_cast<double>(node.level_side.size());
    const int side = known ? node.level_side[static_cast<std::size_t>(x)] : 0;
    return side == 0 ? node.missing_left : side < 0 ? 1.0 : 0.0;
  }
  if (std::isnan(x)) return node.missing_left;
  if (node.half_width == 0.0) return x <= node.threshold ? 1.0 : 0.0;
  const double u = (x - node.threshold) / node.half_width;
  if (partition.validity.kind == llmt::ValidityKind::logistic) return 1.0 / (1.0 + std::exp(u));
  const double v = (std::clamp(u, -1.0, 1.0) + 1.0) / 2.0;
  return 1.0 - v * v * (3.0 - 2.0 * v);
}

void share(const llmt::Model& model, const llmt::Partition& partition, int index, double validity,
           const Eigen::VectorXd& row, std::vector<double>& result) {
  const llmt::Node& node = partition.nodes[index];
  if (node.is_leaf()) {
    result[index] = validity;
    return;
  }
  const double left = share_of_left(model, partition, node, row);
  share(model, partition, node.left, validity * left, row, result);
  share(model, partition, node.right, validity * (1.0 - left), row, result);
}

void share_gaussians(const llmt::Model& model, Eigen::Index index, const Eigen::VectorXd& row,
                     std::vector<double>& result) {
  const llmt::Partition& partition = model.partitions()[index];
  const std::vector<llmt::Leaf> leaves = model.leaves(index);
  Eigen::VectorXd exponent = Eigen::VectorXd::Zero(std::ssize(leaves));
  for (const llmt::Node& node : partition.nodes) {
    if (node.is_leaf() || !is_number_split(node) || std::isnan(row(node.split_input))) continue;
    const Eigen::Index j = node.split_input;
    const llmt::InputColumn& input = model.inputs()[j];
    for (std::size_t i = 0; i < leaves.size(); ++i) {
      const double low = std::max(leaves[i].low(j), input.low);
      const double high = std::min(leaves[i].high(j), input.high);
      const double z = (row(j) - 0.5 * (low + high)) / (partition.validity.width * (high - low));
      // An input that is split several times counts once.
      const bool first = &node == &*std::ranges::find_if(
                                      partition.nodes, [&](const llmt::Node& other) { return other.split_input == j; });
      exponent(i) -= first ? 0.5 * z * z : 0.0;
    }
  }
  const double largest = exponent.maxCoeff();
  const Eigen::VectorXd mu = (exponent.array() - largest < -40.0).select(0.0, (exponent.array() - largest).exp());
  for (std::size_t i = 0; i < leaves.size(); ++i) {
    result[leaves[i].node] = mu(i) / mu.sum();
  }
}

double hold(double z, double low, double high) {
  const double r = (high - low) / 10.0;
  if (z > high) return z < high + r ? z - (z - high) * (z - high) / (2.0 * r) : high + r / 2.0;
  if (z < low) return z > low - r ? z + (z - low) * (z - low) / (2.0 * r) : low - r / 2.0;
  return z;
}

Eigen::VectorXd held(const llmt::Node& node, const Eigen::VectorXd& deviations) {
  Eigen::VectorXd result(deviations.size());
  for (Eigen::Index k = 0; k < deviations.size(); ++k) {
    result(k) = std::isnan(deviations(k)) ? node.mean(k) : hold(deviations(k), node.low(k), node.high(k));
  }
  return result;
}

int parent_of(const llmt::Partition& partition, int index) {
  return static_cast<int>(
      std::distance(partition.nodes.begin(), std::ranges::find_if(partition.nodes, [&](const llmt::Node& other) {
                      return other.left == index || other.right == index;
                    })));
}

Eigen::VectorXd local(const llmt::Partition& partition, int leaf, const Eigen::VectorXd& deviations) {
  const llmt::Node& node = partition.nodes[leaf];
  Eigen::VectorXd below = held(node, deviations);
  Eigen::VectorXd value = node.value + node.slope * below;
  int asked = 0;
  for (int index = leaf; index > 0; ++asked) {
    const int parent = asked >= 64 ? 0 : parent_of(partition, index);
    const llmt::Node& ancestor = partition.nodes[parent];
    const Eigen::VectorXd reached = deviations.array().isNaN().select(below, held(ancestor, deviations));
    value += ancestor.slope * (reached - below);
    below = reached;
    index = parent;
  }
  return value;
}

}  // namespace

Eigen::VectorXd deviations(const llmt::Model& model, const Eigen::VectorXd& row) {
  const auto factor = [&](int j) {
    const llmt::InputColumn& input = model.inputs()[j];
    return hold(row(j) - input.centre, input.low - input.centre, input.high - input.centre);
  };
  Eigen::VectorXd result(std::ssize(model.regressors()));
  for (std::size_t k = 0; k < model.regressors().size(); ++k) {
    const llmt::Regressor& regressor = model.regressors()[k];
    const double x = value_of(model, regressor.input, row);
    double& deviation = result(k);
    if (regressor.second_input >= 0) {
      deviation = factor(regressor.input) * factor(regressor.second_input) - regressor.centre;
    } else if (regressor.level < 0) {
      deviation = x - regressor.centre;
    } else {
      const std::size_t levels = model.inputs()[regressor.input].levels.size();
      const bool known = x >= 0.0 && x < static_cast<double>(levels);
      deviation = known ? (x == regressor.level ? 1.0 : 0.0) - regressor.centre : std::nan("");
    }
  }
  return result;
}

std::vector<double> validities(const llmt::Model& model, const llmt::Partition& partition, const Eigen::VectorXd& row) {
  std::vector<double> result(partition.nodes.size(), 0.0);
  if (partition.validity.kind == llmt::ValidityKind::gaussian) {
    share_gaussians(model, &partition - model.partitions().data(), row, result);
  } else {
    share(model, partition, 0, 1.0, row, result);
  }
  return result;
}

Eigen::VectorXd predict(const llmt::Model& model, const Eigen::VectorXd& row) {
  Eigen::VectorXd result(model.num_outputs());
  const Eigen::VectorXd d = deviations(model, row);
  for (const llmt::Partition& partition : model.partitions()) {
    const llmt::Node& root = partition.nodes.front();
    const std::vector<double> validity = validities(model, partition, row);
    Eigen::VectorXd value = Eigen::VectorXd::Zero(root.value.size());
    for (std::size_t i = 0; i < validity.size(); ++i) {
      if (validity[i] > 0.0) {
        value += validity[i] * local(partition, static_cast<int>(i), d);
      }
    }
    const Eigen::VectorXd c = held(root, d);
    const Eigen::VectorXd of_root = root.value + root.slope * c;
    for (Eigen::Index o = 0; o < partition.residual_range.rows(); ++o) {
      const double margin = 0.1 * (partition.residual_range(o, 1) - partition.residual_range(o, 0));
      value(o) = of_root(o) + hold(value(o) - of_root(o), partition.residual_range(o, 0) - margin,
                                   partition.residual_range(o, 1) + margin);
    }
    value += (partition.outer_slope.size() > 0 ? partition.outer_slope : root.slope) *
             d.array().isNaN().select(0.0, d - c).matrix();
    for (Eigen::Index o = 0; o < partition.output_range.rows(); ++o) {
      value(o) = std::min(std::max(value(o), partition.output_range(o, 0)), partition.output_range(o, 1));
    }
    for (std::size_t o = 0; o < partition.outputs.size(); ++o) {
      result(partition.outputs[o]) = value(o);
    }
  }
  return result;
}

Eigen::MatrixXd predict_rows(const llmt::Model& model, const Eigen::MatrixXd& rows) {
  Eigen::MatrixXd result(rows.rows(), model.num_outputs());
  for (Eigen::Index i = 0; i < rows.rows(); ++i) {
    result.row(i) = predict(model, rows.row(i).transpose()).transpose();
  }
  return result;
}

}  // namespace oracle
