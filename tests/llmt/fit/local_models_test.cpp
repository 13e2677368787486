// What quadratic local models promise.
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
#include "llmt/fit/local_models.hpp"
#include "oracles/oracles.hpp"
#include "oracles/predict_oracle.hpp"
#include "oracles/random_trees.hpp"

namespace {

using namespace local_models;

// The partition is that of a curved output; the others are affine and quadratic. Queries reach into corners without
// rows, where products lie beyond all those of the training rows.
TEST(Quadratic, AffineAndQuadraticDataAreReproducedInTheTrainingExtent) {
  for (const ValidityChoice validity : validities) {
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
  for (const ValidityChoice validity : validities) {
    Eigen::MatrixXd x = oracle::uniform(400, 4, 3);
    const Eigen::VectorXd y = oracle::curved(x, 0.05);
    for (Eigen::Index i = 0; i < 400; ++i) {
      x(i, 3) = static_cast<double>(i % 3);
      if (i % 7 == 0) {
        x(i, 1) = missing;
      }
    }
    const llmt::FitOptions options = only(validity, 5, LocalTerms::quadratic);
    const llmt::Model model = llmt::fit({.inputs = x, .outputs = y, .categorical_inputs = {3}}, options).model;
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
  for (const ValidityChoice validity : validities) {
    const Eigen::MatrixXd x = oracle::uniform(400, 3, 5);
    Eigen::MatrixXd y(400, 2);
    y << oracle::curved(x), quadratic_function(x).cwiseAbs();
    llmt::FitOptions options = only(validity, 8, LocalTerms::quadratic);
    // Without jumps of the second derivative, at which difference quotients would be less exact.
    const llmt::Model model = llmt::fit(x, y, options).model;
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
  EXPECT_EQ(thrown([&] { llmt::fit(x, y, only(ValidityChoice::crisp, 2, LocalTerms::quadratic)); }),
            "llmt::fit: the number of numeric regression inputs of quadratic local models (terms) is 14, "
            "it must be at most 13; regression_inputs chooses them");
  Eigen::MatrixXd large = x.leftCols(2);
  large(7, 1) = 1e80;
  EXPECT_EQ(thrown([&] { llmt::fit(large, y, only(ValidityChoice::crisp, 2, LocalTerms::quadratic)); }),
            "llmt::fit: a magnitude in inputs, with quadratic local models, is 1e+80, it must be at most 1e70");
  llmt::FitOptions options = only(ValidityChoice::blend, 2, LocalTerms::linear, SparseChoice::always);
  options.expert.estimation = llmt::Estimation::as_grown;
  EXPECT_EQ(
      thrown([&] { llmt::fit(x, y, options); }),
      "llmt::fit: sparse is always, it must be never where expert.estimation is as-grown, for those models are full");
  const llmt::Model model = llmt::fit(x.leftCols(2), y, only(ValidityChoice::crisp, 1, LocalTerms::quadratic)).model;
  std::vector<llmt::Regressor> regressors = model.regressors();
  regressors.back().second_input = 2;
  EXPECT_EQ(thrown([&] { llmt::Model(model.inputs(), model.outputs(), regressors, model.partitions()); }),
            "llmt::Model: regressor 4: inputs 1 and 2: a product is of two numeric inputs, the second not below the "
            "first");
}

}  // namespace
