// The outcome of a search in the words of find_missing(): terms, what was visible, gaps, and parameters.
#pragma once

#include <cstddef>
#include <set>
#include <string>
#include <vector>

#include "discovery/answer/question.hpp"
#include "discovery/answer/term_fit.hpp"
#include "llmt/discovery/missing.hpp"

namespace llmt::discovery {

/// A sample that deviates by more noise floors than this, whatever is compared, is an outlier.
inline constexpr double far_off = 5.0;
/// Where a larger share of the samples is so far off, the noise floor is no measure of what is left, and none is an
/// outlier.
inline constexpr double largest_share_of_outliers = 0.15;

/// "wave t (P = 2.3)".
std::string option_label(const TermModel& model, const PlacedTerm& option);

/// Coefficients and constants of a term that was found. `errors`: of its coefficients, then of its constants.
void set_estimates(const PlacedTerm& placed, const Eigen::VectorXd& errors, FoundTerm& found);

/// A term as it is placed. `errors`: of its coefficients, then of its constants.
FoundTerm described(const TermModel& model, const PlacedTerm& placed, const Eigen::VectorXd& errors);

/// Missing::found, not yet confirmed.
void describe_findings(const TermModel& model, const Settled& settled, Missing& missing);

/// Missing::visible and not_testable.
void describe_limits(const Settled& settled, const TermData& data, Missing& missing);

/// Of the errors of an output on the samples set aside: at the nominal parameters, with parameters alone, with terms.
Gap gap_of(std::string output, const Eigen::VectorXd& nominal, const Eigen::VectorXd& before,
           const Eigen::VectorXd& after, double noise_floor);

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
