// Inputs whose numbers are codes.
#include "model/codes.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <stdexcept>

#include "llmt/compare.hpp"
#include "llmt/explain.hpp"
#include "llmt/fit.hpp"
#include "llmt/random.hpp"
#include "oracles/edited.hpp"
#include "oracles/oracles.hpp"
#include "oracles/samples.hpp"
#include "oracles/thrown.hpp"

namespace {

using oracle::replaced;

const std::vector<double> codes = {-2.0, 3.0, 4.0, 7.0};

// y = x_1 times a factor of the level x_0; a third input does nothing.
llmt::FitResult fitted() {
  Eigen::MatrixXd x = oracle::uniform(200, 3, 1);
  Eigen::MatrixXd y(200, 1);
  for (int i = 0; i < 200; ++i) {
    x(i, 0) = i % 4;
    y(i, 0) = (i % 4 == 1 ? -1.0 : i % 4 == 3 ? 3.0 : 1.0) * (1.0 + x(i, 1));
  }
  return llmt::fit({.inputs = x, .outputs = y, .categorical_inputs = {0}}, {.choose_inputs = false});
}

llmt::Model coded(const llmt::Model& model) { return llmt::with_codes(model, {codes, {}, {}}); }

// Rows as the two models take them.
struct Queries {
  Eigen::MatrixXd positions;
  Eigen::MatrixXd numbers;
};

Queries queries(Eigen::Index rows) {
  Queries made{1.5 * oracle::uniform(rows, 3, 2), {}};
  made.numbers = made.positions;
  for (Eigen::Index i = 0; i < rows; ++i) {
    made.positions(i, 0) = static_cast<double>(i % 4);
    made.numbers(i, 0) = codes[i % 4];
  }
  return made;
}

TEST(Codes, NearestCodeCountsAndOfTwoTheSmaller) {
  const llmt::InputColumn input{.name = "x", .levels = {"-2", "3", "4", "7"}, .codes = codes};
  const std::vector<std::pair<double, double>> expected = {{-1e9, 0}, {-2, 0},    {0.5, 0},  {0.51, 1}, {3, 1},
                                                           {3.5, 1},  {3.501, 2}, {5.5, 2},  {5.6, 3},  {7, 3},
                                                           {8, 3},    {1e300, 3}, {-0.0, 0}, {2.0, 1}};
  for (const auto& [value, position] : expected) EXPECT_EQ(llmt::position_of(input, value), position) << value;
  EXPECT_TRUE(std::isnan(llmt::position_of(input, oracle::missing)));
  EXPECT_TRUE(std::isinf(llmt::position_of(input, -std::numeric_limits<double>::infinity())));
  EXPECT_EQ(llmt::position_of({.name = "x"}, 2.3), 2.3);
}

TEST(Codes, ModelOfCodesSaysWhatThatOfPositionsSays) {
  const llmt::Model of_positions = fitted().model;
  const llmt::Model of_codes = coded(of_positions);
  for (const Eigen::Index rows : {5, 300}) {
    Queries made = queries(rows);
    made.positions(1, 0) = made.numbers(1, 0) = oracle::missing;
    EXPECT_EQ(of_codes.predict(made.numbers), of_positions.predict(made.positions));
    EXPECT_EQ(of_codes.leaf_of(made.numbers), of_positions.leaf_of(made.positions));
    EXPECT_EQ(of_codes.validities(made.numbers, 0), of_positions.validities(made.positions, 0));
    EXPECT_EQ(of_codes.standard_errors(made.numbers), of_positions.standard_errors(made.positions));
    EXPECT_EQ(llmt::importance(of_codes, made.numbers), llmt::importance(of_positions, made.positions));
    EXPECT_EQ(llmt::largest_jump(of_codes, made.numbers), llmt::largest_jump(of_positions, made.positions));
    const Eigen::VectorXd number = made.numbers.row(3);
    const Eigen::VectorXd position = made.positions.row(3);
    EXPECT_EQ(of_codes.jacobian(number), of_positions.jacobian(position));
    EXPECT_EQ(llmt::attribute(of_codes, number).contributions, llmt::attribute(of_positions, position).contributions);
  }
}

TEST(Codes, ColumnIsDescribedByCodes) {
  const llmt::Model model = coded(fitted().model);
  const llmt::InputColumn& input = model.inputs()[0];
  EXPECT_EQ(input.low, -2.0);
  EXPECT_EQ(input.high, 7.0);
  EXPECT_GT(input.centre, 3.0);
  EXPECT_LT(input.centre, 4.0);
  EXPECT_EQ(input.levels, (std::vector<std::string>{"-2", "3", "4", "7"}));
  Eigen::MatrixXd x = Eigen::MatrixXd::Zero(2, 3);
  x.col(0) << 16.0, 4.0;
  EXPECT_EQ(model.extrapolation(x)[0].distance, 1.0);
  EXPECT_EQ(model.extrapolation(x)[1].distance, 0.0);
  EXPECT_EQ(model.named({"a", "b", "c"}, {"u"}, {{}, {}, {}}).inputs()[0].codes, codes);
  EXPECT_EQ(model.prefix(1).inputs()[0].codes, codes);
}

TEST(Codes, InfiniteNumbersAreRefused) {
  const llmt::Model model = coded(fitted().model);
  Eigen::MatrixXd x = Eigen::MatrixXd::Zero(100, 3);
  x(7, 0) = std::numeric_limits<double>::infinity();
  EXPECT_THROW(model.predict(x), std::invalid_argument);
  EXPECT_THROW(model.predict(x.topRows(8)), std::invalid_argument);
}

TEST(Codes, FilesKeepThem) {
  const llmt::Model model = coded(fitted().model);
  const std::string text = to_json(model);
  EXPECT_NE(text.find("\"version\": 4"), std::string::npos);
  const llmt::Model back = llmt::from_json(text);
  EXPECT_EQ(to_json(back), text);
  EXPECT_EQ(back.predict(queries(50).numbers), model.predict(queries(50).numbers));
  EXPECT_EQ(to_json(fitted().model).find("\"version\": 4"), std::string::npos);
}

TEST(Codes, NonsenseInFilesIsRefused) {
  const std::string text = to_json(coded(fitted().model));
  const std::size_t begin = text.find("\"codes\": ") + 9;
  const std::string list = text.substr(begin, text.find(']', begin) + 1 - begin);
  const auto error_of = [&](const std::string& part, const std::string& by) {
    const std::string file = replaced(text, part, by);
    return oracle::thrown<std::runtime_error>([&] { llmt::from_json(file, "m"); });
  };
  EXPECT_EQ(error_of("\"version\": 4", "\"version\": 3"), "m: /inputs/0/codes: a file of version 3 has no such member");
  EXPECT_EQ(error_of(list, "[]"), "m: /inputs/0/codes: it is empty");
  EXPECT_EQ(error_of(list, "[-2, 3, 3, 7]"),
            "m: /inputs/0: \"x1\": 4 codes for 4 levels; they must be finite, and ascend");
  EXPECT_EQ(error_of("\"codes\": ", "\"levels\": [\"a\"], \"codes\": "),
            "m: /inputs/0/codes: an input has levels or codes, not both");
  EXPECT_EQ(error_of(list, "[-2, 3, 4]").find("m: /"), 0U);
}

TEST(Codes, IntervalsOfOtherCodesAreRefused) {
  const llmt::FitResult result = fitted();
  std::vector<llmt::Model> folds;
  for (const llmt::Model& fold : result.intervals.models()) folds.push_back(coded(fold));
  const llmt::Intervals intervals(folds, result.intervals.parts());
  const std::string path = testing::TempDir() + "codes_test.json";
  EXPECT_NO_THROW(save(coded(result.model), intervals, path));
  EXPECT_FALSE(llmt::load_with_intervals(path).intervals.empty());
  EXPECT_THROW(save(result.model, intervals, path), std::invalid_argument);
}

}  // namespace
