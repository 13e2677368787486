// A sum of trees and a taught tree do not depend on the order of the columns, nor on their units.
#include <gtest/gtest.h>

#include <Eigen/Core>
#include <limits>
#include <string>
#include <vector>

#include "data/column_order.hpp"
#include "llmt/boosted.hpp"
#include "llmt/random.hpp"
#include "llmt/teach.hpp"

namespace {

// Numbers, few values, missing values, categories; products and differences, so that pairs of inputs are tried.
llmt::TrainingData rows_of_all_kinds(Eigen::Index rows) {
  llmt::Random random(5);
  llmt::TrainingData data;
  data.inputs.resize(rows, 7);
  data.outputs.resize(rows, 1);
  for (Eigen::Index i = 0; i < rows; ++i) {
    for (Eigen::Index j = 0; j < 6; ++j) data.inputs(i, j) = random.uniform();
    data.inputs(i, 5) = static_cast<double>(random.below(4));
    data.inputs(i, 6) = static_cast<double>(random.below(3));
    const auto x = data.inputs.row(i);
    data.outputs(i, 0) = 10.0 * x(0) * x(1) + 8.0 * std::abs(x(2) - x(3)) + x(4) + x(5) * (x(6) == 1.0 ? 1.0 : -1.0) +
                         0.3 * random.normal();
    if (random.uniform() < 0.05) data.inputs(i, 1) = std::numeric_limits<double>::quiet_NaN();
  }
  data.levels = {{}, {}, {}, {}, {}, {}, {"red", "green", "blue"}};
  data.input_names = {"a", "b", "c", "d", "e", "f", "colour"};
  return data;
}

const std::vector<int> other_order = {6, 3, 0, 5, 1, 4, 2};

llmt::TrainingData permuted(const llmt::TrainingData& data, const std::vector<int>& order) {
  llmt::TrainingData result = data;
  result.inputs = data.inputs(Eigen::all, order);
  for (std::size_t j = 0; j < order.size(); ++j) {
    result.input_names[j] = data.input_names[order[j]];
    result.levels[j] = data.levels[order[j]];
  }
  return result;
}

// A row count for each way to make a sum: parts in turn, a race, held-out rows alone.
TEST(ColumnOrder, ASumIsTheSameWhereverItsInputsStand) {
  for (const Eigen::Index rows : {200, 1000, 5500}) {
    const llmt::TrainingData data = rows_of_all_kinds(rows);
    const llmt::TrainingData other = permuted(data, other_order);
    const llmt::BoostOptions options{.max_rounds = 30};
    const llmt::BoostResult one = llmt::fit_boosted(data, options);
    const llmt::BoostResult two = llmt::fit_boosted(other, options);
    EXPECT_EQ(one.model.predict(data.inputs), two.model.predict(other.inputs)) << rows;
    EXPECT_EQ(one.summaries.front().variant, two.summaries.front().variant);
    for (std::size_t j = 0; j < other_order.size(); ++j) {
      EXPECT_EQ(two.model.inputs()[j].name, data.input_names[other_order[j]]);
      EXPECT_EQ(two.model.inputs()[j].levels, one.model.inputs()[other_order[j]].levels);
      EXPECT_EQ(two.model.inputs()[j].high, one.model.inputs()[other_order[j]].high);
    }
  }
}

TEST(ColumnOrder, ASumIsTheSameInOtherUnits) {
  const llmt::TrainingData data = rows_of_all_kinds(1500);
  llmt::TrainingData other = data;
  for (Eigen::Index j = 0; j < 5; ++j) other.inputs.col(j) = 1024.0 * data.inputs.col(j).array();  // exactly
  const llmt::BoostOptions options{.max_rounds = 60};
  EXPECT_EQ(llmt::fit_boosted(data, options).model.predict(data.inputs),
            llmt::fit_boosted(other, options).model.predict(other.inputs));
}

TEST(ColumnOrder, ATaughtTreeIsTheSameToRounding) {
  llmt::TrainingData data = rows_of_all_kinds(150);
  const llmt::TrainingData other = permuted(data, other_order);
  const Eigen::MatrixXd one = llmt::fit_taught(data).fit.model.predict(data.inputs);
  const Eigen::MatrixXd two = llmt::fit_taught(other).fit.model.predict(other.inputs);
  EXPECT_LT((one - two).cwiseAbs().maxCoeff(), 1e-9);
}

TEST(ColumnOrder, GoesByValuesAndNotByPlacesOrUnits) {
  const Eigen::MatrixXd table = rows_of_all_kinds(50).inputs;
  const std::vector<int> order = llmt::column_order(table);
  const std::vector<int> of_other = llmt::column_order(table(Eigen::all, other_order));
  for (std::size_t k = 0; k < order.size(); ++k) EXPECT_EQ(other_order[of_other[k]], order[k]) << k;
  const Eigen::MatrixXd scaled = table.array() * 0.3 + 7.0;
  EXPECT_EQ(llmt::column_order(scaled), order);
  // Equal columns keep their order, and a table of one row has no order but that of its places.
  EXPECT_EQ(llmt::column_order(Eigen::MatrixXd::Zero(5, 3)), (std::vector<int>{0, 1, 2}));
  EXPECT_EQ(llmt::column_order(Eigen::MatrixXd::Random(1, 3)), (std::vector<int>{0, 1, 2}));
}

}  // namespace
