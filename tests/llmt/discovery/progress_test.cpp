#include <gtest/gtest.h>

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

}  // namespace
