// What is held against the terms found, and the answer that follows.
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <set>
#include <string>
#include <vector>

#include "discovery/answer/errors_of_inputs.hpp"
#include "discovery/answer/question.hpp"
#include "discovery/recording/recording.hpp"
#include "llmt/discovery/missing.hpp"

namespace llmt::discovery {

/// Deviations of which a smaller share is independent are alike in neighbours.
inline constexpr double alike_in_neighbours = 0.5;
/// A value that is farther from 0, or from a limit, in standard errors is certainly beyond it.
inline constexpr double certainly = 2.0;

/// Adds an objection to terms, numbers in Missing::found; without any, to the answer as a whole.
void object(Missing& missing, Reason reason, const std::vector<std::size_t>& terms = {});

/// Objections that are seen in the terms found and in the structure left: shapes, approximations (in time, see
/// approximations()), terms that do not shrink the error on the rows set aside, states whose size is within two
/// standard errors of 0, terms of an output in which structure is left.
void judge_findings(Missing& missing, bool in_time);

/// Where more is left of an output than 5 times its known noise: against its terms that are no state.
void judge_noise(Missing& missing);

/// Sets Missing::answer and FoundTerm::confirmed. The terms of an output are confirmed if there is no objection to the
/// answer, nor to any of them: beside one that is tentative another may stand for a part of it. The answer is that of
/// the first row of the table in docs/algorithms/rows-in-time.md ("The answer") that applies.
void decide(Missing& missing);

/// Sets FoundTerm::shrinks_gap and Missing::failing_rows. Errors are sums of squares over the samples set aside, in
/// units of the scatter of each output. A term is judged against a fit without it, to the samples searched, if it
/// changes the samples set aside by more than their noise hides. `baseline`: the fit without terms; `kept`: samples
/// searched, without outliers. What errors of the inputs add to terms of a state is taken off, if `errors` is given.
void judge_held_out(const TermModel& model, const TermData& kept, const TermData& aside, const TermFit& baseline,
                    const Settled& settled, const InputNoise* errors, Missing& missing);

/// For rows in time. Sets FoundTerm::inner_state of terms whose input is a derivative of the output by time: they stand
/// for a state.
void find_states_of_outputs(const Recording& recording, const MeasuredOutputs& measured, Missing& missing);

/// Terms that consist of errors more than of anything else are tentative.
void doubt_uncorrected(const ErrorsOfInputs& errors, Missing& missing);

struct StructureLeft {
  std::vector<Eigen::Index> columns;  // of the inputs that neighbours were taken in; empty: no test possible
  double p_value = 1.0;               // corrected for the number of tests
  double share = 0.0;                 // of the sum of squares that neighbours have in common
};

/// Neighbours in one input, in two, and in all: T = sum over neighbours of e_i e_j, against random signs of e, under
/// which T has mean 0 and variance sum w_ij^2 e_i^2 e_j^2. The most significant of all tests.
///
/// In time (`stretches` not empty: labels, samples of one label follow each other) neighbours are samples of different
/// times, 2 / independent_share apart, because noise is alike in samples that follow each other. The variance is larger
/// by 1 / independent_share, or by 1 + 2 sum_m r_m^2 with the correlations r_m of e up to three places (Bartlett 1935)
/// where that is more, because products of pairs that follow each other are alike, too.
StructureLeft structure_left(const Eigen::MatrixXd& inputs, const Eigen::VectorXd& errors,
                             const std::vector<Eigen::Index>& stretches = {}, double independent_share = 1.0);

/// A signal as the samples beside each sample show it: the weighted mean of those 1, 2, ... places before and after, of
/// the same stretch, where there are any, else the sample's own value.
///
/// An error of an input moves the simulation at its sample, and so the deviation there. Samples that the error makes
/// alike in this input, seen beside the others, then have like deviations though nothing is missing. A mean of other
/// samples has other errors (a lagged value as an instrument: Fuller 1987, section 1.4).
Eigen::VectorXd between_neighbours(const Eigen::VectorXd& signal, const std::vector<Eigen::Index>& stretches,
                                   const std::vector<double>& weights);

/// Weights of such a mean whose errors are not those of the sample: all on the place ceil(1 / independent_share).
///
/// Of filtered rows the errors of speeds and accelerations, of a position with white noise, are alike in neighbouring
/// samples, with changing sign. With the deviation, which has been through the filter once more, they are correlated by
/// -.63, .16, .03 (accelerations) and -.41, -.14, .09 (speeds) at 1, 2, 3 places. So up to ceil(1 / independent_share)
/// = 3 the weights are those of uncorrelated_neighbours(), about .08, .21, .71.
std::vector<double> weights_of_neighbours(const Recording& recording, double independent_share);

/// Deviations that neighbouring rows share, so that they are not noise, as far as they are material. `errors`: standard
/// deviations of the errors of the inputs, empty where none are known. In time, neighbours in an input with errors are
/// found by between_neighbours() of it.
std::vector<Structure> structure_beside(const TermModel& model, const TermData& data, const Inputs& inputs,
                                        const Eigen::VectorXd& errors, const Missing& missing);

/// The indices in `terms` of those terms of a state that were found with a frequency at an end of those tried, or with
/// a damping ratio that is not below the largest tried by two standard errors: a filter, no machine, has such
/// constants.
std::set<std::size_t> beyond_constants(const Missing& missing, const std::vector<ModelTerm>& terms);

/// The indices in `terms` of those that were found with a width below 4 standard deviations of the errors of their
/// input: the errors smear what is so narrow, and it follows single rows. Where the input was smoothed, whose errors
/// before are `of_smoothed`, 2 of these count as well: the simulation saw them. In filtered rows what the input changes
/// by from row to row where it passes 0 counts too: no row need stand in a peak that is narrower.
std::set<std::size_t> narrower_than_errors(const Missing& missing, const std::vector<ModelTerm>& terms,
                                           const Recording& recording, const Eigen::VectorXd& of_smoothed);

/// States found whose size may be 0, or that errors of the inputs could make. They filter the simulated output, and so
/// take errors of the inputs out of it.
std::set<std::size_t> states_by_chance(const Missing& missing);

}  // namespace llmt::discovery
