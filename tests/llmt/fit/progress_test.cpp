// Progress and cancellation of the calls that fit trees.
#include <gtest/gtest.h>

#include <set>
#include <string>
#include <vector>

#include "llmt/compare.hpp"
#include "llmt/fit.hpp"
#include "llmt/readable.hpp"
#include "oracles/oracles.hpp"
#include "watched.hpp"

namespace {

using watched::Call;

struct Rows {
  Eigen::MatrixXd x;
  Eigen::MatrixXd y;
};

Rows rows(Eigen::Index count, Eigen::Index inputs, Eigen::Index outputs) {
  Rows rows{oracle::uniform(count, inputs, 7), Eigen::MatrixXd(count, outputs)};
  for (Eigen::Index o = 0; o < outputs; ++o) rows.y.col(o) = oracle::curved(rows.x, 0.1 * static_cast<double>(o + 1));
  return rows;
}

// All that the fit made.
Call fitting(const Rows& rows, const llmt::FitOptions& options) {
  return [=](const llmt::Progress& progress) {
    const llmt::FitResult result = llmt::fit(rows.x, rows.y, options, progress);
    std::string text = to_json(result.model);
    for (const llmt::Model& model : result.intervals.models()) text += to_json(model);
    return text;
  };
}

struct Case {
  const char* name;
  Rows data;
  llmt::FitOptions options;
};

// Every way through a fit.
std::vector<Case> cases() {
  const llmt::FitOptions small{.max_leaves = 3, .choose_inputs = false, .folds = {.count = 2}, .max_threads = 1};
  std::vector<Case> cases = {{"plain", rows(60, 2, 1), small}, {"two trees", rows(60, 2, 2), small}};
  const auto add = [&](const char* name, const auto& change) {
    cases.push_back({name, rows(60, 2, 1), small});
    change(cases.back());
  };
  add("choice of inputs", [](Case& each) { each.options.choose_inputs = true; });
  add("no folds", [](Case& each) { each.options.folds.count = 0; });
  add("lolimot", [](Case& each) { each.options.rule = llmt::GrowthRule::lolimot; });
  add("hilomot", [](Case& each) { each.options.rule = llmt::GrowthRule::hilomot; });
  add("m5", [](Case& each) { each.options.rule = llmt::GrowthRule::m5; });
  add("ra", [](Case& each) { each.options.rule = llmt::GrowthRule::ra; });
  add("tukey", [](Case& each) { each.options.loss = llmt::Loss::tukey; });
  add("linear or quadratic", [](Case& each) { each.options.terms = llmt::LocalTerms::automatic; });
  add("missing", [](Case& each) { each.data.x(3, 0) = std::nan(""); });
  add("codes", [](Case& each) {
    each.data.x.col(1) = (4.0 * each.data.x.col(1).array()).floor();
    each.data.y = (each.data.x.col(1).array() == 1.0).cast<double>().matrix() + 0.1 * each.data.x.col(0);
  });
  return cases;
}

TEST(Progress, OfAFitRisesToItsTotal) {
  for (const Case& each : cases()) {
    SCOPED_TRACE(each.name);
    const std::vector<llmt::ProgressReport> reports = watched::reports_of(fitting(each.data, each.options));
    watched::expect_rising(reports);
    std::set<int> steps;
    for (const llmt::ProgressReport& report : reports) steps.insert(report.done);
    EXPECT_GE(steps.size(), 5U);
  }
}

TEST(Progress, AFitStopsAtEveryReport) {
  for (const Case& each : cases()) {
    SCOPED_TRACE(each.name);
    watched::expect_stops_at_every_report(fitting(each.data, each.options), 7);
  }
  watched::expect_stops_at_every_report(fitting(cases()[0].data, cases()[0].options));
}

TEST(Progress, AsManyReportsOnSeveralThreads) {
  for (Case& each : cases()) {
    SCOPED_TRACE(each.name);
    const std::size_t of_one = watched::reports_of(fitting(each.data, each.options)).size();
    each.options.max_threads = 4;
    const Call call = fitting(each.data, each.options);
    const std::vector<llmt::ProgressReport> of_four = watched::reports_of(call);
    watched::expect_rising(of_four);
    EXPECT_EQ(of_four.size(), of_one);
  }
  Case several = cases()[1];
  several.options.max_threads = 4;
  watched::expect_stops_at_every_report(fitting(several.data, several.options), 5);
}

// A single hold-out and nodes of many rows: reports come within a node's search too.
TEST(Progress, OfAFitOfManyRows) {
  llmt::FitOptions options{.max_leaves = 4, .max_threads = 1};
  const Rows many = rows(60000, 2, 1);
  for (const llmt::SplitSearch search : {llmt::SplitSearch::exact, llmt::SplitSearch::binned}) {
    options.expert.search = search;
    const std::vector<llmt::ProgressReport> reports = watched::reports_of(fitting(many, options));
    watched::expect_rising(reports);
    int same = 0;
    for (std::size_t k = 1; k < reports.size(); ++k) same += reports[k].done == reports[k - 1].done ? 1 : 0;
    EXPECT_GE(same, 10);
  }
}

TEST(Progress, OfAFitOfPreparedData) {
  llmt::FitOptions options{.max_leaves = 3, .loss = llmt::Loss::tukey, .folds = {.count = 2}, .max_threads = 1};
  const Rows data = rows(60, 2, 1);
  const Call preparing = [&](const llmt::Progress& progress) {
    return std::to_string(llmt::PreparedFit({data.x, data.y}, options, progress).data().inputs(0, 0));
  };
  watched::expect_rising(watched::reports_of(preparing));
  watched::expect_stops_at_every_report(preparing, 7);
  const llmt::PreparedFit prepared({data.x, data.y}, options);
  const Call fitted = [&](const llmt::Progress& progress) { return to_json(llmt::fit(prepared, progress).model); };
  watched::expect_rising(watched::reports_of(fitted));
  watched::expect_stops_at_every_report(fitted, 7);
}

Call comparing(const Rows& rows) {
  return [=](const llmt::Progress& progress) {
    llmt::FitOptions base{.max_leaves = 3, .folds = {.count = 2}, .max_threads = 1};
    const llmt::ComparisonResult result =
        llmt::compare(rows.x, rows.y, llmt::usual_methods(base), {.folds = {.count = 2}, .progress = progress});
    std::string text = result.recommendation;
    for (const llmt::Comparison& method : result.methods) text += std::to_string(method.cv_rmse);
    return text;
  };
}

TEST(Progress, OfAComparisonNamesTheMethods) {
  const Call call = comparing(rows(60, 2, 1));
  const std::vector<llmt::ProgressReport> reports = watched::reports_of(call);
  watched::expect_rising(reports);
  std::vector<std::string> steps;
  for (const llmt::ProgressReport& report : reports) {
    if (steps.empty() || steps.back() != report.step) steps.push_back(report.step);
  }
  std::vector<std::string> methods;
  for (const llmt::Method& method : llmt::usual_methods()) methods.push_back(method.name);
  EXPECT_EQ(steps, methods);
  watched::expect_stops_at_every_report(call, 37);
}

TEST(Progress, OfAReadableTree) {
  const Rows data = rows(60, 2, 1);
  const llmt::FitOptions options{.max_leaves = 3, .folds = {.count = 2}, .max_threads = 1};
  const llmt::PreparedFit prepared({data.x, data.y}, options);
  const llmt::FitSummary fitted = llmt::fit(prepared).summary;
  const Call call = [&](const llmt::Progress& progress) {
    return to_json(llmt::fit_readable(prepared, fitted, {}, progress).model);
  };
  watched::expect_rising(watched::reports_of(call));
  watched::expect_stops_at_every_report(call, 5);
}

}  // namespace
