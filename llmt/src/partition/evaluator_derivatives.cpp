
#include "partition/evaluator.hpp"
#include "partition/logistic.hpp"
#include "partition/smooth_clamp.hpp"
#include "partition/transition.hpp"

namespace llmt {

double LeafValidities::left_share_derivative(int node, const double* row) const {
  const Branch& branch = branches_[node];
  if (branch.first_level >= 0 || branch.per_half_width == 0.0) return 0.0;
  const double u = (side(branch, row) - branch.threshold) * branch.per_half_width;
  return branch.per_half_width *
         (kind_ == ValidityKind::logistic ? logistic_derivative(logistic(u)) : transition_derivative(u));
}

void LeafValidities::add_side_derivatives(int node, const Eigen::VectorXd& factor, Eigen::MatrixXd& by_input) const {
  const Branch& branch = branches_[node];
  if (branch.first_term < 0) {
    by_input.col(branch.input) += factor;
  }
  for (int k = 0; k < branch.terms; ++k) {
    const Term& term = terms_[branch.first_term + k];
    by_input.col(term.input) += term.weight * factor;
  }
}

Eigen::MatrixXd LeafValidities::exponent_derivatives(const std::vector<Activation>& active, const double* row) const {
  Eigen::MatrixXd result(gaussians_.inputs, std::ssize(active));
  Eigen::Index at = 0;  // both are in order of growth
  for (Eigen::Index i = 0; i < result.cols(); ++i) {
    while (gaussians_.nodes[at] != active[i].node) {
      ++at;
    }
    const double* centre = gaussians_.centres.data() + at * gaussians_.stride;
    const double* per_sigma = gaussians_.per_sigma.data() + at * gaussians_.stride;
    for (Eigen::Index j = 0; j < gaussians_.inputs; ++j) {
      result(j, i) = -(row[j] - centre[j]) * per_sigma[j] * per_sigma[j];
    }
  }
  return result;
}

void LocalModels::add_slopes(int node, double validity, const double* deviations, Eigen::MatrixXd& by_regressor) const {
  for (Eigen::Index k = 0; k < regressors_; ++k) {
    double below = 0.0;  // derivative of the held deviation of the node below
    int left = most_ancestors;
    for (int at = node; at >= 0 && below < 1.0; at = next_ancestor(parents_, at, left)) {
      const double derivative = smooth_clamp_derivative(deviations[k], low(at)[k], high(at)[k]);
      const double weight = validity * (derivative - below);
      for (Eigen::Index o = 0; weight != 0.0 && o < outputs_; ++o) {
        by_regressor(o, k) += weight * slopes(at, o)[k];
      }
      below = derivative;
    }
  }
}

void LocalModels::finish_slopes(const double* deviations, const double* values, Eigen::MatrixXd& by_input,
                                Eigen::MatrixXd& by_regressor) const {
  Eigen::VectorXd root = Eigen::VectorXd::Zero(outputs_);
  add(0, 1.0, deviations, root.data());
  for (Eigen::Index o = 0; o < residual_range_.rows(); ++o) {
    const double derivative =
        smooth_clamp_derivative(values[o] - root(o), residual_range_(o, 0), residual_range_(o, 1));
    if (derivative == 1.0) continue;
    by_input.row(o) *= derivative;
    by_regressor.row(o) *= derivative;
    for (Eigen::Index k = 0; k < regressors_; ++k) {
      by_regressor(o, k) +=
          (1.0 - derivative) * slopes(0, o)[k] * smooth_clamp_derivative(deviations[k], low(0)[k], high(0)[k]);
    }
  }
  for (Eigen::Index k = 0; k < regressors_; ++k) {
    const double beyond = 1.0 - smooth_clamp_derivative(deviations[k], low(0)[k], high(0)[k]);
    for (Eigen::Index o = 0; beyond > 0.0 && o < outputs_; ++o) {
      by_regressor(o, k) += outer_slopes(o)[k] * beyond;
    }
  }
}

void Evaluator::derivatives(const double* row, const double* deviations, Eigen::MatrixXd& by_input,
                            Eigen::MatrixXd& by_regressor) const {
  by_input.setZero(num_outputs(), inputs_);
  by_regressor.setZero(num_outputs(), regressors_);
  std::vector<double> values(num_outputs());
  if (validities_.are_gaussian()) {
    add_gaussian_derivatives(row, deviations, values.data(), by_input, by_regressor);
  } else {
    add_blend_derivatives(row, deviations, values, by_input, by_regressor);
  }
  models_.finish_slopes(deviations, values.data(), by_input, by_regressor);
  if (!has_output_range()) return;
  models_.finish(deviations, values.data());
  for (Eigen::Index o = 0; o < num_outputs(); ++o) {
    if (values[o] < output_range_(o, 0) || values[o] > output_range_(o, 1)) {
      by_input.row(o).setZero();
      by_regressor.row(o).setZero();
    }
  }
}

// d Phi_i = Phi_i (d l_i - sum_k Phi_k d l_k), l_i the exponent.
void Evaluator::add_gaussian_derivatives(const double* row, const double* deviations, double* values,
                                         Eigen::MatrixXd& by_input, Eigen::MatrixXd& by_regressor) const {
  std::vector<Activation> active;
  activate(row, active);
  Eigen::MatrixXd exponents = validities_.exponent_derivatives(active, row);
  Eigen::VectorXd mean = Eigen::VectorXd::Zero(exponents.rows());
  for (std::size_t i = 0; i < active.size(); ++i) {
    mean += active[i].validity * exponents.col(i);
  }
  Eigen::VectorXd of_leaf(num_outputs());
  for (std::size_t i = 0; i < active.size(); ++i) {
    local(active[i].node, deviations, of_leaf.data());
    by_input += active[i].validity * of_leaf * (exponents.col(i) - mean).transpose();
    models_.add(active[i].node, active[i].validity, deviations, values);
    models_.add_slopes(active[i].node, active[i].validity, deviations, by_regressor);
  }
}

// The value of a subtree is g V_left + (1 - g) V_right: its derivative by g is V_left - V_right.
void Evaluator::add_blend_derivatives(const double* row, const double* deviations, std::vector<double>& values,
                                      Eigen::MatrixXd& by_input, Eigen::MatrixXd& by_regressor) const {
  // Leaves that the row reaches and nodes that share it out, each before the nodes below it, the right ones first.
  struct Visit {
    int node;
    double validity;
    double left;  // share of the left child
  };
  std::vector<Visit> visits;
  std::vector<Activation> waiting = {{0, 1.0}};  // left children
  while (!waiting.empty()) {
    auto [node, validity] = waiting.back();
    waiting.pop_back();
    double left = 0.0;
    while (validities_.left(node) >= 0) {
      left = left_share(node, row);
      if (left >= 1.0 || left <= 0.0) {
        node = left >= 1.0 ? validities_.left(node) : validities_.right(node);
        continue;
      }
      visits.push_back({node, validity, left});
      waiting.push_back({validities_.left(node), validity * left});
      node = validities_.right(node);
      validity *= 1.0 - left;
    }
    visits.push_back({node, validity, left});
  }
  // Backwards: leaves from left to right, and each node after the nodes below it. The values of subtrees that wait for
  // the subtree beside them stand one behind the other.
  const Eigen::Index outputs = num_outputs();
  values.clear();
  Eigen::VectorXd by_side(outputs);
  for (auto visit = visits.rbegin(); visit != visits.rend(); ++visit) {
    if (validities_.left(visit->node) < 0) {
      values.resize(values.size() + outputs);
      local(visit->node, deviations, values.data() + values.size() - outputs);
      models_.add_slopes(visit->node, visit->validity, deviations, by_regressor);
      continue;
    }
    const double* of_right = values.data() + values.size() - outputs;
    double* of_left = values.data() + values.size() - 2 * outputs;
    const double by_share = visit->validity * validities_.left_share_derivative(visit->node, row);
    for (Eigen::Index o = 0; o < outputs; ++o) {
      by_side(o) = by_share * (of_left[o] - of_right[o]);
      of_left[o] = visit->left * of_left[o] + (1.0 - visit->left) * of_right[o];
    }
    validities_.add_side_derivatives(visit->node, by_side, by_input);
    values.resize(values.size() - outputs);
  }
}

}  // namespace llmt
