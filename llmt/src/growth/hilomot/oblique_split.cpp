#include "growth/hilomot/oblique_split.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <vector>

#include "model/logistic.hpp"
#include "numerics/dense.hpp"

namespace llmt {
namespace {

constexpr double infinity = std::numeric_limits<double>::infinity();

// Ridge that draws the coefficients of a model towards zero, as a part of the total weight. Coefficients that the rows
// determine do not notice it.
constexpr double ridge = 1e-9;

// Thresholds along a direction where the optimisation may start: quantiles of the weighted rows.
constexpr double quantiles[] = {0.2, 0.35, 0.5, 0.65, 0.8};

constexpr int most_evaluations = 40;
constexpr double small_gain = 1e-5;  // a step that lowers the loss by a smaller part is the last one

// Rows that are summed up at a time.
constexpr Eigen::Index rows_at_once = 256;

LLMT_FOR_EACH_INSTRUCTION_SET
void set_shares(const double* u, Eigen::Index count, double* shares) {
  for (Eigen::Index i = 0; i < count; ++i) {
    shares[i] = logistic(u[i]);
  }
}

// sum' += left' right.
void add_product(const RowMajor& left, const RowMajor& right, Eigen::Index rows, RowMajor& sum) {
  add_transposed_product(left.cols(), right.cols(), rows, 1.0, left.data(), left.cols(), right.data(), right.cols(),
                         sum.data(), sum.cols());
}

// The two models under given shares g. With b = [a, g a] both say b' [second; difference]; B' W B is made of
// total * 1, `once` and `twice`.
struct Fitted {
  Eigen::MatrixXd once;        // sum of w g a a'
  Eigen::MatrixXd twice;       // sum of w g^2 a a'
  Eigen::MatrixXd products;    // sum of w g a y'
  Eigen::MatrixXd second;      // coefficients of the right model
  Eigen::MatrixXd difference;  // of the left one, less those
  double loss = infinity;
};

void fit_models(const GateProblem& problem, double total, Fitted& fitted) {
  const Eigen::Index size = problem.a.cols();
  const Eigen::MatrixXd identity = Eigen::MatrixXd::Identity(size, size);
  if (problem.models == GateModels::joint) {
    const Eigen::MatrixXd rest = fitted.twice - fitted.once * fitted.once / total + ridge * total * identity;
    fitted.difference = rest.llt().solve(fitted.products);
    fitted.second = -fitted.once * fitted.difference / total;
  } else {
    // y is orthogonal to a, so the products of the right side are those of the left one, negative.
    const Eigen::MatrixXd first = (fitted.once + ridge * total * identity).llt().solve(fitted.products);
    fitted.second = -((1.0 + ridge) * total * identity - fitted.once).llt().solve(fitted.products);
    fitted.difference = first - fitted.second;
  }
  const auto& [once, twice, products, second, difference, loss] = fitted;
  const Eigen::RowVectorXd squares = problem.weights.transpose() * problem.y.cwiseAbs2();
  Eigen::RowVectorXd explained = products.cwiseProduct(difference).colwise().sum();
  if (problem.models == GateModels::local) {
    explained = 2.0 * explained - total * second.colwise().squaredNorm() -
                2.0 * second.cwiseProduct(once * difference).colwise().sum() -
                difference.cwiseProduct(twice * difference).colwise().sum();
  }
  fitted.loss = std::max(0.0, (squares - explained).dot(problem.output_weights));
}

Fitted with_shares(const GateProblem& problem, const Eigen::VectorXd& shares) {
  const double total = problem.weights.sum();
  const double on_left = problem.weights.dot(shares);
  Fitted fitted;
  if (!(on_left >= problem.least_weight && total - on_left >= problem.least_weight)) return fitted;
  const Eigen::Index size = problem.a.cols();
  const Eigen::Index outputs = problem.y.cols();
  RowMajor left(rows_at_once, size);
  RowMajor right(rows_at_once, 2 * size + outputs);
  RowMajor sum = RowMajor::Zero(size, 2 * size + outputs);
  for (Eigen::Index begin = 0; begin < problem.a.rows(); begin += rows_at_once) {
    const Eigen::Index count = std::min(rows_at_once, problem.a.rows() - begin);
    for (Eigen::Index i = 0; i < count; ++i) {
      const Eigen::Index row = begin + i;
      const double share = shares(row);
      left.row(i) = problem.weights(row) * share * problem.a.row(row);
      right.row(i).head(size) = problem.a.row(row);
      right.row(i).segment(size, size) = share * problem.a.row(row);
      right.row(i).tail(outputs) = problem.y.row(row);
    }
    add_product(left, right, count, sum);
  }
  fitted.once = sum.leftCols(size);
  fitted.twice = sum.middleCols(size, size);
  fitted.products = sum.rightCols(outputs);
  fit_models(problem, total, fitted);
  return fitted;
}

// Gauss and Newton's matrix and the gradient of half the loss.
struct Linearised {
  Eigen::MatrixXd matrix;
  Eigen::VectorXd gradient;
};

// Sums over the rows for one output. The residuals' derivatives by the gate at fixed coefficients are
// D = -g' (a' difference) z.
struct GateSums {
  RowMajor products;  // (w D)' times [a, g a, D, residual]
  RowMajor pull;      // local models: sum of w g' (y - left model) z a'
};

GateSums sum_output(const GateProblem& problem, const Eigen::VectorXd& shares, const Eigen::VectorXd& second,
                    const Eigen::VectorXd& difference, Eigen::Index output) {
  const Eigen::Index size = problem.a.cols();
  const Eigen::Index entries = problem.z.cols();
  RowMajor by_gate(rows_at_once, entries);  // w D
  RowMajor pulled(rows_at_once, entries);   // w g' (y - left model) z
  RowMajor right(rows_at_once, 2 * size + entries + 1);
  RowMajor regressors(rows_at_once, size);
  GateSums sums{RowMajor::Zero(entries, right.cols()), RowMajor::Zero(entries, size)};
  for (Eigen::Index begin = 0; begin < problem.a.rows(); begin += rows_at_once) {
    const Eigen::Index count = std::min(rows_at_once, problem.a.rows() - begin);
    for (Eigen::Index i = 0; i < count; ++i) {
      const Eigen::Index row = begin + i;
      const double share = shares(row);
      const double slope = logistic_derivative(share);
      const double gap = problem.a.row(row).dot(difference);
      const double of_right = problem.y(row, output) - problem.a.row(row).dot(second);
      const double weight = problem.weights(row);
      by_gate.row(i) = -weight * slope * gap * problem.z.row(row);
      pulled.row(i) = weight * slope * (of_right - gap) * problem.z.row(row);
      regressors.row(i) = problem.a.row(row);
      right.row(i).head(size) = problem.a.row(row);
      right.row(i).segment(size, size) = share * problem.a.row(row);
      right.row(i).segment(2 * size, entries) = -slope * gap * problem.z.row(row);
      right(i, 2 * size + entries) = of_right - share * gap;
    }
    add_product(by_gate, right, count, sums.products);
    if (problem.models == GateModels::local) add_product(pulled, regressors, count, sums.pull);
  }
  return sums;
}

// Adds the part of one output. The coefficients follow the gate, which adds B K to the derivatives D of the residuals.
// Joint models: K = -(B' W B)^-1 B' W D, the approximation of Kaufman (1975), with which the gradient is exact. Local
// models: the exact derivatives of the two weighted least-squares fits.
void add_output(const GateProblem& problem, const Eigen::VectorXd& shares, const Fitted& fitted, Eigen::Index output,
                Linearised& result) {
  const Eigen::Index size = problem.a.cols();
  const Eigen::Index entries = problem.z.cols();
  const Eigen::VectorXd second = fitted.second.col(output);
  const Eigen::VectorXd difference = fitted.difference.col(output);
  const auto [sum, pull] = sum_output(problem, shares, second, difference, output);
  const double total = problem.weights.sum();
  const Eigen::MatrixXd identity = Eigen::MatrixXd::Identity(size, size);
  Eigen::MatrixXd normal(2 * size, 2 * size);  // B' W B
  normal << total * identity, fitted.once, fitted.once, fitted.twice;
  const Eigen::MatrixXd cross = sum.leftCols(2 * size).transpose();  // B' W D
  Eigen::MatrixXd follow(2 * size, entries);
  Eigen::VectorXd left_over = Eigen::VectorXd::Zero(2 * size);  // B' W r
  if (problem.models == GateModels::joint) {
    normal.bottomRightCorner(size, size) += ridge * total * identity;
    follow = -normal.llt().solve(cross);
  } else {
    const Eigen::MatrixXd of_left = (fitted.once + ridge * total * identity).llt().solve(pull.transpose());
    const Eigen::MatrixXd of_right =
        ((1.0 + ridge) * total * identity - fitted.once).llt().solve(pull.transpose() - cross.topRows(size));
    follow << of_right, -of_left - of_right;
    left_over << -total * second - fitted.once * difference,
        fitted.products.col(output) - fitted.once * second - fitted.twice * difference;
  }
  const double factor = problem.output_weights(output);
  const Eigen::MatrixXd mixed = cross.transpose() * follow;
  result.matrix += factor * (Eigen::MatrixXd(sum.middleCols(2 * size, entries)) + mixed + mixed.transpose() +
                             follow.transpose() * normal * follow);
  result.gradient += factor * (Eigen::VectorXd(sum.rightCols(1)) + follow.transpose() * left_over);
}

Linearised linearise(const GateProblem& problem, const Gate& gate, const Fitted& fitted) {
  const Eigen::Index entries = problem.z.cols();
  Linearised result{Eigen::MatrixXd::Zero(entries, entries), Eigen::VectorXd::Zero(entries)};
  const Eigen::VectorXd shares = gate_shares(problem, gate);
  for (Eigen::Index output = 0; output < problem.y.cols(); ++output) {
    add_output(problem, shares, fitted, output, result);
  }
  return result;
}

// The same plane with its half width clamped to the two.
Gate clamped(const Gate& gate, double least_width, double most_width) {
  const double steepness = gate.head(gate.size() - 1).norm();
  return gate * (std::clamp(steepness, 1.0 / most_width, 1.0 / least_width) / steepness);
}

// Takes out the part of a step that would change the half width.
void fix_width(const Gate& gate, Linearised& at) {
  const Eigen::Index inputs = gate.size() - 1;
  Eigen::MatrixXd along = Eigen::MatrixXd::Identity(gate.size(), gate.size());
  const Eigen::VectorXd unit = gate.head(inputs).normalized();
  along.topLeftCorner(inputs, inputs) -= unit * unit.transpose();
  at.matrix = along * at.matrix * along;
  at.gradient = along * at.gradient;
}

}  // namespace

Eigen::VectorXd gate_shares(const GateProblem& problem, const Gate& gate) {
  const Eigen::VectorXd u = problem.z * gate;
  Eigen::VectorXd shares(u.size());
  set_shares(u.data(), u.size(), shares.data());
  return shares;
}

double share_loss(const GateProblem& problem, const Eigen::VectorXd& shares) {
  return with_shares(problem, shares).loss;
}

Eigen::VectorXd gate_gradient(const GateProblem& problem, const Gate& gate) {
  return 2.0 * linearise(problem, gate, with_shares(problem, gate_shares(problem, gate))).gradient;
}

GateFit best_threshold(const GateProblem& problem, const Eigen::VectorXd& direction, double half_width) {
  Gate gate = Gate::Zero(problem.z.cols());
  gate.head(direction.size()) = direction.normalized() / half_width;
  const Eigen::VectorXd side = problem.z * gate;
  std::vector<int> order(side.size());
  std::iota(order.begin(), order.end(), 0);
  std::ranges::stable_sort(order, [&](int i, int j) { return side(i) < side(j); });
  GateFit best{gate, infinity};
  const double total = problem.weights.sum();
  double sum = 0.0;
  std::size_t next = 0;
  for (const double quantile : quantiles) {
    for (; next + 1 < order.size() && sum < quantile * total; ++next) {
      sum += problem.weights(order[next]);
    }
    gate(direction.size()) = -side(order[next]);
    const double loss = share_loss(problem, gate_shares(problem, gate));
    ++best.evaluations;
    if (loss < best.loss) {
      best.gate = gate;
      best.loss = loss;
    }
  }
  return best;
}

GateFit optimise_gate(const GateProblem& problem, const GateFit& start, double least_width, double most_width) {
  GateFit fit = start;
  fit.gate = clamped(start.gate, least_width, most_width);
  Fitted now = with_shares(problem, gate_shares(problem, fit.gate));
  fit.loss = now.loss;
  double damping = 1e-2;
  bool improving = std::isfinite(fit.loss);
  for (int left = most_evaluations; improving && left > 0;) {
    Linearised at = linearise(problem, fit.gate, now);
    if (!(least_width < most_width)) {
      fix_width(fit.gate, at);
    }
    const double mean = at.matrix.trace() / static_cast<double>(at.gradient.size());
    double gain = 0.0;
    for (; left > 0 && gain == 0.0 && damping < 1e8; --left) {
      Eigen::MatrixXd matrix = at.matrix;
      matrix.diagonal() += damping * (at.matrix.diagonal().array() + 1e-3 * mean).matrix();
      const Gate gate = clamped(fit.gate - matrix.ldlt().solve(at.gradient), least_width, most_width);
      if (gate.allFinite()) {
        Fitted there = with_shares(problem, gate_shares(problem, gate));
        ++fit.evaluations;
        if (there.loss < fit.loss) {
          gain = fit.loss - there.loss;
          fit.gate = gate;
          fit.loss = there.loss;
          now = std::move(there);
        }
      }
      damping = gain > 0.0 ? std::max(1e-8, 0.2 * damping) : 5.0 * damping;
    }
    improving = gain > small_gain * fit.loss;
  }
  return fit;
}

}  // namespace llmt
