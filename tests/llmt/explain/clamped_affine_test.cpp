// Shares of a model whose predictions are kept within a range.
#include <gtest/gtest.h>

#include <Eigen/Core>
#include <algorithm>
#include <utility>

#include "llmt/explain.hpp"
#include "llmt/fit.hpp"
#include "oracles/clamped.hpp"
#include "oracles/oracles.hpp"

namespace {

// One affine model: the line is inside of the range for a part of its way, and only that part counts.
TEST(ClampedExplain, AnAffineModelGivesThePartOfTheWayInside) {
  const Eigen::MatrixXd x = oracle::uniform(100, 2, 1);
  const Eigen::Vector2d slope(2.0, -0.5);
  Eigen::MatrixXd range(1, 2);
  range << -1.0, 1.5;
  const llmt::Model model = oracle::clamped(llmt::fit(x, x * slope, {}).model, range);
  for (const auto& [from, to] : {std::pair(Eigen::Vector2d(-0.9, 0.9), Eigen::Vector2d(0.9, -0.9)),
                                 std::pair(Eigen::Vector2d(0.1, 0.9), Eigen::Vector2d(0.9, -0.9)),
                                 std::pair(Eigen::Vector2d(0.9, 0.1), Eigen::Vector2d(-0.2, -0.9)),
                                 std::pair(Eigen::Vector2d(0.9, -0.9), Eigen::Vector2d(0.85, -0.8)),
                                 std::pair(Eigen::Vector2d(-0.9, 0.3), Eigen::Vector2d(-0.8, 0.9))}) {
    const double rise = slope.dot(to - from);
    const double at_from = slope.dot(from);
    const auto position = [at_from, rise](double bound) { return (bound - at_from) / rise; };
    const double enters = std::clamp(std::min(position(-1.0), position(1.5)), 0.0, 1.0);
    const double leaves = std::clamp(std::max(position(-1.0), position(1.5)), 0.0, 1.0);
    const Eigen::VectorXd expected = (leaves - enters) * slope.cwiseProduct(to - from);
    const llmt::Attribution found = llmt::attribute(model, to, from);
    EXPECT_LT((found.contributions.row(0).transpose() - expected).cwiseAbs().maxCoeff(), 1e-12);
    EXPECT_NEAR(found.contributions.sum(), found.prediction(0) - found.reference(0), 1e-14);
  }
}

}  // namespace
