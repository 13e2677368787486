#include "numerics/bounded_least_squares.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>

namespace llmt {
namespace {

// Added to the diagonal of the Gram matrix of normals of length 1, so that it stays positive definite when two
// inequalities are nearly the same.
constexpr double added_to_diagonal = 1e-13;

// An inequality counts as violated if more than this is missing, relative to its bound, plus this part of the largest
// bound.
constexpr double rounding_of_bound = 1e-12;
constexpr double rounding_of_largest = 1e-15;

// Number of attempts to exchange all wrong inequalities at once, before they are exchanged one by one.
constexpr int most_exchanges = 12;

// Limit of the steps of one inequality each: rounding could make the method cycle.
constexpr Eigen::Index most_steps(Eigen::Index inequalities) { return 3 * inequalities + 50; }

}  // namespace

void LeastDistance::add(const Eigen::MatrixXd& normals, const Eigen::VectorXd& bounds) {
  const Eigen::Index before = normals_.cols();
  const Eigen::Index added = normals.cols();
  normals_.conservativeResize(Eigen::NoChange, before + added);
  bounds_.conservativeResize(before + added);
  multipliers_.conservativeResize(before + added);
  for (Eigen::Index c = 0; c < added; ++c) {
    const double length = normals.col(c).norm();
    normals_.col(before + c) = normals.col(c) / length;
    bounds_(before + c) = bounds(c) / length;
    multipliers_(before + c) = 0.0;
  }
  gram_.conservativeResize(before + added, before + added);
  gram_.rightCols(added).noalias() = normals_.transpose() * normals_.rightCols(added);
  gram_.bottomLeftCorner(added, before) = gram_.topRightCorner(before, added).transpose();
}

std::vector<Eigen::Index> LeastDistance::keep_active() {
  const std::vector<Eigen::Index> kept = active_;
  normals_ = Eigen::MatrixXd(normals_(Eigen::all, kept));
  gram_ = Eigen::MatrixXd(gram_(kept, kept));
  bounds_ = Eigen::VectorXd(bounds_(kept));
  multipliers_ = Eigen::VectorXd(multipliers_(kept));
  std::iota(active_.begin(), active_.begin() + std::ssize(kept), Eigen::Index{0});
  return kept;
}

void LeastDistance::enter(Eigen::Index c) {
  const Eigen::Index size = std::ssize(active_);
  if (factor_.rows() <= size) {
    factor_.conservativeResize(2 * size + 16, 2 * size + 16);
  }
  Eigen::VectorXd row = gram_.col(c)(active_);
  const auto lower = factor_.topLeftCorner(size, size).triangularView<Eigen::Lower>();
  lower.solveInPlace(row);
  factor_.row(size).head(size) = row.transpose();
  factor_(size, size) = std::sqrt(std::max(gram_(c, c) - row.squaredNorm(), 0.0) + added_to_diagonal);
  active_.push_back(c);
}

void LeastDistance::leave(Eigen::Index position) {
  const std::vector<Eigen::Index> behind(active_.begin() + position + 1, active_.end());
  active_.resize(position);
  for (const Eigen::Index c : behind) {
    enter(c);
  }
}

// Does all at once what enter() and leave() do one by one: inequalities with negative multipliers leave, violated ones
// enter, until there are none of either. A few attempts are usual, but the method may cycle; then it returns false and
// changes nothing.
bool LeastDistance::exchange(const Eigen::VectorXd& tolerance) {
  std::vector<Eigen::Index> active = active_;
  for (int attempt = 0; attempt < most_exchanges; ++attempt) {
    Eigen::MatrixXd matrix = gram_(active, active);
    matrix.diagonal().array() += added_to_diagonal;
    const Eigen::LLT<Eigen::MatrixXd> factor(matrix);
    const Eigen::VectorXd right = bounds_(active);
    const Eigen::VectorXd solution = factor.solve(right);
    Eigen::VectorXd missing = bounds_;
    std::vector<bool> is_active(bounds_.size(), false);
    for (std::size_t k = 0; k < active.size(); ++k) {
      missing -= solution(k) * gram_.col(active[k]);
      is_active[active[k]] = true;
    }
    std::vector<Eigen::Index> next;
    for (std::size_t k = 0; k < active.size(); ++k) {
      if (solution(k) > 0.0) {
        next.push_back(active[k]);
      }
    }
    bool done = next.size() == active.size() && factor.info() == Eigen::Success;
    for (Eigen::Index c = 0; c < bounds_.size(); ++c) {
      if (!is_active[c] && missing(c) > tolerance(c)) {
        next.push_back(c);
        done = false;
      }
    }
    if (done) {
      active_ = std::move(active);
      multipliers_.setZero();
      multipliers_(active_) = solution;
      factor_ = factor.matrixL();
      return true;
    }
    active = std::move(next);
  }
  return false;
}

Eigen::VectorXd LeastDistance::solve() {
  const Eigen::Index count = bounds_.size();
  if (count == 0) return Eigen::VectorXd::Zero(normals_.rows());
  const Eigen::VectorXd tolerance =
      rounding_of_bound * bounds_.cwiseAbs().array() + rounding_of_largest * bounds_.cwiseAbs().maxCoeff();
  if (exchange(tolerance)) return normals_ * multipliers_;
  for (Eigen::Index step = 0; step < most_steps(count); ++step) {
    Eigen::VectorXd missing = bounds_;
    for (const Eigen::Index c : active_) {
      missing -= multipliers_(c) * gram_.col(c);
    }
    for (const Eigen::Index c : active_) {
      missing(c) = 0.0;
    }
    Eigen::Index worst = 0;
    if (!((missing - tolerance).maxCoeff(&worst) > 0.0)) break;
    enter(worst);
    // Move towards the multipliers that make the active inequalities equations, as far as none becomes negative.
    while (!active_.empty()) {
      const Eigen::Index size = std::ssize(active_);
      Eigen::VectorXd target = bounds_(active_);
      const auto lower = factor_.topLeftCorner(size, size).triangularView<Eigen::Lower>();
      lower.solveInPlace(target);
      lower.transpose().solveInPlace(target);
      Eigen::Index first = -1;
      double length = 1.0;
      for (Eigen::Index k = 0; k < size; ++k) {
        const double now = multipliers_(active_[k]);
        if (target(k) <= 0.0 && now / (now - target(k)) <= length) {
          length = now > 0.0 ? now / (now - target(k)) : 0.0;
          first = k;
        }
      }
      for (Eigen::Index k = 0; k < size; ++k) {
        double& now = multipliers_(active_[k]);
        now = std::max(0.0, now + length * (target(k) - now));
      }
      if (first < 0) break;
      multipliers_(active_[first]) = 0.0;
      leave(first);
    }
  }
  return normals_ * multipliers_;
}

Eigen::VectorXd nearest_with_signs(const Eigen::LLT<Eigen::MatrixXd>& matrix, const Eigen::VectorXd& free,
                                   const std::vector<int>& signs) {
  std::vector<Eigen::Index> signed_entries;
  bool holds = true;
  for (Eigen::Index k = 0; k < free.size(); ++k) {
    const int sign = signs[k];
    if (sign != 0) {
      signed_entries.push_back(k);
      holds = holds && sign * free(k) >= 0.0;
    }
  }
  if (holds) return free;
  // With matrix = L L' and y = L' (w - free): sign_k e_k' w >= 0 is (L^-1 sign_k e_k)' y >= -sign_k free_k.
  const Eigen::Index count = std::ssize(signed_entries);
  Eigen::MatrixXd normals = Eigen::MatrixXd::Zero(free.size(), count);
  Eigen::VectorXd bounds(count);
  for (Eigen::Index c = 0; c < count; ++c) {
    const Eigen::Index k = signed_entries[c];
    normals(k, c) = signs[k];
    bounds(c) = -signs[k] * free(k);
  }
  matrix.matrixL().solveInPlace(normals);
  LeastDistance problem(free.size());
  problem.add(normals, bounds);
  const Eigen::VectorXd y = problem.solve();
  Eigen::VectorXd result = free + matrix.matrixU().solve(y);
  for (Eigen::Index c = 0; c < count; ++c) {
    const Eigen::Index k = signed_entries[c];
    if (problem.multipliers()(c) > 0.0 || signs[k] * result(k) < 0.0) {
      result(k) = 0.0;
    }
  }
  return result;
}

}  // namespace llmt
