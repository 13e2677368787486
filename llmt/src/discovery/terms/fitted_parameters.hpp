// Parameters of a simulation beside the terms that it lacks: which sums of them the rows determine, and whether they
// are off their nominal values.
#pragma once

#include <vector>

#include "discovery/terms/term_model.hpp"

namespace llmt::discovery {

/// A free parameter and those that only act together with it: values(first) + sum of factor * values(parameter).
struct ParameterSum {
  struct Part {
    std::size_t parameter;
    double factor;
  };
  std::size_t first = 0;
  std::vector<Part> others;
};

struct DistinctParameters {
  std::vector<ParameterSum> sums;
  std::vector<std::size_t> without_effect;
};

/// The sums of free parameters that a Jacobian by them determines, in their order. Each parameter whose column is, to a
/// thousandth of its length, a combination of those before it, is no longer free and joins them. One whose column is
/// zero is no longer free and has no effect. A parameter that is known beforehand (prior_sigma) is determined by that.
DistinctParameters distinct_parameters(const Eigen::MatrixXd& jacobian, std::vector<Parameter>& parameters);

/// Whether the change is farther from zero than noise takes it with the probability `false_alarm_rate`.
bool is_beyond_chance(const FittedParameter& fitted, double false_alarm_rate);

/// The fits of a simulation that are compared.
struct ParameterFits {
  const TermModel& model;
  const TermData& data;
  const Eigen::VectorXd& nominal;
  const TermFit& alone;   // without terms
  const TermFit& beside;  // with the terms found
};

/// Missing::fitted_parameters, parameter_gain and, where nothing is missing, the answer; parameters that no row depends
/// on go to Missing::not_testable.
void describe_parameters(const ParameterFits& fits, const DistinctParameters& distinct, double false_alarm_rate,
                         Missing& missing);

}  // namespace llmt::discovery
