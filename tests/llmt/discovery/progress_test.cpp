#include <gtest/gtest.h>

#include <algorithm>
#include <sstream>

#include "llmt/discovery/simulation.hpp"
#include "llmt/random.hpp"
#include "watched.hpp"

namespace {

using namespace llmt::discovery;

TEST(Progress, OfASearchForMissingTermsNamesTheRounds) {
  llmt::Random random(1);
  Inputs inputs{{"a", "b"}, Eigen::MatrixXd(120, 2)};
  for (double& value : inputs.values.reshaped()) value = random.uniform(-2.0, 2.0);
  const Eigen::MatrixXd simulated = 3.0 * inputs.values.col(0);
  MeasuredOutputs measured{{"y"}, simulated + inputs.values.col(1).cwiseAbs2()};
  for (double& value : measured.values.reshaped()) value += 0.01 * random.normal();
  const watched::Call call = [&](const llmt::Progress& progress) {
    MissingOptions options;
    options.progress = progress;
    const Missing missing =
        find_missing(tabulated(simulated, {"y"}), inputs, measured, standard_terms(inputs), options);
    std::ostringstream text;
    text.precision(17);
    for (const FoundTerm& found : missing.found) text << found.formula << "; ";
    text << missing.corrected;
    return text.str();
  };
  EXPECT_NE(call({}).find("b^2"), std::string::npos) << call({}).substr(0, 100);
  const std::vector<llmt::ProgressReport> reports = watched::reports_of(call);
  watched::expect_rising(reports);
  EXPECT_EQ(reports[0].step, "fitting");
  EXPECT_EQ(reports[1].step, "searching, round 1");
  watched::expect_stops_at_every_report(call);
}

// A gain is searched for once more without it.
TEST(Progress, OfSeveralSearchesRises) {
  constexpr Eigen::Index rows = 400;
  llmt::Random random(1);
  Inputs inputs{{"a", "b"}, Eigen::MatrixXd(rows, 2)};
  inputs.instants = Eigen::VectorXd::LinSpaced(rows, 0.0, 4.0);
  inputs.values << inputs.instants.array().sin(), (1.7 * inputs.instants.array()).cos();
  const Eigen::MatrixXd simulated = 3.0 * inputs.values.col(0) + inputs.values.col(1).cwiseAbs2();
  MeasuredOutputs measured{{"y"}, 1.2 * simulated};
  for (double& value : measured.values.reshaped()) value += 0.01 * random.normal();
  const std::vector<llmt::ProgressReport> reports = watched::reports_of([&](const llmt::Progress& progress) {
    MissingOptions options;
    options.progress = progress;
    find_missing(tabulated(simulated, {"y"}), inputs, measured, standard_terms(inputs), options);
    return std::string();
  });
  watched::expect_rising(reports);
  const auto searches = std::ranges::count(reports, "searching, round 1", &llmt::ProgressReport::step);
  EXPECT_GE(searches, 2);
}

}  // namespace
