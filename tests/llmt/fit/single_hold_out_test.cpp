// What is done with many rows: one fold is held out once.
#include <gtest/gtest.h>

#include <Eigen/Core>
#include <numeric>
#include <string>
#include <vector>

#include "data/dataset.hpp"
#include "data/fold_rows.hpp"
#include "estimation/jumps.hpp"
#include "llmt/model.hpp"
#include "oracles/oracles.hpp"
#include "oracles/random_trees.hpp"
#include "selection/selection.hpp"

namespace {

using namespace random_trees;

TEST(SingleHoldOut, ManyRowsAreHeldOutOnce) {
  EXPECT_EQ(llmt::selection_folds(llmt::single_hold_out_rows - 1, {}).size(), 5U);
  EXPECT_EQ(llmt::selection_folds(llmt::single_hold_out_rows, {}).size(), 1U);
}

TEST(SingleHoldOut, SameChoiceAtAnyNumberOfThreadsAndTheBestBlendIsMadeFromAllRows) {
  const Data d = data(51, 400);
  const llmt::Table table{d.x, d.y, Eigen::VectorXd::Ones(400), {0, 0, 0}, {0, 1, 2}, {0, 1, 2}};
  std::vector<int> learned(320);
  std::vector<int> held(80);
  std::iota(learned.begin(), learned.end(), 0);
  std::iota(held.begin(), held.end(), 320);
  const llmt::TrainingRows training = llmt::training_rows(table, learned);
  const std::vector<llmt::FoldRows> folds = {{training, llmt::query_rows(table, held, training)}};
  for (const llmt::ValidityKind kind : {llmt::ValidityKind::blend, llmt::ValidityKind::gaussian}) {
    llmt::FitOptions options = only(kinds[0], llmt::Estimation::as_grown, 20);
    const llmt::Model grown = llmt::fit(d.x(learned, Eigen::all), d.y.col(0)(learned), options).model;
    llmt::Partition partition = grown.partitions()[0];
    const Eigen::VectorXd jumps = llmt::jump_sizes(training, partition, 1);
    const std::vector<llmt::GrownTree> trees = {{partition, jumps}};
    const llmt::Candidates candidates{
        .kind = kind, .widths = {0.5, 1.0}, .jumps = {llmt::no_jump}, .ridges = {1e-4, 1e-2}, .shrinkages = {0.1}};
    llmt::Work uncounted;
    std::vector<llmt::Selection> chosen;
    for (const int threads : {1, 8}) {
      chosen.push_back(llmt::select(folds, trees, candidates, Eigen::VectorXd::Ones(1), threads, uncounted));
    }
    ASSERT_EQ(chosen[0].made.size(), 1U);  // a curved function is blended
    EXPECT_EQ(chosen[0].chosen.rmse, chosen[1].chosen.rmse);
    EXPECT_EQ(chosen[0].chosen.candidate.leaves, chosen[1].chosen.candidate.leaves);
    EXPECT_EQ(chosen[0].chosen.candidate.ridge, chosen[1].chosen.candidate.ridge);
    const auto text = [&](const llmt::Selection& selection) {
      return llmt::to_json({training.columns, {training.output_columns[0]}, training.regressors, {*selection.made[0]}});
    };
    EXPECT_EQ(text(chosen[0]), text(chosen[1]));
    // Its held-out error is that of the model from all training rows.
    const llmt::Model made{training.columns, {training.output_columns[0]}, training.regressors, {*chosen[0].made[0]}};
    const Eigen::MatrixXd predicted = made.predict(d.x(held, Eigen::all));
    EXPECT_NEAR(llmt::rmse(predicted, d.y.col(0)(held))(0), chosen[0].chosen.rmse, 1e-12);
  }
}

}  // namespace
