// Records, lags, and the stretches that are held out.
#include <gtest/gtest.h>

#include <cmath>
#include <set>
#include <stdexcept>

#include "dynamics/stretches.hpp"
#include "dynamics/windows.hpp"
#include "llmt/lags.hpp"
#include "llmt/series.hpp"

namespace {

using llmt::Stretch;

TEST(Lags, AreReadAndWritten) {
  const std::vector<std::string> inputs = {"u", "a:b"};
  const std::vector<std::string> outputs = {"y"};
  const llmt::Lags lags = llmt::parse_lags("y:1-3,u:0-4,a:b:2,u:7,y:2", inputs, outputs);
  EXPECT_EQ(lags.outputs, (std::vector<std::vector<int>>{{1, 2, 3}}));
  EXPECT_EQ(lags.inputs, (std::vector<std::vector<int>>{{0, 1, 2, 3, 4, 7}, {2}}));
  EXPECT_EQ(llmt::longest_lag(lags), 7);
  EXPECT_EQ(llmt::text_of(lags, inputs, outputs), "y:1-3,u:0-4,u:7,a:b:2");
  EXPECT_EQ(llmt::parse_lags(llmt::text_of(lags, inputs, outputs), inputs, outputs), lags);
}

TEST(Lags, SayWhichOutputsAddUp) {
  const llmt::Lags lags = llmt::parse_lags("y:+1-3,u:0", {"u"}, {"x", "y"});
  EXPECT_EQ(lags.adds_up, (std::vector<bool>{false, true}));
  EXPECT_EQ(llmt::text_of(lags, {"u"}, {"x", "y"}), "y:+1-3,u:0");
  EXPECT_EQ(llmt::parse_lags("y:+1-3,u:0", {"u"}, {"x", "y"}), lags);
  EXPECT_EQ(llmt::column_names(llmt::columns_of(lags), {"u"}, {"x", "y"}),
            (std::vector<std::string>{"y(t-1)-y(t-2)", "y(t-2)-y(t-3)", "u(t)"}));
  llmt::Series series;
  series.outputs = Eigen::VectorXd::LinSpaced(6, 0.0, 5.0).array().square();
  series.inputs = Eigen::VectorXd::LinSpaced(6, 10.0, 15.0);
  const llmt::RegressorRows rows = llmt::regressor_rows(series, {{{1, 2}}, {{0}}, {true}}, {{0, 6}}, 4);
  EXPECT_EQ(rows.outputs.col(0), (Eigen::Vector2d{16.0 - 9.0, 25.0 - 16.0}));
  EXPECT_EQ(rows.last.col(0), (Eigen::Vector2d{9.0, 16.0}));
}

TEST(Lags, ThatCannotBeReadAreNamed) {
  const std::vector<std::pair<std::string, std::string>> cases = {{"", "NAME:LAG"},
                                                                  {"y", "\"y\""},
                                                                  {"y:", "\"y:\""},
                                                                  {"y:0-2", "begin at 1"},
                                                                  {"z:1", "no input or output \"z\"; there are y, u"},
                                                                  {"y:3-1", "ends before"},
                                                                  {"u:1-99999", "at most"},
                                                                  {"y:1,,u:1", "\"\""},
                                                                  {"y:1.5", "\"y:1.5\""},
                                                                  {"y:-1", "\"y:-1\""},
                                                                  {"u:+1", "only an output"},
                                                                  {"y:+2-3,u:1", "begin at 1"},
                                                                  {"y:+1", "there are none"},
                                                                  {"u:0-5000", "there are 5001"}};
  for (const auto& [text, message] : cases) {
    try {
      llmt::parse_lags(text, {"u"}, {"y"});
      ADD_FAILURE() << text;
    } catch (const std::invalid_argument& error) {
      EXPECT_NE(std::string(error.what()).find(message), std::string::npos) << text << ": " << error.what();
    }
  }
}

TEST(Lags, BecomeValuesAndChanges) {
  const llmt::Lags lags{{{1, 2, 4}}, {{0, 3}}};
  EXPECT_EQ(llmt::column_names(llmt::columns_of(lags), {"u"}, {"y"}),
            (std::vector<std::string>{"y(t-1)", "y(t-1)-y(t-2)", "y(t-2)-y(t-4)", "u(t)", "u(t-3)"}));
  llmt::Series series;
  series.outputs = Eigen::VectorXd::LinSpaced(6, 0.0, 5.0).array().square();
  series.inputs = Eigen::VectorXd::LinSpaced(6, 10.0, 15.0);
  const llmt::RegressorRows rows = llmt::regressor_rows(series, lags, {{0, 6}}, 4);
  EXPECT_EQ(rows.rows, (std::vector<Eigen::Index>{4, 5}));
  EXPECT_EQ(rows.regressors.row(0), (Eigen::RowVectorXd{{9.0, 9.0 - 4.0, 4.0 - 0.0, 14.0, 11.0}}));
  EXPECT_EQ(rows.outputs.col(0), (Eigen::Vector2d{16.0, 25.0}));
}

TEST(Series, StretchesEndAtGapsAndRecords) {
  llmt::Series series;
  series.inputs = Eigen::MatrixXd::Zero(12, 1);
  series.outputs = Eigen::MatrixXd::Zero(12, 1);
  series.record_begins = {0, 5};
  series.inputs(2, 0) = std::nan("");
  series.outputs(11, 0) = std::nan("");
  EXPECT_EQ(llmt::complete_stretches(series, 1), (std::vector<Stretch>{{0, 2}, {3, 5}, {5, 11}}));
  EXPECT_EQ(llmt::complete_stretches(series, 3), (std::vector<Stretch>{{5, 11}}));
}

TEST(Series, TimesAtUnequalStepsAreRefusedWithTheirRow) {
  Eigen::VectorXd times(6);
  times << 0.0, 0.1, 0.2, 5.0, 5.1, 5.2;
  EXPECT_NEAR(llmt::sample_time_of(times, {{0, 3}, {3, 6}}), 0.1, 1e-12);
  const auto message = [&](const std::vector<Stretch>& records) -> std::string {
    try {
      llmt::sample_time_of(times, records);
    } catch (const std::invalid_argument& error) {
      return error.what();
    }
    return "";
  };
  EXPECT_EQ(message({{0, 6}}), "the step of time to row 3 is 4.8, most are 0.1");
  times(4) = 4.0;
  EXPECT_EQ(message({{0, 3}, {3, 6}}), "the time does not rise in row 4: 4 after 5");
  times(1) = std::nan("");
  EXPECT_EQ(message({{0, 3}, {3, 6}}), "row 1 has no time");
}

TEST(Series, AGridLiesOnStraightLinesAndLeavesGaps) {
  llmt::Series series;
  series.output_names = {"y"};
  series.outputs.resize(5, 1);
  series.outputs << 0.0, 3.0, 4.0, 24.0, 25.0;
  series.inputs.resize(5, 0);
  Eigen::VectorXd times(5);
  times << 0.0, 3.0, 4.0, 24.0, 25.0;
  const llmt::Series grid = llmt::on_grid(series, times, 2.0, 10.0);
  ASSERT_EQ(grid.rows(), 13);
  EXPECT_EQ(grid.sample_time, 2.0);
  for (Eigen::Index row = 0; row < 13; ++row) {
    const double time = 2.0 * static_cast<double>(row);
    if (time > 4.0 && time < 24.0) {
      EXPECT_TRUE(std::isnan(grid.outputs(row, 0))) << row;
    } else {
      EXPECT_NEAR(grid.outputs(row, 0), time, 1e-12);
    }
  }
}

TEST(Stretches, EachRowIsHeldOutOnceAndNeverLearnedFrom) {
  const std::vector<Stretch> stretches = {{0, 7}, {10, 33}};
  std::multiset<Eigen::Index> held_out;
  for (const llmt::StretchFold& fold : llmt::cut(stretches, 4)) {
    std::set<Eigen::Index> here;
    for (const Stretch& stretch : fold.held_out) {
      for (Eigen::Index row = stretch.begin; row < stretch.end; ++row) here.insert(row);
    }
    held_out.insert(here.begin(), here.end());
    std::size_t learned = 0;
    for (const Stretch& stretch : fold.train) {
      for (Eigen::Index row = stretch.begin; row < stretch.end; ++row) {
        EXPECT_FALSE(here.contains(row));
        ++learned;
      }
    }
    EXPECT_EQ(learned + here.size(), 30U);
    EXPECT_GE(here.size(), 7U);
  }
  EXPECT_EQ(held_out.size(), 30U);
  EXPECT_EQ(std::set<Eigen::Index>(held_out.begin(), held_out.end()).size(), 30U);
}

TEST(Stretches, AStopIsAValueAtWhichTheOutputStandsMoreThanOnce) {
  llmt::Series series;
  series.outputs = Eigen::VectorXd::LinSpaced(200, 0.0, 0.9);
  const std::vector<Stretch> all = {{0, 200}};
  series.outputs.middleRows(50, 6).setConstant(1.0);
  EXPECT_FALSE(llmt::stands_at(series, all, 0, 1.0));
  series.outputs.middleRows(120, 4).setConstant(1.0);
  EXPECT_FALSE(llmt::stands_at(series, all, 0, 1.0));
  series.outputs.middleRows(120, 5).setConstant(1.0);
  EXPECT_TRUE(llmt::stands_at(series, all, 0, 1.0));
}

TEST(Windows, BeginAgainAfterTheHorizon) {
  const std::vector<llmt::Window> whole = llmt::windows_of({{0, 10}, {20, 22}}, 2);
  ASSERT_EQ(whole.size(), 1U);
  EXPECT_EQ(whole[0].first, 2);
  EXPECT_EQ(whole[0].end, 10);
  const std::vector<llmt::Window> cut = llmt::windows_of({{0, 11}}, 2, 4);
  ASSERT_EQ(cut.size(), 2U);  // the last row alone is less than half a horizon
  EXPECT_EQ(cut[1].begin, 4);
  EXPECT_EQ(cut[1].first, 6);
  EXPECT_EQ(cut[1].end, 10);
}

}  // namespace
