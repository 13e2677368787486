#include <gtest/gtest.h>

#include <cmath>

#include "discovery/answer/findings.hpp"
#include "llmt/discovery/simulation.hpp"
#include "llmt/random.hpp"
#include "study.hpp"

namespace llmt::discovery {
namespace parameters_test {
namespace {

constexpr double coulomb = 0.5;

// A cart on a rail: tau = m ddq + b dq + 0.5 sign(dq) + drag dq |dq|, with three sines as its way.
struct Cart {
  Inputs inputs{{"q", "dq", "ddq"}, {}};
  MeasuredOutputs measured{{"tau"}, {}};

  Eigen::VectorXd force(double mass, double damping) const {
    const Eigen::ArrayXd dq = inputs.values.col(1).array();
    return (mass * inputs.values.col(2).array() + damping * dq + coulomb * dq.sign()).matrix();
  }
  // The nominal simulation with derivatives by mass, damping and, if asked for, by what acts as the mass does.
  Simulation nominal(double mass, double damping, bool with_armature = false) const {
    std::vector<Parameter> parameters = {{.name = "mass", .unit = "kg", .value = mass},
                                         {.name = "damping", .unit = "N s/m", .value = damping}};
    std::vector<Eigen::MatrixXd> by = {inputs.values.col(2), inputs.values.col(1)};
    if (with_armature) {
      parameters.push_back({.name = "armature", .unit = "kg m^2", .value = 0.02});
      by.push_back(4.0 * inputs.values.col(2));
      parameters.push_back({.name = "tilt", .unit = "rad", .value = 0.0});
      by.push_back(Eigen::VectorXd::Zero(inputs.values.rows()));
    }
    const Eigen::MatrixXd simulated = force(mass, damping) + (with_armature ? 0.08 : 0.0) * inputs.values.col(2);
    return linearised(tabulated(simulated, {"tau"}), simulated, parameters, by);
  }
};

Cart cart(std::uint64_t seed, double mass, double damping, double drag, double noise) {
  constexpr Eigen::Index n = 800;
  Random random(seed);
  Cart cart;
  cart.inputs.values.resize(n, 3);
  for (Eigen::Index i = 0; i < n; ++i) {
    const double t = 0.0217 * static_cast<double>(i);
    double q = 0.0, dq = 0.0, ddq = 0.0;
    for (const double w : {0.9, 2.3, 4.1}) {
      const double phase = w * t + 0.7 * w * static_cast<double>(seed);
      q += 0.3 / w * std::sin(phase);
      dq += 0.3 * std::cos(phase);
      ddq -= 0.3 * w * std::sin(phase);
    }
    cart.inputs.values.row(i) << q, dq, ddq;
  }
  const Eigen::ArrayXd dq = cart.inputs.values.col(1).array();
  const Eigen::VectorXd exact = cart.force(mass, damping) + drag * (dq * dq.abs()).matrix();
  const double sigma = noise * std::sqrt(exact.squaredNorm() / n);
  cart.measured.values = exact;
  for (double& value : cart.measured.values.reshaped()) value += sigma * random.normal();
  return cart;
}

Missing missing_from(const Cart& cart, const Simulation& simulation) {
  return find_missing(simulation, cart.inputs, cart.measured, standard_terms(cart.inputs));
}

void expect_near(const FittedParameter& fitted, double change) {
  EXPECT_NEAR(fitted.change, change, 4.0 * fitted.standard_error) << fitted.name;
}

TEST(Parameters, AloneAreParametersAndNoTerms) {
  int only = 0;
  const int seeds = sampled(10, 3);
  for (std::uint64_t seed = 1; seed <= static_cast<std::uint64_t>(seeds); ++seed) {
    const Cart own = cart(seed, 3.5, 1.4, 0.0, 0.05);
    const Missing missing = missing_from(own, own.nominal(3.0, 1.0));
    if (missing.answer != Answer::parameters_only) continue;
    ++only;
    EXPECT_TRUE(missing.found.empty());
    ASSERT_EQ(missing.fitted_parameters.size(), 2U);
    expect_near(missing.fitted_parameters[0], 0.5);
    expect_near(missing.fitted_parameters[1], 0.4);
    EXPECT_TRUE(missing.fitted_parameters[0].changed);
    EXPECT_EQ(missing.fitted_parameters[0].nominal, 3.0);
    EXPECT_GT(missing.parameter_gain, 100.0);
    // What the changes make at the rows set aside.
    const Eigen::VectorXd effect = (own.force(3.5, 1.4) - own.force(3.0, 1.0))(missing.held_out);
    const double gone = std::pow(missing.gaps[0].nominal, 2.0) - std::pow(missing.gaps[0].before, 2.0);
    EXPECT_NEAR(gone, effect.squaredNorm() / static_cast<double>(effect.size()), 0.2 * gone);
    EXPECT_EQ(missing.gaps[0].before, missing.gaps[0].after);
  }
  EXPECT_EQ(only, seeds);
}

TEST(Parameters, ThatAreRightAreNotSaidToBeOff) {
  // The rate is 0.3 % for the parameters and for the terms: no alarm in 20 draws has a probability of 89 %.
  const std::uint64_t seeds = sampled(20, 5);
  int alarms = 0;
  for (std::uint64_t seed = 1; seed <= seeds; ++seed) {
    const Cart own = cart(seed, 3.0, 1.0, 0.0, 0.05);
    if (missing_from(own, own.nominal(3.0, 1.0)).answer != Answer::nothing_missing) ++alarms;
  }
  EXPECT_EQ(alarms, 0);
}

TEST(Parameters, BesideAMissingEffectBothAreRight) {
  int named = 0;
  const int seeds = sampled(10, 3);
  for (std::uint64_t seed = 1; seed <= static_cast<std::uint64_t>(seeds); ++seed) {
    const Cart own = cart(seed, 3.5, 1.4, 1.5, 0.05);
    const Missing missing = missing_from(own, own.nominal(3.0, 1.0));
    if (missing.found.size() != 1 || missing.found[0].family != "signed_square") continue;
    ++named;
    EXPECT_EQ(missing.found[0].location, "dq");
    EXPECT_NEAR(missing.found[0].coefficients(0), 1.5, 4.0 * missing.found[0].values[0].standard_error);
    expect_near(missing.fitted_parameters[0], 0.5);
    expect_near(missing.fitted_parameters[1], 0.4);
    // A fit without the drag takes it for damping.
    EXPECT_GT(missing.fitted_parameters[1].alone, 0.4 + 10.0 * missing.fitted_parameters[1].standard_error);
    EXPECT_LT(missing.gaps[0].after, missing.gaps[0].before);
    EXPECT_LT(missing.gaps[0].before, missing.gaps[0].nominal);
  }
  EXPECT_GE(10 * named, 9 * seeds);
}

TEST(Parameters, FittedBySomebodyElseWithoutTheEffectGoBack) {
  int named = 0;
  const int seeds = sampled(10, 3);
  for (std::uint64_t seed = 1; seed <= static_cast<std::uint64_t>(seeds); ++seed) {
    const Cart own = cart(seed, 3.0, 1.0, 1.5, 0.05);
    // What a fit of the parameters alone says: least squares on the same rows.
    Eigen::MatrixXd by(own.inputs.values.rows(), 2);
    by << own.inputs.values.col(2), own.inputs.values.col(1);
    const Eigen::VectorXd fit = by.colPivHouseholderQr().solve(own.measured.values.col(0) - own.force(0.0, 0.0));
    EXPECT_GT(fit(1), 1.2);
    const Missing missing = missing_from(own, own.nominal(fit(0), fit(1)));
    if (missing.found.size() != 1 || missing.found[0].family != "signed_square") continue;
    ++named;
    EXPECT_NEAR(missing.found[0].coefficients(0), 1.5, 4.0 * missing.found[0].values[0].standard_error);
    expect_near(missing.fitted_parameters[1], 1.0 - fit(1));
    EXPECT_TRUE(missing.fitted_parameters[1].changed);
  }
  EXPECT_GE(10 * named, 9 * seeds);
}

TEST(Parameters, ThatRowsCannotTellApartAreMergedByName) {
  const Cart own = cart(1, 3.5, 1.4, 0.0, 0.02);
  const Missing missing = missing_from(own, own.nominal(3.0, 1.0, true));
  ASSERT_EQ(missing.fitted_parameters.size(), 2U);
  const FittedParameter& mass = missing.fitted_parameters[0];
  EXPECT_EQ(mass.name, "mass + 4 armature");
  EXPECT_EQ(mass.parts, (std::vector<std::string>{"mass", "armature"}));
  EXPECT_NEAR(mass.nominal, 3.08, 1e-9);
  expect_near(mass, 0.42);
  EXPECT_EQ(missing.fitted_parameters[1].name, "damping");
  ASSERT_FALSE(missing.not_testable.empty());
  EXPECT_EQ(missing.not_testable.back().what, "parameter tilt");
}

// A column that is the sum of two others joins both; the order of the parameters decides which are named first.
TEST(Parameters, SumsOfSeveralAreThoseOfTheColumns) {
  Eigen::MatrixXd jacobian(50, 3);
  Random random(3);
  for (double& value : jacobian.reshaped()) value = random.normal();
  jacobian.col(2) = 2.0 * jacobian.col(0) - 0.5 * jacobian.col(1);
  std::vector<Parameter> parameters = {{.name = "a", .unit = ""}, {.name = "b", .unit = ""}, {.name = "c", .unit = ""}};
  const DistinctParameters distinct = distinct_parameters(jacobian, parameters);
  ASSERT_EQ(distinct.sums.size(), 2U);
  ASSERT_EQ(distinct.sums[0].others.size(), 1U);
  EXPECT_EQ(distinct.sums[0].others[0].parameter, 2U);
  EXPECT_NEAR(distinct.sums[0].others[0].factor, 2.0, 1e-9);
  ASSERT_EQ(distinct.sums[1].others.size(), 1U);
  EXPECT_NEAR(distinct.sums[1].others[0].factor, -0.5, 1e-9);
  EXPECT_TRUE(parameters[0].free && parameters[1].free && !parameters[2].free);
  // What is known beforehand of the third tells it apart.
  for (Parameter& parameter : parameters) parameter.free = true;
  parameters[2].prior_sigma = 0.1;
  EXPECT_EQ(distinct_parameters(jacobian, parameters).sums.size(), 3U);
}

TEST(Parameters, MistakesAreNamed) {
  const Cart own = cart(1, 3.0, 1.0, 0.0, 0.05);
  const Eigen::MatrixXd simulated = own.force(3.0, 1.0);
  const auto message = [&](std::vector<Parameter> parameters, std::vector<Eigen::MatrixXd> by) {
    try {
      linearised(tabulated(simulated, {"tau"}), simulated, std::move(parameters), std::move(by));
    } catch (const std::invalid_argument& error) {
      return std::string(error.what());
    }
    return std::string("accepted");
  };
  const Parameter mass{.name = "mass", .unit = "kg"};
  const auto expect = [](const std::string& text, const std::string& part) {
    EXPECT_NE(text.find(part), std::string::npos) << text;
  };
  expect(message({mass}, {}), "1 parameters, 0 derivatives");
  expect(message({mass, mass}, {simulated, simulated}), "the parameter \"mass\" is there twice");
  expect(message({mass}, {simulated.topRows(3)}), "the derivatives by mass are 3 x 1, must be 800 x 1");
  expect(message({mass}, {simulated * std::nan("")}), "a derivative by mass is not finite");
}

// Mass and damping as they are, or as their logarithms; counts its calls.
Simulation counted(const Cart& cart, double mass, double damping, bool by_logarithm, int& calls) {
  const auto own = [by_logarithm](double value) { return by_logarithm ? std::log(value) : value; };
  const double scale = by_logarithm ? 0.1 : 0.2;
  return {{{.name = "mass", .unit = "kg", .value = own(mass), .scale = scale},
           {.name = "damping", .unit = "N s/m", .value = own(damping), .scale = scale}},
          [&cart, &calls, by_logarithm](const Eigen::MatrixXd&, const Eigen::VectorXd& values) -> Eigen::MatrixXd {
            ++calls;
            return by_logarithm ? cart.force(std::exp(values(0)), std::exp(values(1)))
                                : cart.force(values(0), values(1));
          }};
}

TEST(Parameters, OfASimulationThatIsWorthFewCallsAreThoseOfTheFitOfAll) {
  const Cart data = cart(3, 2.3, 1.4, 0.8, 0.02);
  for (const bool by_logarithm : {false, true}) {
    int calls = 0;
    const Simulation simulation = counted(data, 2.0, 1.0, by_logarithm, calls);
    const std::vector<ModelTerm> terms = standard_terms(data.inputs);
    const Missing together = find_missing(simulation, data.inputs, data.measured, terms);
    const int calls_together = calls;
    calls = 0;
    const Missing in_steps =
        find_missing_in_steps(simulation, central_differences(simulation), data.inputs, data.measured, terms);
    ASSERT_EQ(in_steps.found.size(), 1U);
    EXPECT_EQ(in_steps.found[0].family, "signed_square");
    EXPECT_EQ(together.found[0].family, "signed_square");
    for (std::size_t k = 0; k < 2; ++k) {
      EXPECT_NEAR(in_steps.parameters[k].value, together.parameters[k].value, 0.1 * together.standard_errors(k));
    }
    // Two at the start, which show that it is not random, two for each derivative, at the end, and with parameters
    // alone: the first step was exact.
    if (!by_logarithm) {
      EXPECT_EQ(calls, 2 + 4 + 1 + 1);
    }
    EXPECT_LT(5 * calls, calls_together);
  }
}

}  // namespace
}  // namespace parameters_test
}  // namespace llmt::discovery
