// The outcome of a search in the words of find_missing().
#pragma once

#include <cstddef>
#include <set>
#include <string>
#include <vector>

#include "discovery/terms/term_question.hpp"

namespace llmt::discovery {

/// The end of the rounds of search and fit.
struct Settled {
  TermFit fit;
  Verdict verdict;
  TermQuestion question;
  int rounds = 0;
};

/// "wave t (P = 2.3)".
std::string option_label(const TermModel& model, const PlacedTerm& option);

/// Coefficients and constants of a term that was found. `errors`: of its coefficients, then of its constants.
void set_estimates(const PlacedTerm& placed, const Eigen::VectorXd& errors, FoundTerm& found);

/// Missing::found, not yet confirmed.
void describe_findings(const TermModel& model, const Settled& settled, Missing& missing);

/// Missing::visible and not_testable.
void describe_limits(const Settled& settled, const TermData& data, Missing& missing);

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

/// Of the errors of an output on the samples set aside: at the nominal parameters, with parameters alone, with terms.
Gap gap_of(std::string output, const Eigen::VectorXd& nominal, const Eigen::VectorXd& before,
           const Eigen::VectorXd& after, double noise_floor);

}  // namespace llmt::discovery
