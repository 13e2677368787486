// What quadratic and sparse local models promise.
#include <gtest/gtest.h>

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <stdexcept>
#include <string>
#include <vector>

#include "llmt/compare.hpp"
#include "llmt/fit.hpp"
#include "numerics/forward_selection.hpp"
#include "oracles/oracles.hpp"
#include "oracles/predict_oracle.hpp"
#include "oracles/random_trees.hpp"

namespace {

using llmt::LocalTerms;
using llmt::SparseChoice;
using llmt::ValidityChoice;

constexpr double missing = std::numeric_limits<double>::quiet_NaN();
const std::vector<ValidityChoice> kinds = {ValidityChoice::crisp, ValidityChoice::blend, ValidityChoice::gaussian};

// One candidate, no choice.
llmt::FitOptions only(ValidityChoice validity, Eigen::Index max_leaves, LocalTerms terms,
                      SparseChoice sparse = SparseChoice::never) {
  llmt::FitOptions options;
  options.significance = 1.0;
  options.expert.min_variance_gain = -1.0;
  options.max_leaves = max_leaves;
  options.terms = terms;
  options.sparse = sparse;
  options.validity = validity;
  options.expert.widths = {validity == ValidityChoice::gaussian ? 1.0 / 3.0 : 1.0};
  options.expert.ridges = {1e-3};
  options.expert.shrinkages = {0.0};
  options.folds.count = 0;
  return options;
}

// Regressors as they stand in Leaf: products of deviations from the means of the inputs.
Eigen::MatrixXd regressors_of(const llmt::Model& model, const Eigen::MatrixXd& x) {
  Eigen::MatrixXd result(x.rows(), std::ssize(model.regressors()));
  for (std::size_t k = 0; k < model.regressors().size(); ++k) {
    const llmt::Regressor& regressor = model.regressors()[k];
    const auto deviation = [&](int input) { return x.col(input).array() - model.inputs()[input].centre; };
    auto column = result.col(k);
    if (regressor.second_input < 0) {
      column = x.col(regressor.input);
    } else {
      column = deviation(regressor.input) * deviation(regressor.second_input);
    }
  }
  return result;
}

Eigen::VectorXd quadratic_function(const Eigen::MatrixXd& x) {
  const auto a = x.col(0).array();
  const auto b = x.col(1).array();
  const auto c = x.col(2).array();
  return 3.0 + a - 2.0 * b + 0.7 * a * b - 1.5 * c * c + 0.4 * a * c + 0.2 * a * a;
}

Eigen::MatrixXd with_constant(const Eigen::MatrixXd& x) {
  Eigen::MatrixXd result(x.rows(), x.cols() + 1);
  result << Eigen::VectorXd::Ones(x.rows()), x;
  return result;
}

std::string message_of(const std::function<void()>& call) {
  try {
    call();
  } catch (const std::invalid_argument& error) {
    return error.what();
  }
  return "no std::invalid_argument";
}

// The partition is that of a curved output; the others are affine and quadratic. Queries reach into corners without
// rows, where products lie beyond all those of the training rows.
TEST(Quadratic, AffineAndQuadraticDataAreReproducedInTheTrainingExtent) {
  for (const ValidityChoice validity : kinds) {
    const Eigen::MatrixXd x = oracle::uniform(400, 3, 1);
    Eigen::MatrixXd y(400, 3);
    y << oracle::curved(x), 1.0 + x.col(0).array() - 3.0 * x.col(2).array(), quadratic_function(x);
    llmt::FitOptions options = only(validity, 6, LocalTerms::quadratic);
    options.shared_partition = true;
    const llmt::Model model = llmt::fit(x, y, options).model;
    EXPECT_EQ(model.partitions()[0].num_leaves(), 6);
    Eigen::MatrixXd queries = oracle::uniform(500, 3, 2);
    for (Eigen::Index j = 0; j < 3; ++j) {
      for (int corner = 0; corner < 8; ++corner) {
        queries(corner, j) = (corner >> j) % 2 == 0 ? x.col(j).minCoeff() : x.col(j).maxCoeff();
      }
      queries.col(j) = queries.col(j).cwiseMax(x.col(j).minCoeff()).cwiseMin(x.col(j).maxCoeff());
    }
    const Eigen::MatrixXd predicted = model.predict(queries);
    EXPECT_LT((predicted.col(1) - (1.0 + queries.col(0).array() - 3.0 * queries.col(2).array()).matrix())
                  .cwiseAbs()
                  .maxCoeff(),
              1e-6);
    EXPECT_LT((predicted.col(2) - quadratic_function(queries)).cwiseAbs().maxCoeff(), 1e-6);
    // Beyond the extent, and the tenth over which holds are rounded off, an affine output goes on and nothing bends.
    for (Eigen::Index j = 0; j < 3; ++j) {
      Eigen::MatrixXd line = Eigen::MatrixXd::Constant(3, 3, 0.1);
      line.col(j) << 3.0, 5.0, 7.0;
      const Eigen::MatrixXd outside = model.predict(line);
      const Eigen::RowVectorXd bend = (outside.row(0) - 2.0 * outside.row(1) + outside.row(2)).tail(2);
      EXPECT_LT(bend.cwiseAbs().maxCoeff(), 1e-9);
      EXPECT_NEAR(outside(1, 1), 1.0 + line(1, 0) - 3.0 * line(1, 2), 1e-6);
    }
  }
}

// Both the tree and every leaf are those of a linear model with the products given as further columns.
TEST(Quadratic, LeavesAreLeastSquaresOnExpandedColumns) {
  for (std::uint64_t seed = 1; seed <= 3; ++seed) {
    const Eigen::MatrixXd x = oracle::uniform(300, 2, seed);
    const Eigen::VectorXd y = oracle::curved(x, 0.05, seed);
    const llmt::Model model = llmt::fit(x, y, only(ValidityChoice::crisp, 6, LocalTerms::quadratic)).model;
    ASSERT_EQ(model.regressors().size(), 5U);
    Eigen::MatrixXd expanded(300, 5);
    expanded << x, x.col(0).cwiseAbs2(), x.col(0).cwiseProduct(x.col(1)), x.col(1).cwiseAbs2();
    llmt::FitOptions linear = only(ValidityChoice::crisp, 6, LocalTerms::linear);
    linear.split_inputs = {0, 1};
    const llmt::Model same = llmt::fit(expanded, y, linear).model;
    const std::vector<llmt::Node>& nodes = model.partitions()[0].nodes;
    ASSERT_EQ(nodes.size(), same.partitions()[0].nodes.size());
    for (std::size_t i = 0; i < nodes.size(); ++i) {
      EXPECT_EQ(nodes[i].split_input, same.partitions()[0].nodes[i].split_input);
      EXPECT_NEAR(nodes[i].threshold, same.partitions()[0].nodes[i].threshold, 1e-9);
    }
    const Eigen::MatrixXi leaf_of = model.leaf_of(x);
    const std::vector<llmt::Leaf> leaves = model.leaves(0);
    const Eigen::MatrixXd columns = with_constant(regressors_of(model, x));
    for (std::size_t leaf = 0; leaf < leaves.size(); ++leaf) {
      std::vector<Eigen::Index> rows;
      for (Eigen::Index i = 0; i < 300; ++i) {
        if (leaf_of(i, 0) == static_cast<int>(leaf)) {
          rows.push_back(i);
        }
      }
      const Eigen::VectorXd expected = oracle::least_squares(columns(rows, Eigen::all), y(rows));
      EXPECT_NEAR(leaves[leaf].intercept(0), expected(0), 1e-8);
      EXPECT_LT((leaves[leaf].slope.row(0).transpose() - expected.tail(5)).cwiseAbs().maxCoeff(), 1e-8);
    }
  }
}

TEST(Quadratic, PredictionIsWhatTheEquationsSayAloneAndInBlocksAndFromAFile) {
  for (const ValidityChoice validity : kinds) {
    Eigen::MatrixXd x = oracle::uniform(400, 4, 3);
    const Eigen::VectorXd y = oracle::curved(x, 0.05);
    for (Eigen::Index i = 0; i < 400; ++i) {
      x(i, 3) = static_cast<double>(i % 3);
      if (i % 7 == 0) {
        x(i, 1) = missing;
      }
    }
    llmt::FitOptions options = only(validity, 5, LocalTerms::quadratic);
    options.categorical_inputs = {3};
    const llmt::Model model = llmt::fit(x, y, options).model;
    ASSERT_EQ(model.regressors().size(), 3U + 2U + 6U);  // numbers, levels, products of numbers
    Eigen::MatrixXd queries = 1.6 * oracle::uniform(200, 4, 4);
    for (Eigen::Index i = 0; i < 200; ++i) {
      queries(i, 3) = static_cast<double>(i % 4);
      if (i % 5 == 0) {
        queries(i, i % 3) = missing;
      }
    }
    const Eigen::MatrixXd predicted = model.predict(queries);
    EXPECT_LT((predicted - oracle::predict_rows(model, queries)).cwiseAbs().maxCoeff(), 1e-11);
    const llmt::Model read = llmt::from_json(llmt::to_json(model));
    EXPECT_EQ(llmt::to_json(read), llmt::to_json(model));
    for (Eigen::Index i = 0; i < 200; ++i) {
      EXPECT_EQ(model.predict(queries.row(i))(0, 0), predicted(i, 0));
      EXPECT_EQ(read.predict(queries.row(i))(0, 0), predicted(i, 0));
    }
  }
}

TEST(Quadratic, JacobianIsTheDifferenceQuotient) {
  for (const ValidityChoice validity : kinds) {
    const Eigen::MatrixXd x = oracle::uniform(400, 3, 5);
    Eigen::MatrixXd y(400, 2);
    y << oracle::curved(x), quadratic_function(x).cwiseAbs();
    llmt::FitOptions options = only(validity, 8, LocalTerms::quadratic);
    // Without jumps of the second derivative, at which difference quotients would be less exact.
    const llmt::Model model = random_trees::with_smoothness(llmt::fit(x, y, options).model, 2);
    const Eigen::MatrixXd points = 1.3 * oracle::uniform(200, 3, 6);  // some beyond the extent
    constexpr double step = 1e-5;
    std::vector<double> differences;
    for (Eigen::Index i = 0; i < points.rows(); ++i) {
      const Eigen::MatrixXd jacobian = model.jacobian(points.row(i).transpose());
      for (Eigen::Index j = 0; j < 3; ++j) {
        Eigen::MatrixXd around = points.row(i).replicate(2, 1);
        around(0, j) -= step;
        around(1, j) += step;
        const Eigen::MatrixXd values = model.predict(around);
        differences.push_back(
            ((values.row(1) - values.row(0)).transpose() / (2.0 * step) - jacobian.col(j)).cwiseAbs().maxCoeff());
      }
    }
    // Across a threshold of a crisp tree, or where a hold sets in, quotients are of two pieces.
    std::ranges::sort(differences);
    EXPECT_LT(differences[differences.size() * 98 / 100], 1e-6);
  }
}

TEST(Quadratic, ProductsAreOfNumbersThatVary) {
  Eigen::MatrixXd x = oracle::uniform(200, 4, 7);
  x.col(1) = (x.col(1).array() > 0.0).cast<double>();  // two values
  x.col(2).setConstant(3.0);
  const llmt::Model model =
      llmt::fit(x, oracle::curved(x), only(ValidityChoice::crisp, 1, LocalTerms::quadratic)).model;
  std::vector<std::pair<int, int>> products;
  for (const llmt::Regressor& regressor : model.regressors()) {
    if (regressor.second_input >= 0) {
      products.emplace_back(regressor.input, regressor.second_input);
    }
  }
  EXPECT_EQ(products, (std::vector<std::pair<int, int>>{{0, 0}, {0, 1}, {0, 3}, {1, 3}, {3, 3}}));
}

TEST(LocalTerms, AutomaticTakesProductsWhereTheyHelpAndLeavesLeastSquaresBeyondChanceOnly) {
  int quadratic = 0;
  for (std::uint64_t seed = 1; seed <= 4; ++seed) {
    const Eigen::MatrixXd x = oracle::uniform(300, 3, seed);
    llmt::Random random(seed);
    Eigen::MatrixXd y(300, 2);
    for (Eigen::Index i = 0; i < 300; ++i) {
      y(i, 0) = quadratic_function(x.row(i))(0) + 0.1 * random.normal();
      y(i, 1) = x(i, 0) - x(i, 2) + 0.1 * random.normal();
    }
    llmt::FitOptions options;
    options.validity = ValidityChoice::crisp;
    options.terms = LocalTerms::automatic;
    const llmt::FitSummary curved = llmt::fit(x, y.col(0), options).summary;
    EXPECT_TRUE(curved.quadratic);
    ASSERT_EQ(curved.other_terms.size(), 1U);
    EXPECT_LT(curved.partitions[0].chosen.rmse, curved.other_terms[0].rmse);
    quadratic += llmt::fit(x, y.col(1), options).summary.quadratic ? 1 : 0;
    if (seed == 1) {
      EXPECT_TRUE(llmt::fit(x, y, options).summary.quadratic);  // both outputs, one choice
      options.folds.count = 0;
      EXPECT_FALSE(llmt::fit(x, y.col(0), options).summary.quadratic);
    }
  }
  EXPECT_LE(quadratic, 1);  // of four; beyond two standard errors is 5 % each
  llmt::FitOptions options;
  options.max_leaves = 1;
  options.terms = LocalTerms::automatic;
  const Eigen::MatrixXd wide = oracle::uniform(100, 14, 1);
  EXPECT_FALSE(llmt::fit(wide, quadratic_function(wide), options).summary.quadratic);
}

// Greedy choice by refitting with every regressor at every step, and AICc of every step.
std::vector<Eigen::Index> refit_selection(const Eigen::MatrixXd& x, const Eigen::VectorXd& y) {
  const double rows = static_cast<double>(x.rows());
  const auto aicc = [&](double rss, double coefficients) {
    const double k = coefficients + 1.0;
    return rows * std::log(rss) + 2.0 * k + 2.0 * k * (k + 1.0) / (rows - k - 1.0);
  };
  std::vector<Eigen::Index> chosen;
  std::vector<Eigen::Index> best;
  double smallest = aicc((y.array() - y.mean()).square().sum(), 1.0);
  while (std::ssize(chosen) < x.cols() && chosen.size() < best.size() + 10) {
    double least = std::numeric_limits<double>::infinity();
    Eigen::Index next = -1;
    for (Eigen::Index k = 0; k < x.cols(); ++k) {
      if (std::ranges::find(chosen, k) == chosen.end()) {
        std::vector<Eigen::Index> tried = chosen;
        tried.push_back(k);
        const double rss = static_cast<double>(oracle::rss(x(Eigen::all, tried), y));
        if (rss < least) {
          least = rss;
          next = k;
        }
      }
    }
    chosen.push_back(next);
    if (const double criterion = aicc(least, 1.0 + static_cast<double>(chosen.size())); criterion < smallest) {
      smallest = criterion;
      best = chosen;
    }
  }
  std::ranges::sort(best);
  return best;
}

TEST(ForwardSelection, IsThatOfARefitAtEveryStep) {
  std::size_t kept = 0;
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    Eigen::MatrixXd x = oracle::uniform(40, 12, seed);
    x.rightCols(6) += 2.0 * x.leftCols(6);  // far from orthogonal
    x.col(3).array() += 100.0;
    llmt::Random random(seed);
    Eigen::VectorXd y = 2.0 * x.col(0) - x.col(7) + 0.3 * x.col(4);
    for (double& value : y) {
      value += 5.0 + 0.5 * random.normal();
    }
    const Eigen::MatrixXd a = with_constant(x);
    const llmt::LocalSums sums{a.transpose() * a, a.transpose() * y, Eigen::VectorXd::Constant(1, y.squaredNorm())};
    std::vector<Eigen::Index> expected = {0};
    for (const Eigen::Index k : refit_selection(x, y)) {
      expected.push_back(k + 1);
    }
    EXPECT_EQ(llmt::select_regressors(sums, 1.0), expected) << "seed " << seed;
    kept += expected.size() - 1;
  }
  EXPECT_GT(kept, 40U);
  EXPECT_LT(kept, 140U);
}

TEST(ForwardSelection, TakesNothingOfNoiseNorOfConstantAndDoubledColumns) {
  Eigen::MatrixXd x = oracle::uniform(500, 4, 1);
  x.col(1) = x.col(0);
  x.col(2).setConstant(1e3);
  const Eigen::VectorXd y = x.col(0);
  const Eigen::MatrixXd a = with_constant(x);
  const llmt::LocalSums sums{a.transpose() * a, a.transpose() * y, Eigen::VectorXd::Constant(1, y.squaredNorm())};
  EXPECT_EQ(llmt::select_regressors(sums, 1.0), (std::vector<Eigen::Index>{0, 1}));
  const Eigen::VectorXd constant = Eigen::VectorXd::Constant(500, 4.0);
  const llmt::LocalSums level{a.transpose() * a, a.transpose() * constant,
                              Eigen::VectorXd::Constant(1, constant.squaredNorm())};
  EXPECT_EQ(llmt::select_regressors(level, 1.0), (std::vector<Eigen::Index>{0}));
}

// Slopes that are not selected are exactly 0; the others are least squares on all leaves at once, drawn to those of
// each.
TEST(Sparse, JointEstimateIsLeastSquaresOfTheSelectedColumns) {
  for (const ValidityChoice validity : kinds) {
    const Eigen::MatrixXd x = oracle::uniform(300, 4, 8);
    const Eigen::VectorXd y = oracle::curved(x, 0.1);
    const llmt::FitResult result = llmt::fit(x, y, only(validity, 4, LocalTerms::quadratic, SparseChoice::always));
    EXPECT_TRUE(result.summary.partitions[0].chosen.candidate.sparse);
    const llmt::Model& model = result.model;
    const std::vector<llmt::Leaf> leaves = model.leaves(0);
    const Eigen::MatrixXd validities = model.validities(x, 0);
    const Eigen::MatrixXd columns = with_constant(regressors_of(model, x));
    const double ridge = validity == ValidityChoice::crisp ? 1.0 : 1e-3;
    std::vector<std::vector<Eigen::Index>> used;
    Eigen::Index unknowns = 0;
    for (const llmt::Leaf& leaf : leaves) {
      used.push_back({0});
      for (Eigen::Index k = 0; k < leaf.slope.cols(); ++k) {
        if (leaf.slope(0, k) != 0.0) {
          used.back().push_back(k + 1);
        }
      }
      EXPECT_EQ(leaf.rank, std::ssize(used.back()));
      EXPECT_LT(leaf.rank, 15);
      unknowns += leaf.rank;
    }
    EXPECT_EQ(result.summary.partitions[0].coefficients, unknowns);
    Eigen::MatrixXd stacked = Eigen::MatrixXd::Zero(300 * (std::ssize(leaves) + 1), unknowns);
    Eigen::VectorXd target = Eigen::VectorXd::Zero(stacked.rows());
    target.head(300) = y;
    Eigen::Index at = 0;
    for (std::size_t leaf = 0; leaf < leaves.size(); ++leaf) {
      const Eigen::Index l = static_cast<Eigen::Index>(leaf);
      const Eigen::Index count = std::ssize(used[leaf]);
      const Eigen::MatrixXd a = columns(Eigen::all, used[leaf]);
      const Eigen::VectorXd roots = validities.col(l).cwiseSqrt();
      const Eigen::VectorXd local = oracle::least_squares(roots.asDiagonal() * a, roots.asDiagonal() * y);
      const Eigen::MatrixXd anchor = std::sqrt(ridge) * (roots.asDiagonal() * a);
      stacked.block(0, at, 300, count) = validities.col(l).asDiagonal() * a;
      stacked.block(300 * (l + 1), at, 300, count) = anchor;
      target.segment(300 * (l + 1), 300) = anchor * local;
      at += count;
    }
    const Eigen::VectorXd expected = oracle::least_squares(stacked, target);
    at = 0;
    for (std::size_t leaf = 0; leaf < leaves.size(); ++leaf) {
      EXPECT_NEAR(leaves[leaf].intercept(0), expected(at), 1e-4);
      for (std::size_t k = 1; k < used[leaf].size(); ++k) {
        EXPECT_NEAR(leaves[leaf].slope(0, used[leaf][k] - 1), expected(at + static_cast<Eigen::Index>(k)), 1e-4);
      }
      at += std::ssize(used[leaf]);
    }
  }
}

TEST(Sparse, LeverageAndParametersAreOfTheSelectedColumns) {
  const Eigen::MatrixXd x = oracle::uniform(200, 6, 9);
  llmt::Random random(9);
  Eigen::VectorXd y = x.col(1) - 2.0 * x.col(4);
  for (double& value : y) {
    value += 0.1 * random.normal();
  }
  const llmt::FitOptions options = only(ValidityChoice::crisp, 1, LocalTerms::linear, SparseChoice::always);
  const llmt::Model model = llmt::fit(x, y, options).model;
  const llmt::Leaf leaf = model.leaves(0)[0];
  std::vector<Eigen::Index> used;
  for (Eigen::Index k = 0; k < 6; ++k) {
    if (leaf.slope(0, k) != 0.0) {
      used.push_back(k);
    }
  }
  EXPECT_LT(used.size(), 6U);
  const Eigen::MatrixXd a = with_constant(x(Eigen::all, used));
  const Eigen::MatrixXd hat = a * (a.transpose() * a).inverse() * a.transpose();
  const std::vector<llmt::Extrapolation> found = model.extrapolation(x);
  for (Eigen::Index i = 0; i < 200; ++i) {
    EXPECT_NEAR(found[i].leverage, hat(i, i), 1e-5);
  }
  const llmt::ComparisonResult compared = llmt::compare(x, y, {{"sparse", options}});
  EXPECT_EQ(compared.methods[0].parameters, 1 + std::ssize(used));
}

TEST(Sparse, IsTakenWhereFewInputsCountAndHeldOutRowsSaySo) {
  const Eigen::MatrixXd x = oracle::uniform(120, 12, 10);
  llmt::Random random(10);
  Eigen::VectorXd y = (x.col(0).array() > 0.0).select(3.0 * x.col(1), -3.0 * x.col(2));
  for (double& value : y) {
    value += 0.3 * random.normal();
  }
  llmt::FitOptions options;
  options.validity = ValidityChoice::crisp;
  const llmt::FitSummary full = llmt::fit(x, y, options).summary;
  options.sparse = SparseChoice::automatic;
  const llmt::FitSummary sparse = llmt::fit(x, y, options).summary;
  EXPECT_TRUE(sparse.partitions[0].chosen.candidate.sparse);
  EXPECT_LT(sparse.partitions[0].chosen.rmse, full.partitions[0].chosen.rmse);
}

TEST(LocalModels, SameBytesAtAnyNumberOfThreadsAndOrderOfRowsChangesRoundingAlone) {
  const Eigen::MatrixXd x = oracle::uniform(250, 3, 11);
  Eigen::MatrixXd y(250, 2);
  y << oracle::curved(x, 0.1), quadratic_function(x);
  llmt::FitOptions options;
  options.terms = LocalTerms::automatic;
  options.sparse = SparseChoice::automatic;
  options.max_leaves = 8;
  options.max_threads = 1;
  const llmt::Model one = llmt::fit(x, y, options).model;
  options.max_threads = 3;
  EXPECT_EQ(llmt::to_json(one), llmt::to_json(llmt::fit(x, y, options).model));
  const llmt::FitOptions always = only(ValidityChoice::blend, 5, LocalTerms::quadratic, SparseChoice::always);
  const Eigen::MatrixXd queries = 1.2 * oracle::uniform(100, 3, 12);
  EXPECT_LT((llmt::fit(x, y, always).model.predict(queries) -
             llmt::fit(x.colwise().reverse(), y.colwise().reverse(), always).model.predict(queries))
                .cwiseAbs()
                .maxCoeff(),
            1e-7);
}

TEST(LocalModels, MistakesAreNamed) {
  const Eigen::MatrixXd x = oracle::uniform(50, 14, 1);
  const Eigen::VectorXd y = x.col(0);
  EXPECT_EQ(message_of([&] { llmt::fit(x, y, only(ValidityChoice::crisp, 2, LocalTerms::quadratic)); }),
            "llmt::fit: the number of numeric regression inputs of quadratic local models (terms) is 14, "
            "it must be at most 13; regression_inputs chooses them");
  Eigen::MatrixXd large = x.leftCols(2);
  large(7, 1) = 1e80;
  EXPECT_EQ(message_of([&] { llmt::fit(large, y, only(ValidityChoice::crisp, 2, LocalTerms::quadratic)); }),
            "llmt::fit: a magnitude in inputs, with quadratic local models, is 1e+80, it must be at most 1e70");
  llmt::FitOptions options = only(ValidityChoice::blend, 2, LocalTerms::linear, SparseChoice::always);
  options.expert.estimation = llmt::Estimation::as_grown;
  EXPECT_EQ(
      message_of([&] { llmt::fit(x, y, options); }),
      "llmt::fit: sparse is always, it must be never where expert.estimation is as-grown, for those models are full");
  const llmt::Model model = llmt::fit(x.leftCols(2), y, only(ValidityChoice::crisp, 1, LocalTerms::quadratic)).model;
  std::vector<llmt::Regressor> regressors = model.regressors();
  regressors.back().second_input = 2;
  EXPECT_EQ(message_of([&] { llmt::Model(model.inputs(), model.outputs(), regressors, model.partitions()); }),
            "llmt::Model: regressor of inputs 1 and 2: a product is of two numeric inputs, the second not below the "
            "first");
}

}  // namespace
