// Pictures of systems that move: what a page shows.
#include <gtest/gtest.h>

#include <cmath>
#include <set>
#include <string>

#include "llmt/random.hpp"
#include "llmt/run_band.hpp"
#include "report/dynamic/run_pictures.hpp"
#include "report/dynamic/system_document.hpp"

namespace {

using namespace llmt::report;

// Gain 1 for negative inputs, 3 for positive ones; an input is held for three rows.
llmt::Series two_gains(Eigen::Index rows, std::uint64_t seed) {
  llmt::Random random(seed);
  llmt::Series series{.input_names = {"u"}, .output_names = {"y"}, .sample_time = 0.5};
  series.inputs.resize(rows, 1);
  series.outputs.resize(rows, 1);
  double u = 0.0;
  double before = 0.0;
  double y = 0.0;
  for (Eigen::Index row = 0; row < rows; ++row) {
    if (row % 3 == 0) u = random.uniform(-1.0, 1.0);
    y = 0.8 * y + (before < 0.0 ? 0.2 : 0.6) * before;
    series.inputs(row, 0) = u;
    series.outputs(row, 0) = y + 0.01 * random.normal();
    before = u;
  }
  return series;
}

llmt::DynamicFit tree_of(const llmt::Series& series) {
  llmt::DynamicOptions options;
  options.lags = llmt::Lags{{{1}}, {{1}}};
  options.rest = llmt::RestLearner::tree;
  options.max_leaves = 2;
  return llmt::fit_dynamic(series, options);
}

std::set<std::string> titles_of(const Json& page) {
  std::set<std::string> titles;
  for (const Json& section : page["sections"]) {
    for (const Json& each : section["blocks"]) {
      if (each.contains("title")) titles.insert(each["title"].get<std::string>());
    }
  }
  return titles;
}

TEST(DynamicReport, ShowsHeldOutRunsInTheirBand) {
  const llmt::Series series = two_gains(400, 1);
  const llmt::DynamicFit fit = tree_of(series);
  const Document document = dynamic_document({"folder/d.csv", "folder/m.json", series, fit, 0});
  EXPECT_EQ(document.title, "llmt fit d.csv");
  ASSERT_TRUE(document.main);
  ASSERT_EQ(document.main->layers.size(), 3U);
  const Layer& band = document.main->layers[0];
  const Layer& measured = document.main->layers[1];
  const Layer& simulated = document.main->layers[2];
  ASSERT_EQ(measured.x.size(), 399U);  // the first row begins the first run
  int inside = 0;
  int count = 0;
  for (std::size_t k = 0; k < measured.x.size(); ++k) {
    EXPECT_DOUBLE_EQ(measured.x[k], 0.5 * static_cast<double>(k + 1));
    EXPECT_EQ(measured.y[k], series.outputs(static_cast<Eigen::Index>(k) + 1, 0));
    if (std::isnan(simulated.y[k])) continue;
    ++count;
    inside += band.low[k] <= measured.y[k] && measured.y[k] <= band.high[k];
  }
  EXPECT_EQ(count, 400 - 4);
  EXPECT_NEAR(inside / 396.0, 0.9, 0.05);
  const Json page = to_json(document);
  const std::set<std::string> titles = titles_of(page);
  for (const char* title :
       {"y: error over the time of a run", "Step response of y to u", "y at rest over u", "The leaf that counts most",
        "y: spectrum of the errors", "y: are errors of the next row white?", "y: do errors of runs follow u?"}) {
    EXPECT_TRUE(titles.contains(title)) << title;
  }
  EXPECT_EQ(page.dump().find("folder"), std::string::npos);
}

// The leaf is that of the sign of the input a row before.
TEST(DynamicReport, TheLeafOverTimeIsThatOfTheInput) {
  const llmt::Series series = two_gains(400, 2);
  const llmt::DynamicFit fit = tree_of(series);
  ASSERT_TRUE(std::holds_alternative<llmt::Model>(fit.model.parts().rest));
  const std::vector<Chart> charts = leaf_charts({fit.model, series, fit.simulated});
  ASSERT_EQ(charts.size(), 1U);
  const Layer& leaf = charts[0].layers[0];
  ASSERT_EQ(leaf.y.size(), 399U);
  int of_positive = 0;
  int agree = 0;
  int count = 0;
  for (std::size_t k = 0; k < leaf.y.size(); ++k) {
    const double before = series.inputs(static_cast<Eigen::Index>(k), 0);
    if (std::abs(before) < 0.2) continue;
    ++count;
    of_positive = of_positive == 0 && before > 0.0 ? static_cast<int>(leaf.y[k]) : of_positive;
    agree += of_positive > 0 && (leaf.y[k] == of_positive) == (before > 0.0);
  }
  EXPECT_GT(agree, 9 * count / 10);
}

TEST(DynamicReport, ARunOverAnotherRecordIsDrawnFromWhereItBegins) {
  const llmt::Series series = two_gains(400, 3);
  const llmt::DynamicFit fit = tree_of(series);
  const llmt::Series other = two_gains(200, 4);
  SimulatedRecords simulated{"folder/new.csv", fit.model, other, {}, {}, {}};
  for (Eigen::Index row = 0; row < 200; ++row) simulated.lines.push_back(row + 2);
  simulated.runs = {llmt::simulate(fit.model, other.inputs, other.outputs.topRows(5))};
  simulated.outputs = simulated.runs[0].outputs;
  simulated.has_measured = true;
  simulated.initial = 5;
  simulated.level = 0.9;
  simulated.band = llmt::run_bounds(fit.model, simulated.runs[0], 0.9);
  const Document document = simulated_document(simulated);
  EXPECT_EQ(document.title, "llmt simulate new.csv");
  EXPECT_EQ(document.answer.find("y: RMSE 0.0"), 0U) << document.answer;
  EXPECT_EQ(document.main->layers[1].x.size(), 195U);
  EXPECT_TRUE(titles_of(to_json(document)).contains("y: do errors of runs follow u?"));
  simulated.has_measured = false;
  simulated.level = 0.0;
  simulated.band = {};
  EXPECT_EQ(simulated_document(simulated).main->layers.size(), 2U);
}

}  // namespace
