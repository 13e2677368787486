// A measured output that is among the inputs, or follows from them.
#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <string>

#include "llmt/discovery/simulation.hpp"
#include "llmt/random.hpp"

namespace determined_test {
namespace {

using namespace llmt::discovery;

struct Table {
  Inputs inputs;
  Eigen::MatrixXd simulated;
  MeasuredOutputs measured;
};

// Force of a cart: m a + d v + friction, beside inputs v, a and two that are functions of force and random numbers.
Table table(const std::function<double(double force, double other)>& first,
            const std::function<double(double force, double other)>& second, double friction = 0.5) {
  llmt::Random random(5);
  Table table;
  table.inputs.names = {"v", "a", "u1", "u2"};
  table.inputs.values.resize(120, 4);
  table.simulated.resize(120, 1);
  table.measured = {{"force"}, Eigen::MatrixXd(120, 1)};
  for (Eigen::Index i = 0; i < 120; ++i) {
    const double v = random.uniform(-1.0, 1.0);
    const double a = random.uniform(-3.0, 3.0);
    const double other = random.normal();
    table.simulated(i, 0) = 3.0 * a + v + friction * (v > 0.0 ? 1.0 : -1.0);
    const double force = table.simulated(i, 0) + 1.5 * v * std::abs(v) + 0.05 * random.normal();
    table.measured.values(i, 0) = force;
    table.inputs.values.row(i) << v, a, first(force, other), second(force, other);
  }
  return table;
}

std::string refusal(const Table& table) {
  try {
    find_missing(tabulated(table.simulated, {"force"}), table.inputs, table.measured, standard_terms(table.inputs));
  } catch (const std::invalid_argument& error) {
    return error.what();
  }
  return "";
}

TEST(DeterminedOutputs, AnInputThatIsTheOutputIsNamed) {
  const auto noise = [](double, double other) { return other; };
  const std::string same = refusal(table([](double force, double) { return force; }, noise));
  EXPECT_NE(same.find("the measured \"force\" is u1 at every row"), std::string::npos) << same;
  const std::string current = refusal(table(noise, [](double force, double) { return 0.25 * force - 1.0; }));
  EXPECT_NE(current.find("is 4 u2 + 4 at every row"), std::string::npos) << current;
  // Written with seven digits.
  const std::string rounded = refusal(table([](double force, double) { return std::round(force * 1e6) / 1e6; }, noise));
  EXPECT_NE(rounded.find("\"u1\" is no input"), std::string::npos) << rounded;
}

TEST(DeterminedOutputs, InputsThatGiveItTogetherAreNamed) {
  const std::string sum = refusal(
      table([](double force, double other) { return force - other; }, [](double, double other) { return other; }));
  EXPECT_NE(sum.find("is u1 + u2 at every row"), std::string::npos) << sum;
  EXPECT_NE(sum.find("\"u1\" and \"u2\" are no inputs"), std::string::npos) << sum;
}

TEST(DeterminedOutputs, OtherInputsAreNotRefused) {
  const auto noise = [](double, double other) { return other; };
  EXPECT_EQ(refusal(table(noise, noise)), "");
  // A second sensor of the force has noise of its own.
  llmt::Random random(8);
  EXPECT_EQ(refusal(table([&](double force, double) { return force + 1e-3 * random.normal(); }, noise)), "");
  // Without noise, a linear simulation of a linear machine: the difference is a term.
  Table linear = table(noise, noise, 0.0);
  linear.measured.values = linear.simulated + 0.2 * linear.inputs.values.col(0);
  EXPECT_EQ(refusal(linear), "");
}

}  // namespace
}  // namespace determined_test
