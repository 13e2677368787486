// How many local models are left when leaves are merged.
#include <gtest/gtest.h>

#include <Eigen/Core>
#include <cmath>
#include <string>
#include <vector>

#include "llmt/compare.hpp"
#include "llmt/random.hpp"
#include "oracles/random_trees.hpp"

namespace {

using namespace random_trees;

/// One affine model where both inputs are positive, another elsewhere: boxes need three leaves, models are two.
Data corner(std::uint64_t seed, std::ptrdiff_t rows) {
  llmt::Random random(seed);
  Data d{oracle::uniform(rows, 2, seed), Eigen::MatrixXd(rows, 2)};
  for (std::ptrdiff_t i = 0; i < rows; ++i) {
    const bool inside = d.x(i, 0) > 0.0 && d.x(i, 1) > 0.0;
    d.y(i, 1) = inside ? 2.0 - d.x(i, 0) : d.x(i, 0) + 0.5 * d.x(i, 1);  // the truth
    d.y(i, 0) = d.y(i, 1) + 0.3 * random.normal();
  }
  return d;
}

TEST(Merging, LeavesOfOneRegionThatIsNoBoxGetOneModel) {
  const Data test = corner(999, 2000);
  int recovered = 0;
  double merged = 0.0;
  double unmerged = 0.0;
  constexpr int seeds = 20;
  for (std::uint64_t seed = 1; seed <= seeds; ++seed) {
    const Data d = corner(seed, 400);
    llmt::FitOptions options;
    options.blend.validity = llmt::ValidityChoice::crisp;
    options.blend.shrinkages = {0.0};
    options.intervals = false;
    const auto error = [&](const llmt::Model& model) { return llmt::rmse(model.predict(test.x), test.y.col(1))(0); };
    unmerged += error(llmt::fit(d.x, d.y.col(0), options).model);
    options.growth.merge_leaves = true;
    const llmt::FitResult result = llmt::fit(d.x, d.y.col(0), options);
    merged += error(result.model);
    EXPECT_GE(result.summary.partitions[0].leaves, 3);
    recovered += result.summary.partitions[0].local_models == 2 ? 1 : 0;
  }
  EXPECT_GE(recovered, seeds * 3 / 4);
  EXPECT_LT(merged, unmerged);
}

TEST(Merging, SameBytesAtAnyNumberOfThreadsWithCategoriesAndMissingValues) {
  llmt::Random random(51);
  Eigen::MatrixXd x = oracle::uniform(400, 3, 51);
  const Eigen::MatrixXd y = oracle::curved(x, 0.3);
  for (std::ptrdiff_t i = 0; i < 400; ++i) {
    x(i, 1) = std::floor(2.0 * x(i, 1) + 2.0);
    if (i % 5 == 0) {
      x(i, static_cast<std::ptrdiff_t>(random.below(3))) = std::nan("");
    }
  }
  for (const llmt::ValidityChoice choice :
       {llmt::ValidityChoice::crisp, llmt::ValidityChoice::blend, llmt::ValidityChoice::gaussian}) {
    std::vector<std::string> models;
    std::vector<std::string> of_one_hold_out;
    for (const int threads : {1, 8}) {
      llmt::FitOptions options;
      options.blend.validity = choice;
      options.blend.widths = {1.0};
      options.growth.pruning = llmt::Pruning::weakest_link;
      options.growth.merge_leaves = true;
      options.growth.max_leaves = 20;
      options.categorical_inputs = {1};
      options.max_threads = threads;
      const llmt::FitResult result = llmt::fit(x, y, options);
      models.push_back(llmt::to_json(result.model));
      EXPECT_TRUE(result.model.predict(x).allFinite());
      EXPECT_EQ(result.summary.partitions[0].local_models, result.model.partitions()[0].num_local_models());
      EXPECT_LE(result.summary.partitions[0].local_models, result.summary.partitions[0].leaves);
      const llmt::Bounds bounds = result.intervals.predict(x, 0.9);
      EXPECT_TRUE((bounds.lower.array() <= bounds.upper.array()).all());
      options.selection.single_hold_out_rows = 400;
      of_one_hold_out.push_back(llmt::to_json(llmt::fit(x, y, options).model));
    }
    EXPECT_EQ(models[0], models[1]);
    EXPECT_EQ(of_one_hold_out[0], of_one_hold_out[1]);
  }
}

TEST(Merging, CompareShowsItBesideTheUnmergedTrees) {
  const Data d = corner(3, 300);
  llmt::FitOptions base;
  base.growth.merge_leaves = true;
  base.growth.pruning = llmt::Pruning::weakest_link;
  std::vector<llmt::Method> methods = llmt::usual_methods(base);
  std::erase_if(methods, [](const llmt::Method& method) { return method.name.rfind("crisp tree, RD", 0) != 0; });
  ASSERT_EQ(methods.size(), 2U);
  EXPECT_EQ(methods[1].name, "crisp tree, RD, pruned, merged");
  llmt::CompareOptions options;
  options.folds.count = 2;
  const llmt::ComparisonResult result = llmt::compare(d.x, d.y.leftCols(1), methods, options);
  EXPECT_FALSE(methods[0].options.growth.merge_leaves);
  EXPECT_EQ(result.methods[0].parameters, 4 * result.methods[0].leaves - 1);
  EXPECT_LT(result.methods[1].parameters, 4 * result.methods[1].leaves - 1);
}

}  // namespace
