// A simulation with parameters of its own, measurements of the real thing, and what the simulation lacks.
#include "llmt/discovery/simulation.hpp"

#include <cmath>
#include <cstdio>

#include "llmt/random.hpp"

using namespace llmt::discovery;

// Temperature of a heated plate above the room, t seconds after switching on: R P (1 - exp(-t / tau)).
Eigen::MatrixXd plate(const Eigen::MatrixXd& inputs, const Eigen::VectorXd& values) {
  const double resistance = values(0);
  const double tau = values(1);
  const Eigen::ArrayXd t = inputs.col(0).array();
  const Eigen::ArrayXd power = inputs.col(1).array();
  return (resistance * power * (1.0 - (-t / tau).exp())).matrix();
}

int main() {
  // The real plate is cooled by a draught that nobody told the simulation of; R and tau are only roughly known.
  llmt::Random random(1);
  constexpr Eigen::Index rows = 120;
  Inputs inputs{{"t", "power", "draught"}, Eigen::MatrixXd(rows, 3)};
  for (Eigen::Index i = 0; i < rows; ++i) {
    inputs.values.row(i) << random.uniform(0.0, 600.0), random.uniform(10.0, 50.0), random.uniform(0.0, 2.0);
  }
  MeasuredOutputs measured{{"T"}, plate(inputs.values, Eigen::Vector2d(0.82, 140.0))};
  for (Eigen::Index i = 0; i < rows; ++i) {
    const double power = inputs.values(i, 1);
    const double draught = inputs.values(i, 2);
    measured.values(i, 0) += -0.03 * power * std::sqrt(draught) + 0.1 * random.normal();
  }

  Simulation simulation;
  simulation.parameters = {{.name = "R", .unit = "K/W", .value = 1.0, .scale = 0.1},
                           {.name = "tau", .unit = "s", .value = 100.0, .scale = 10.0}};
  simulation.predict = plate;

  // The library, and two suspicions of our own.
  std::vector<ModelTerm> terms = standard_terms(inputs);
  terms.push_back(own_term("cooling", "power sqrt(draught)",
                           [](const Eigen::VectorXd& row) { return row(1) * std::sqrt(row(2)); }));
  terms.push_back(
      own_term("radiation", "(power/50)^4", [](const Eigen::VectorXd& row) { return std::pow(row(1) / 50.0, 4); }));

  const Missing missing = find_missing(simulation, inputs, measured, terms);
  std::printf("%s\n", to_string(missing.answer).c_str());
  for (const FoundTerm& found : missing.found) {
    std::printf("%s: %s%s\n", found.family.c_str(), found.formula.c_str(), found.confirmed ? ", confirmed" : "");
    for (const TermValue& value : found.values) {
      std::printf("  %s = %.4f +- %.4f %s\n", value.name.c_str(), value.value, value.standard_error,
                  value.unit.c_str());
    }
    for (const RivalTerms& rival : found.rivals) std::printf("  or %s\n", rival.what.c_str());
  }
  for (std::size_t k = 0; k < missing.parameters.size(); ++k) {
    std::printf("%s = %.4f +- %.4f %s\n", missing.parameters[k].name.c_str(), missing.parameters[k].value,
                missing.standard_errors(static_cast<Eigen::Index>(k)), missing.parameters[k].unit.c_str());
  }
  const Gap& gap = missing.gaps[0];
  std::printf("gap on %zu rows set aside: %.3f -> %.3f, noise %.3f\n", missing.held_out.size(), gap.before, gap.after,
              gap.noise_floor);

  // The corrected simulation anywhere.
  Inputs elsewhere{inputs.names, Eigen::MatrixXd(1, 3)};
  elsewhere.values << 300.0, 40.0, 1.5;
  std::printf("at t = 300, power = 40, draught = 1.5: %.2f\n", corrected(simulation, missing, terms, elsewhere)(0, 0));
}
