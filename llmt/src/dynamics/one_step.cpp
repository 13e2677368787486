#include "dynamics/one_step.hpp"

#include <algorithm>
#include <cmath>

#include "dynamics/polynomial.hpp"
#include "partition/smooth_clamp.hpp"
#include "partition/through_regressors.hpp"

namespace llmt {
namespace {

const Model* tree_of(const DynamicParts& parts) { return std::get_if<Model>(&parts.rest); }

// Calls visit(partition, node, place in the partition's outputs, output) for every leaf and output that it serves, in
// the order of the parameters behind those of the polynomial: output by output.
template <class Visit>
void for_each_leaf_of_output(const Model& tree, Eigen::Index output, const Visit& visit) {
  for (std::size_t p = 0; p < tree.partitions().size(); ++p) {
    const Partition& partition = tree.partitions()[p];
    const auto place = std::ranges::find(partition.outputs, static_cast<int>(output));
    if (place == partition.outputs.end()) continue;
    for (std::size_t n = 0; n < partition.nodes.size(); ++n) {
      if (partition.nodes[n].is_leaf()) visit(p, n, place - partition.outputs.begin());
    }
  }
}

}  // namespace

OneStep::OneStep(const DynamicParts& parts) : parts_(parts), outputs_(std::ssize(parts.outputs)) {
  const Polynomial& polynomial = parts.polynomial;
  z_.resize(2 * polynomial.centre.size());
  products_.resize(std::ssize(polynomial.terms));
  const Model* tree = tree_of(parts);
  if (tree != nullptr) {
    const Eigen::Index regressors = std::ssize(tree->regressors());
    deviations_.resize(regressors);
    for (const Partition& partition : tree->partitions()) {
      evaluators_.emplace_back(partition, tree->inputs(), regressors);
      places_.emplace_back(partition.nodes.size() * partition.outputs.size(), -1);
    }
  }
  values_.resize(outputs_);
  local_.resize(outputs_);
  for (Eigen::Index o = 0; o < outputs_; ++o) {
    place_of_output_.push_back(parameters_);
    parameters_ += std::ssize(polynomial.terms);
    if (tree == nullptr) continue;
    for_each_leaf_of_output(*tree, o, [&](std::size_t p, std::size_t n, Eigen::Index place) {
      places_[p][n * tree->partitions()[p].outputs.size() + place] = parameters_;
      parameters_ += 1 + deviations_.size();
    });
  }
}

void OneStep::values(const double* x, double* y) {
  const Polynomial& polynomial = parts_.polynomial;
  standardise(polynomial, x, z_.data());
  products_at(polynomial, z_.data(), products_.data());
  for (Eigen::Index o = 0; o < outputs_; ++o) {
    double sum = 0.0;
    for (Eigen::Index k = 0; k < products_.size(); ++k) sum += polynomial.coefficients(o, k) * products_(k);
    y[o] = sum;
  }
  add_rest(x, y);
}

void OneStep::add_rest(const double* x, double* y) {
  if (const Model* tree = tree_of(parts_)) {
    deviations_at(tree->inputs(), tree->regressors(), x, deviations_.data());
    for (std::size_t p = 0; p < evaluators_.size(); ++p) {
      evaluators_[p].activate(x, active_);
      evaluators_[p].combine(active_, deviations_.data(), values_.data());
      const std::vector<int>& outputs = tree->partitions()[p].outputs;
      for (std::size_t o = 0; o < outputs.size(); ++o) y[outputs[o]] += values_(o);
    }
  } else if (const auto* sum = std::get_if<BoostedModel>(&parts_.rest)) {
    const Eigen::Map<const Eigen::RowVectorXd> row(x, sum->num_inputs());
    const Eigen::MatrixXd values = sum->predict(row, 1);
    for (Eigen::Index o = 0; o < outputs_; ++o) y[o] += values(0, o);
  }
}

void OneStep::derivatives(const double* x, double* y, Eigen::MatrixXd& by_regressor, Eigen::MatrixXd& by_parameter) {
  values(x, y);
  by_regressor.setZero(outputs_, parts_.polynomial.centre.size());
  by_parameter.setZero(parameters_, outputs_);
  add_polynomial_slopes(parts_.polynomial, x, z_.data(), by_regressor);
  for (Eigen::Index o = 0; o < outputs_; ++o) {
    by_parameter.col(o).segment(place_of_output_[o], products_.size()) = products_;
  }
  if (tree_of(parts_) != nullptr) {
    add_tree_derivatives(x, y, by_regressor, by_parameter);
  } else if (std::holds_alternative<BoostedModel>(parts_.rest)) {
    add_sum_slopes(x, by_regressor);
  }
}

// `deviations_` are those of x.
void OneStep::add_tree_derivatives(const double* x, double*, Eigen::MatrixXd& by_regressor,
                                   Eigen::MatrixXd& by_parameter) {
  const Model& tree = *tree_of(parts_);
  Eigen::MatrixXd by_input;
  Eigen::MatrixXd by_deviation;
  for (std::size_t p = 0; p < evaluators_.size(); ++p) {
    const Partition& partition = tree.partitions()[p];
    const Eigen::Index served = std::ssize(partition.outputs);
    evaluators_[p].derivatives(x, deviations_.data(), by_input, by_deviation);
    add_through_regressors(tree.inputs(), tree.regressors(), x, by_deviation, by_input);
    for (Eigen::Index o = 0; o < served; ++o) by_regressor.row(partition.outputs[o]) += by_input.row(o);

    evaluators_[p].activate(x, active_);
    // The hold near the root's model passes on a part of every change of a leaf.
    Eigen::VectorXd passed = Eigen::VectorXd::Ones(served);
    if (partition.residual_range.size() > 0 || partition.output_range.size() > 0) {
      values_.head(served).setZero();
      for (const Activation& leaf : active_) {
        evaluators_[p].local(leaf.node, deviations_.data(), local_.data());
        values_.head(served) += leaf.validity * local_.head(served);
      }
      evaluators_[p].local(0, deviations_.data(), local_.data());
      for (Eigen::Index o = 0; o < served && partition.residual_range.size() > 0; ++o) {
        const double margin = 0.1 * (partition.residual_range(o, 1) - partition.residual_range(o, 0));
        passed(o) = smooth_clamp_derivative(values_(o) - local_(o), partition.residual_range(o, 0) - margin,
                                            partition.residual_range(o, 1) + margin);
      }
      if (partition.output_range.size() > 0) {
        Eigen::VectorXd unclamped(served);
        evaluators_[p].combine_unclamped(active_, deviations_.data(), unclamped.data());
        for (Eigen::Index o = 0; o < served; ++o) {
          if (unclamped(o) < partition.output_range(o, 0) || unclamped(o) > partition.output_range(o, 1))
            passed(o) = 0.0;
        }
      }
    }
    for (const Activation& leaf : active_) {
      const Node& node = partition.nodes[leaf.node];
      for (Eigen::Index o = 0; o < served; ++o) {
        const Eigen::Index place = places_[p][leaf.node * served + o];
        const double factor = leaf.validity * passed(o);
        auto column = by_parameter.col(partition.outputs[o]);
        column(place) += factor;
        for (Eigen::Index j = 0; j < deviations_.size(); ++j) {
          column(place + 1 + j) += factor * smooth_clamp(deviations_(j), node.low(j), node.high(j));
        }
      }
    }
  }
}

// A sum of trees has no derivatives of its own: central differences over a thousandth of a deviation.
void OneStep::add_sum_slopes(const double* x, Eigen::MatrixXd& by_regressor) {
  const auto& sum = std::get<BoostedModel>(parts_.rest);
  const Eigen::Index regressors = sum.num_inputs();
  Eigen::MatrixXd rows(2 * regressors, regressors);
  for (Eigen::Index j = 0; j < regressors; ++j) {
    for (const Eigen::Index side : {0, 1}) {
      rows.row(2 * j + side) = Eigen::Map<const Eigen::RowVectorXd>(x, regressors);
      rows(2 * j + side, j) += (side == 0 ? -1e-3 : 1e-3) * parts_.polynomial.scale(j);
    }
  }
  const Eigen::MatrixXd values = sum.predict(rows, 1);
  for (Eigen::Index j = 0; j < regressors; ++j) {
    by_regressor.col(j) +=
        (values.row(2 * j + 1) - values.row(2 * j)).transpose() / (2e-3 * parts_.polynomial.scale(j));
  }
}

Eigen::VectorXd parameters_of(const DynamicParts& parts) {
  std::vector<double> parameters;
  const Model* tree = tree_of(parts);
  for (Eigen::Index o = 0; o < std::ssize(parts.outputs); ++o) {
    for (Eigen::Index k = 0; k < parts.polynomial.coefficients.cols(); ++k) {
      parameters.push_back(parts.polynomial.coefficients(o, k));
    }
    if (tree == nullptr) continue;
    for_each_leaf_of_output(*tree, o, [&](std::size_t p, std::size_t n, Eigen::Index place) {
      const Node& node = tree->partitions()[p].nodes[n];
      parameters.push_back(node.value(place));
      for (const double slope : node.slope.row(place)) parameters.push_back(slope);
    });
  }
  return Eigen::Map<const Eigen::VectorXd>(parameters.data(), std::ssize(parameters));
}

DynamicParts with_parameters(const DynamicParts& parts, const Eigen::VectorXd& parameters) {
  DynamicParts changed = parts;
  const Model* tree = tree_of(parts);
  std::vector<Partition> partitions;
  if (tree != nullptr) partitions = tree->partitions();
  const double* next = parameters.data();
  for (Eigen::Index o = 0; o < std::ssize(parts.outputs); ++o) {
    for (Eigen::Index k = 0; k < parts.polynomial.coefficients.cols(); ++k) {
      changed.polynomial.coefficients(o, k) = *next++;
    }
    if (tree == nullptr) continue;
    for_each_leaf_of_output(*tree, o, [&](std::size_t p, std::size_t n, Eigen::Index place) {
      Node& node = partitions[p].nodes[n];
      node.value(place) = *next++;
      for (double& slope : node.slope.row(place)) slope = *next++;
    });
  }
  if (tree != nullptr) changed.rest = Model(tree->inputs(), tree->outputs(), tree->regressors(), std::move(partitions));
  return changed;
}

std::vector<bool> are_beyond_linear(const DynamicParts& parts) {
  std::vector<bool> beyond;
  const Model* tree = tree_of(parts);
  for (Eigen::Index o = 0; o < std::ssize(parts.outputs); ++o) {
    for (const std::vector<int>& term : parts.polynomial.terms) beyond.push_back(term.size() > 1);
    if (tree == nullptr) continue;
    for_each_leaf_of_output(*tree, o, [&](std::size_t, std::size_t, Eigen::Index) {
      beyond.insert(beyond.end(), 1 + tree->regressors().size(), true);
    });
  }
  return beyond;
}

}  // namespace llmt
