#include "pose_selection/exchange.hpp"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

namespace llmt::robotics {
namespace {

constexpr double infinite = std::numeric_limits<double>::infinity();

bool is_spectral(PoseCriterion criterion) {
  return criterion != PoseCriterion::position && criterion != PoseCriterion::o1;
}

// The loss as a function of the information's eigenvalues, which are squares of singular values, ascending.
double spectral_loss(PoseCriterion criterion, const Eigen::VectorXd& eigenvalues) {
  const double least = eigenvalues(0);
  const double most = eigenvalues(eigenvalues.size() - 1);
  if (!(least > 0.0)) return infinite;
  switch (criterion) {
    case PoseCriterion::o2:
      return -std::sqrt(least / most);
    case PoseCriterion::o3:
      return -std::sqrt(least);
    case PoseCriterion::o4:
      return -least / std::sqrt(most);
    default:
      return eigenvalues.cwiseSqrt().cwiseInverse().sum();
  }
}

// The derivative of the spectral loss by the information.
Eigen::MatrixXd spectral_slope(PoseCriterion criterion, const Eigen::MatrixXd& information) {
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> solver(information);
  const Eigen::VectorXd& values = solver.eigenvalues();
  const Eigen::Index last = values.size() - 1;
  Eigen::VectorXd slope = Eigen::VectorXd::Zero(values.size());
  if (criterion == PoseCriterion::o5) {
    slope = -0.5 * values.cwiseMax(1e-12 * values(last)).array().pow(-1.5);
  } else {
    slope(0) = -1.0;
    const double share = criterion == PoseCriterion::o2 ? 1.0 : criterion == PoseCriterion::o4 ? 0.5 : 0.0;
    slope(last) += share * values(0) / values(last);
  }
  return solver.eigenvectors() * slope.asDiagonal() * solver.eigenvectors().transpose();
}

Eigen::VectorXd spectral_losses(const DesignProblem& problem, const Eigen::MatrixXd& information,
                                const Eigen::MatrixXd& rows, const std::vector<bool>& allowed) {
  const Eigen::MatrixXd slope = spectral_slope(problem.criterion, information);
  const Eigen::VectorXd of_rows = (rows * slope).cwiseProduct(rows).rowwise().sum();
  std::vector<Eigen::Index> order;
  for (std::size_t i = 0; i < allowed.size(); ++i) {
    if (allowed[i]) order.push_back(static_cast<Eigen::Index>(i));
  }
  constexpr std::ptrdiff_t most = 16;
  const auto end = order.begin() + std::min(most, std::ssize(order));
  std::partial_sort(order.begin(), end, order.end(), [&](Eigen::Index a, Eigen::Index b) {
    return of_rows.segment(3 * a, 3).sum() < of_rows.segment(3 * b, 3).sum();
  });
  Eigen::VectorXd losses = Eigen::VectorXd::Constant(std::ssize(allowed), infinite);
  for (auto pose = order.begin(); pose != end; ++pose) {
    const auto own = rows.middleRows(3 * *pose, 3);
    losses(*pose) = loss(problem, information + own.transpose() * own);
  }
  return losses;
}

// The number of chosen or measured poses that are nearer to each candidate than the spacing.
class Neighbours {
 public:
  explicit Neighbours(const Spacing& spacing) : spacing_(spacing), near_(spacing.candidates.rows(), 0) {
    for (const auto pose : spacing.measured.rowwise()) count(pose, 1);
  }
  void add(Eigen::Index pose) { count(spacing_.candidates.row(pose), 1); }
  void remove(Eigen::Index pose) { count(spacing_.candidates.row(pose), -1); }
  std::vector<bool> allowed() const {
    std::vector<bool> result;
    for (const int near : near_) result.push_back(near == 0);
    return result;
  }

 private:
  const Spacing& spacing_;
  std::vector<int> near_;

  void count(const Eigen::RowVectorXd& pose, int change) {
    for (std::size_t i = 0; i < near_.size(); ++i) {
      bool near = true;
      for (Eigen::Index j = 0; near && j < pose.size(); ++j) {
        const double apart = spacing_.candidates(i, j) - pose(j);
        near = std::abs(spacing_.turns[j] ? std::remainder(apart, 360.0) : apart) < spacing_.degrees;
      }
      if (near) near_[i] += change;
    }
  }
};

}  // namespace

Eigen::MatrixXd rows_of_poses(const Eigen::MatrixXd& rows, const std::vector<Eigen::Index>& poses) {
  Eigen::MatrixXd result(3 * std::ssize(poses), rows.cols());
  for (std::size_t i = 0; i < poses.size(); ++i) result.middleRows(3 * i, 3) = rows.middleRows(3 * poses[i], 3);
  return result;
}

Eigen::MatrixXd information(const Eigen::MatrixXd& rows, const std::vector<Eigen::Index>& poses) {
  Eigen::MatrixXd sum = Eigen::MatrixXd::Zero(rows.cols(), rows.cols());
  for (const Eigen::Index pose : poses) {
    const auto own = rows.middleRows(3 * pose, 3);
    sum += own.transpose() * own;
  }
  return sum;
}

double loss(const DesignProblem& problem, const Eigen::MatrixXd& information) {
  if (is_spectral(problem.criterion)) {
    const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> solver(information, Eigen::EigenvaluesOnly);
    return spectral_loss(problem.criterion, solver.eigenvalues());
  }
  const Eigen::LLT<Eigen::MatrixXd> factor(information);
  if (factor.info() != Eigen::Success) return infinite;
  if (problem.criterion == PoseCriterion::position) return factor.solve(problem.use).trace();
  return -2.0 * factor.matrixLLT().diagonal().array().log().sum();
}

Eigen::VectorXd losses_with(const DesignProblem& problem, const Eigen::MatrixXd& information,
                            const Eigen::MatrixXd& rows, const std::vector<bool>& allowed) {
  if (is_spectral(problem.criterion)) return spectral_losses(problem, information, rows, allowed);
  const Eigen::LLT<Eigen::MatrixXd> factor(information);
  const Eigen::MatrixXd inverse = factor.solve(Eigen::MatrixXd::Identity(information.rows(), information.cols()));
  const bool is_position = problem.criterion == PoseCriterion::position;
  const double before =
      is_position ? inverse.cwiseProduct(problem.use).sum() : -2.0 * factor.matrixLLT().diagonal().array().log().sum();
  // With J the rows of a pose and A the inverse: (M + J'J)^-1 = A - A J' (1 + J A J')^-1 J A.
  const Eigen::MatrixXd solved = rows * inverse;
  const Eigen::MatrixXd used = is_position ? Eigen::MatrixXd(solved * problem.use) : Eigen::MatrixXd();
  Eigen::VectorXd losses = Eigen::VectorXd::Constant(std::ssize(allowed), infinite);
  for (Eigen::Index i = 0; i < losses.size(); ++i) {
    if (!allowed[i]) continue;
    const auto own = solved.middleRows(3 * i, 3);
    const Eigen::Matrix3d spread = Eigen::Matrix3d::Identity() + own * rows.middleRows(3 * i, 3).transpose();
    losses(i) = before;
    if (is_position) {
      const Eigen::Matrix3d gain = used.middleRows(3 * i, 3) * own.transpose();
      losses(i) -= (spread.inverse() * gain).trace();
    } else {
      losses(i) -= std::log(spread.determinant());
    }
  }
  return losses;
}

std::vector<Eigen::Index> choose_by_exchange(const DesignProblem& problem, const Eigen::MatrixXd& rows,
                                             const Spacing& spacing, std::vector<Eigen::Index> start,
                                             Eigen::Index count, Work* work) {
  constexpr int most_passes = 30;
  constexpr double least_gain = 1e-6;
  constexpr double least_gain_of_pass = 1e-4;
  Neighbours neighbours(spacing);
  std::vector<Eigen::Index> chosen = std::move(start);
  for (const Eigen::Index pose : chosen) neighbours.add(pose);
  Eigen::MatrixXd sum = problem.given + information(rows, chosen);
  while (std::ssize(chosen) < count) {
    if (work != nullptr) work->check();
    Eigen::Index best = 0;
    if (!(losses_with(problem, sum, rows, neighbours.allowed()).minCoeff(&best) < infinite)) return chosen;
    chosen.push_back(best);
    neighbours.add(best);
    sum += information(rows, {best});
  }
  double now = loss(problem, sum);
  for (int pass = 0; pass < most_passes; ++pass) {
    const double before = now;
    for (Eigen::Index& pose : chosen) {
      if (work != nullptr) work->check();
      neighbours.remove(pose);
      std::vector<Eigen::Index> others = chosen;
      std::erase(others, pose);
      others.resize(chosen.size() - 1, pose);  // a pose that is there twice goes once
      const Eigen::MatrixXd rest = problem.given + information(rows, others);
      Eigen::Index best = pose;
      const double found = losses_with(problem, rest, rows, neighbours.allowed()).minCoeff(&best);
      if (found < now - least_gain * std::abs(now)) {
        now = found;
        pose = best;
      }
      neighbours.add(pose);
    }
    if (!(now < before - least_gain_of_pass * std::abs(before))) break;
  }
  return chosen;
}

}  // namespace llmt::robotics
