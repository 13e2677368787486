// The held-out error of a candidate is its own: it does not change when other candidates are compared with it.
#include <gtest/gtest.h>

#include <Eigen/QR>
#include <cmath>
#include <vector>

#include "llmt/fit.hpp"
#include "llmt/folds.hpp"
#include "llmt/random.hpp"
#include "oracles/oracles.hpp"

namespace {

struct LoggedRows {
  Eigen::MatrixXd x;
  Eigen::VectorXd y;
};

// A log of a system with its own past as inputs: the drive changes its level now and then, so that blocks of rows lie
// outside of the range of the others, and the system is steeper at one side.
LoggedRows log_with_lags(std::uint64_t seed) {
  llmt::Random random(seed);
  constexpr Eigen::Index count = 320;
  Eigen::VectorXd u(count), y(count);
  u(0) = y(0) = 0.0;
  for (Eigen::Index t = 1; t < count; ++t) {
    u(t) = random.uniform(0.0, 1.0) < 0.05 ? random.uniform(-2.0, 2.0) : u(t - 1);
    const double drive = 0.3 * u(t) + 0.1 * std::abs(u(t));
    y(t) = 0.7 * y(t - 1) + 0.2 * std::sin(y(t - 1)) + drive + 0.02 * random.normal();
  }
  LoggedRows rows{Eigen::MatrixXd(count - 2, 4), y.tail(count - 2)};
  rows.x << y.segment(1, count - 2), y.head(count - 2), u.tail(count - 2), u.segment(1, count - 2);
  return rows;
}

// Root mean square error of least squares over the folds.
double least_squares_rmse(const LoggedRows& rows, const llmt::FoldOptions& options) {
  double squares = 0.0;
  for (const llmt::Fold& fold : llmt::make_folds(rows.y.size(), options)) {
    const auto with_constant = [&](const std::vector<Eigen::Index>& at) {
      Eigen::MatrixXd a(std::ssize(at), rows.x.cols() + 1);
      a << Eigen::VectorXd::Ones(std::ssize(at)), rows.x(at, Eigen::all);
      return a;
    };
    const Eigen::VectorXd w = with_constant(fold.train).colPivHouseholderQr().solve(rows.y(fold.train));
    squares += (with_constant(fold.held_out) * w - rows.y(fold.held_out)).squaredNorm();
  }
  return std::sqrt(squares / static_cast<double>(rows.y.size()));
}

class CandidateErrors : public testing::TestWithParam<llmt::FoldKind> {};

TEST_P(CandidateErrors, DoNotDependOnTheOthers) {
  for (const std::uint64_t seed : {1, 2, 3}) {
    const LoggedRows rows = log_with_lags(seed);
    llmt::FitOptions options{.validity = llmt::ValidityChoice::automatic};
    options.folds.kind = GetParam();
    options.choose_inputs = false;  // candidates are of the inputs that are left
    const double expected = least_squares_rmse(rows, options.folds);
    std::vector<llmt::CandidateError> seen;
    Eigen::VectorXd crisp;
    for (const Eigen::Index most : {1, 4, 20, 40}) {
      options.max_leaves = most;
      const llmt::PartitionSummary summary = llmt::fit(rows.x, rows.y, options).summary.partitions.front();
      ASSERT_FALSE(summary.best_of_kind.empty());
      EXPECT_EQ(summary.best_of_kind.front().candidate.leaves, 1);
      EXPECT_NEAR(summary.best_of_kind.front().rmse, expected, 1e-9 * expected) << most << " leaves";
      const Eigen::Index common = std::min(crisp.size(), summary.crisp_cv_rmse.size());
      for (Eigen::Index k = 0; k < common; ++k) {
        EXPECT_NEAR(summary.crisp_cv_rmse(k), crisp(k), 1e-9 * expected) << k + 1 << " of " << most << " leaves";
      }
      crisp = summary.crisp_cv_rmse.size() > crisp.size() ? summary.crisp_cv_rmse : crisp;
      for (const llmt::CandidateError& error : summary.best_of_kind) {
        for (const llmt::CandidateError& other : seen) {
          if (other.candidate == error.candidate) {
            EXPECT_NEAR(error.rmse, other.rmse, 1e-9 * expected) << error.candidate.leaves << " of " << most;
          }
        }
        seen.push_back(error);
      }
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Folds, CandidateErrors, testing::Values(llmt::FoldKind::random, llmt::FoldKind::contiguous),
                         [](const auto& kind) {
                           return kind.param == llmt::FoldKind::random ? "Random" : "Contiguous";
                         });

}  // namespace
