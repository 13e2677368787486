// A grown tree whose leaves have equations: which splits and terms it may have, and what they are worth.
#include <gtest/gtest.h>

#include <cmath>

#include "llmt/random.hpp"
#include "readable/input_walk.hpp"

namespace {

// Rows of one output that a tree is made from, and the columns that their table has.
struct SampledRows {
  Eigen::MatrixXd inputs;
  Eigen::MatrixXd outputs;
  std::vector<int> levels;  // of each input; 0: a number
  std::vector<int> signs = {};

  llmt::Table table() const {
    std::vector<int> all;
    for (int j = 0; j < static_cast<int>(inputs.cols()); ++j) all.push_back(j);
    llmt::Table result{inputs, outputs, Eigen::VectorXd::Ones(inputs.rows()), levels, all, all};
    result.slope_signs = signs;
    return result;
  }
};

llmt::TrainingRows all_rows(const llmt::Table& table) {
  std::vector<int> rows;
  for (int i = 0; i < static_cast<int>(table.inputs.rows()); ++i) rows.push_back(i);
  return llmt::training_rows(table, rows);
}

llmt::Sample sample_of_table(const llmt::Table& table) {
  return llmt::make_sample(all_rows(table), nullptr, {0}, Eigen::VectorXd::Ones(1));
}

llmt::EquationTree tree_of_all_inputs(const llmt::Sample& sample, const llmt::Form& form) {
  const std::vector<int>& inputs = sample.described.table->regression_inputs;
  return llmt::make_tree(sample, {}, {inputs, inputs, {}}, form);
}

SampledRows product_of_the_first_two(Eigen::Index inputs) {
  llmt::Random random(1);
  SampledRows rows{Eigen::MatrixXd(300, inputs), Eigen::MatrixXd(300, 1),
                   std::vector<int>(static_cast<std::size_t>(inputs), 0)};
  for (Eigen::Index i = 0; i < 300; ++i) {
    for (Eigen::Index j = 0; j < inputs; ++j) rows.inputs(i, j) = random.uniform(-1.0, 1.0);
    rows.outputs(i, 0) = rows.inputs(i, 0) * rows.inputs(i, 1) + 0.01 * random.normal();
  }
  return rows;
}

TEST(EquationTree, HasProductsOnlyInTheFormsOfFewInputsWithoutTrends) {
  const auto has_products = [](const SampledRows& rows, const llmt::Form& form) {
    const llmt::Table table = rows.table();
    const llmt::Sample sample = sample_of_table(table);
    llmt::EquationTree tree = tree_of_all_inputs(sample, form);
    return !tree.products_in(tree.pruned(0.0)).empty();
  };
  const llmt::Form with = {.products = true, .coarseness = 1.0, .splits = false};
  const llmt::Form without = {.products = false, .coarseness = 1.0, .splits = false};
  SampledRows rows = product_of_the_first_two(3);
  EXPECT_TRUE(has_products(rows, with));
  EXPECT_FALSE(has_products(rows, without));
  rows.signs = {1, 0, 0};
  EXPECT_FALSE(has_products(rows, with));
  EXPECT_TRUE(has_products(product_of_the_first_two(13), with));
  EXPECT_FALSE(has_products(product_of_the_first_two(14), with));
}

// Whole numbers, between which a rounded threshold moves no row.
TEST(EquationTree, ALeafHasFiveRowsAndARowForEachCoefficientOfTheSearch) {
  for (const Eigen::Index inputs : {1, 9}) {
    llmt::Random random(2);
    SampledRows rows{Eigen::MatrixXd(90, inputs), Eigen::MatrixXd(90, 1),
                     std::vector<int>(static_cast<std::size_t>(inputs), 0)};
    for (Eigen::Index i = 0; i < 90; ++i) {
      for (Eigen::Index j = 0; j < inputs; ++j)
        rows.inputs(i, j) = static_cast<double>((i * (2 * j + 1) + 11 * j) % 90);
      rows.outputs(i, 0) = (i < 4 ? -50.0 : i > 82 ? 50.0 : 0.0) + random.normal();
    }
    const llmt::Table table = rows.table();
    const llmt::Sample sample = sample_of_table(table);
    llmt::EquationTree tree = tree_of_all_inputs(sample, {.products = false, .coarseness = 0.1});
    const llmt::Partition partition = tree.partition(tree.pruned(0.0), {});
    EXPECT_GT(partition.num_leaves(), 1);
    for (const llmt::Node& node : partition.nodes) EXPECT_GE(node.samples, std::max<Eigen::Index>(5, inputs + 1));
  }
}

// N rows at -1 and 1, y = 2 x: a term of four symbols pays at ln N / N of the variance of 4, and then nothing is left.
TEST(EquationTree, TheSchwarzPriceOfDataWithoutNoiseIsTheLastAtWhichSomethingWasLeft) {
  SampledRows rows{Eigen::MatrixXd(16, 1), Eigen::MatrixXd(16, 1), {0}};
  rows.inputs << Eigen::VectorXd::Constant(8, -1.0), Eigen::VectorXd::Ones(8);
  rows.outputs = 2.0 * rows.inputs;
  const llmt::Table table = rows.table();
  const llmt::Sample sample = sample_of_table(table);
  llmt::EquationTree tree = tree_of_all_inputs(sample, {.products = false, .coarseness = 1.0, .splits = false});
  EXPECT_EQ(tree.variance(), 4.0);
  EXPECT_NEAR(tree.schwarz_price(), 4.0 * std::log(16.0) / 16.0 / 4.0, 1e-12);
  EXPECT_EQ(tree.extent(tree.pruned(tree.schwarz_price())).most_terms, 1);
}

// y = 2 a - b + 0.2 c, with b = a + 0.5 e: alone a has the slope 1, and beside it b one against its sign.
TEST(EquationTree, ATermOfTheWrongSignIsLeftOutAndOnlyThat) {
  llmt::Random random(3);
  SampledRows rows{Eigen::MatrixXd(400, 3), Eigen::MatrixXd(400, 1), {0, 0, 0}};
  for (Eigen::Index i = 0; i < 400; ++i) {
    const double a = random.normal();
    const double b = a + 0.5 * random.normal();
    const double c = random.normal();
    rows.inputs.row(i) << a, b, c;
    rows.outputs(i, 0) = 2.0 * a - b + 0.2 * c;
  }
  const llmt::Form form = {.products = false, .coarseness = 1.0, .splits = false};
  const auto importance = [&] {
    const llmt::Table table = rows.table();
    const llmt::Sample sample = sample_of_table(table);
    llmt::EquationTree tree = tree_of_all_inputs(sample, form);
    return tree.importance(tree.pruned(0.0));
  };
  EXPECT_GT(importance()(1), 0.1);
  rows.signs = {1, 1, 1};
  const Eigen::VectorXd gains = importance();
  EXPECT_GT(gains(0), 0.5);
  EXPECT_EQ(gains(1), 0.0);
  EXPECT_NEAR(gains(2), 0.04, 0.02);
}

// The grown split sends all rows to its left: its right side has a level that no row has.
TEST(EquationTree, ASplitThatSendsNoRowOneWayIsNone) {
  llmt::Random random(4);
  SampledRows rows{Eigen::MatrixXd(100, 2), Eigen::MatrixXd(100, 1), {0, 3}};
  for (Eigen::Index i = 0; i < 100; ++i) {
    rows.inputs.row(i) << random.uniform(), static_cast<double>(i % 2);
    rows.outputs(i, 0) = rows.inputs(i, 0) < 0.5 ? 0.0 : 9.0;
  }
  const llmt::Table table = rows.table();
  const llmt::Sample sample = sample_of_table(table);
  const auto rules = [&](const std::vector<int>& sides) {
    std::vector<llmt::Node> grown(5);
    grown[0].left = 1;
    grown[0].right = 2;
    grown[0].split_input = 1;
    grown[0].level_side = sides;
    grown[1].left = 3;
    grown[1].right = 4;
    grown[1].split_input = 0;
    grown[1].threshold = 0.5;
    llmt::EquationTree tree(sample, grown, llmt::terms_of(sample, {}, false), 1.0);
    return tree.extent(tree.pruned(0.0)).rules;
  };
  EXPECT_EQ(rules({-1, -1, 1}), 1);
  EXPECT_EQ(rules({1, 1, -1}), 1);
  EXPECT_EQ(rules({-1, 1, 0}), 3);
}

// The most frequent level has no regressor.
TEST(EquationTree, LevelsAreCentredAtTheirShares) {
  SampledRows rows{Eigen::MatrixXd(10, 1), Eigen::MatrixXd(10, 1), {3}};
  rows.inputs << 1, 1, 1, 1, 1, 0, 0, 0, 2, 2;
  rows.outputs.setOnes();
  const llmt::Table table = rows.table();
  const llmt::Sample sample = sample_of_table(table);
  ASSERT_EQ(sample.described.regressors.size(), 2U);
  EXPECT_EQ(sample.described.regressors[0].level, 0);
  EXPECT_NEAR(sample.described.regressors[0].centre, 0.3, 1e-15);
  EXPECT_NEAR(sample.described.regressors[1].centre, 0.2, 1e-15);
}

}  // namespace
