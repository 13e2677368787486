#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "llmt/discovery/simulation.hpp"
#include "noise.hpp"

namespace errors_of_inputs_test {
namespace {

using namespace llmt::discovery;

constexpr double error = 0.3;  // standard deviation, of an input of standard deviation 1

/// An input x + e of independent rows, and the simulation computed at it.
struct Table {
  Inputs inputs{{"x"}, Eigen::MatrixXd(2000, 1)};
  Eigen::MatrixXd simulated{Eigen::MatrixXd(2000, 1)};
  MeasuredOutputs measured{{"y"}, Eigen::MatrixXd(2000, 1)};
};

Table table(std::uint64_t seed, double slope_of_simulation, double missing_slope) {
  Noise noise(seed);
  Table table;
  for (Eigen::Index i = 0; i < 2000; ++i) {
    const double x = noise.normal();
    table.inputs.values(i, 0) = x + error * noise.normal();
    table.simulated(i, 0) = slope_of_simulation * table.inputs.values(i, 0);
    table.measured.values(i, 0) = (slope_of_simulation + missing_slope) * x + 0.05 * noise.normal();
  }
  return table;
}

// The simulation is proportional to x, so the gain is the same term.
bool is_linear(const FoundTerm& found) { return found.family == "linear" || found.family == "gain"; }

Missing missing_from(Table table, double told) {
  if (told > 0.0) table.inputs.noise = Eigen::VectorXd::Constant(1, told);
  std::vector<ModelTerm> terms = standard_terms(table.inputs);
  return find_missing(tabulated(table.simulated, {"y"}), table.inputs, table.measured, terms);
}

// y = x, s = x + e: least squares of y - s = -e on x + e is -sigma^2 / (1 + sigma^2).
TEST(ErrorsOfInputs, AloneMakeTheTermOfTheClosedForm) {
  const Missing missing = missing_from(table(1, 1.0, 0.0), 0.0);
  ASSERT_EQ(missing.found.size(), 1u);
  EXPECT_TRUE(is_linear(missing.found.front())) << missing.found.front().family;
  EXPECT_NEAR(missing.found.front().coefficients(0), -error * error / (1.0 + error * error),
              3.0 * missing.found.front().values.front().standard_error);
}

TEST(ErrorsOfInputs, MakeNoTermWhereTheyAreTold) {
  for (const std::uint64_t seed : {1u, 2u, 3u, 4u, 5u}) {
    const Missing missing = missing_from(table(seed, 1.0, 0.0), error);
    EXPECT_EQ(missing.answer, Answer::nothing_missing) << seed << " " << missing.found.size();
  }
}

TEST(ErrorsOfInputs, DoNotShrinkACoefficientWhereTheyAreTold) {
  constexpr double hidden = 0.8;
  const Missing plain = missing_from(table(1, 1.0, hidden), 0.0);
  ASSERT_FALSE(plain.found.empty());
  EXPECT_NEAR(plain.found.front().coefficients(0), (1.0 + hidden) / (1.0 + error * error) - 1.0, 0.06);
  double chi_squared = 0.0;
  for (const std::uint64_t seed : {1u, 2u, 3u, 4u, 5u, 6u, 7u, 8u}) {
    const Missing missing = missing_from(table(seed, 1.0, hidden), error);
    ASSERT_FALSE(missing.found.empty());
    EXPECT_TRUE(is_linear(missing.found.front())) << missing.found.front().family;
    const TermValue& value = missing.found.front().values.front();
    chi_squared += std::pow((value.value - hidden) / value.standard_error, 2.0);
  }
  constexpr double quantile = 26.12;  // 0.999 of chi square with 8 degrees of freedom
  EXPECT_LT(chi_squared, quantile);
}

// y = x + 2 tanh(x/0.2), and the least width that may stand for 0.2 is 0.25: what would make it smaller must not go
// into the coefficient.
TEST(ErrorsOfInputs, LeaveACoefficientAsItIsBesideAConstantAtItsEnd) {
  constexpr double least = 0.25;
  Noise noise(1);
  Table table;
  table.inputs.noise = Eigen::VectorXd::Constant(1, 1e-4);
  Eigen::VectorXd shape(table.inputs.values.rows());
  for (Eigen::Index i = 0; i < shape.size(); ++i) {
    const double x = noise.normal();
    table.inputs.values(i, 0) = table.simulated(i, 0) = x;
    table.measured.values(i, 0) = x + 2.0 * std::tanh(x / 0.2) + 0.05 * noise.normal();
    shape(i) = std::tanh(x / least);
  }
  ModelTerm term{.family = "tanh",
                 .location = "x",
                 .formula = "tanh(x/c)",
                 .inputs = {"x"},
                 .coefficients = {"limit"},
                 .columns = [](const Rows& rows, const Eigen::VectorXd& constants) -> Eigen::MatrixXd {
                   return (rows.inputs.col(0).array() / constants(0)).tanh();
                 },
                 .constants = {{.name = "c", .unit = "x", .tried = {0.5, 0.75, 1.0}, .smooth = true}}};
  const Missing missing = find_missing(tabulated(table.simulated, {"y"}), table.inputs, table.measured, {term});
  ASSERT_EQ(missing.found.size(), 1u);
  EXPECT_EQ(missing.found[0].constants(0), least);
  const Eigen::VectorXd gap = table.measured.values.col(0) - table.simulated.col(0);
  EXPECT_NEAR(missing.found[0].coefficients(0), shape.dot(gap) / shape.squaredNorm(), 0.01);
}

// Errors of the input count at the few rows where the term is steep.
TEST(ErrorsOfInputs, StandardErrorsAreTheSpreadOfEstimatesOfASteepTerm) {
  constexpr int tables = 60;
  constexpr double small_error = 0.01;
  constexpr double width = 0.06;
  const auto peak = [](double x) { return std::exp(-std::pow(x / width, 2.0)); };
  Eigen::ArrayXd estimates(tables);
  Eigen::ArrayXd errors(tables);
  for (int k = 0; k < tables; ++k) {
    Noise noise(static_cast<std::uint64_t>(k + 1));
    Table table;
    table.inputs.noise = Eigen::VectorXd::Constant(1, small_error);
    for (Eigen::Index i = 0; i < 2000; ++i) {
      const double x = noise.normal();
      table.inputs.values(i, 0) = x + small_error * noise.normal();
      table.simulated(i, 0) = table.inputs.values(i, 0);
      table.measured.values(i, 0) = x + peak(x) + 0.05 * noise.normal();
    }
    const ModelTerm term = own_term("peak", "exp(-(x/w)^2)", [&](const Eigen::VectorXd& row) { return peak(row(0)); });
    const Missing missing = find_missing(tabulated(table.simulated, {"y"}), table.inputs, table.measured, {term});
    ASSERT_EQ(missing.found.size(), 1u);
    estimates(k) = missing.found[0].coefficients(0);
    errors(k) = missing.found[0].values[0].standard_error;
  }
  const double spread = (estimates - estimates.mean()).square().sum();
  // 0.001 and 0.999 of chi square with 59 degrees of freedom.
  EXPECT_GT(spread / errors.square().mean(), 30.6);
  EXPECT_LT(spread / errors.square().mean(), 98.3);
}

}  // namespace
}  // namespace errors_of_inputs_test
