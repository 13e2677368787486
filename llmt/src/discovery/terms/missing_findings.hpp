// What a search found, in the words of find_missing().
#pragma once

#include "discovery/terms/term_question.hpp"

namespace llmt::discovery {

/// Where the rounds of search and fit ended.
struct Settled {
  TermFit fit;
  Verdict verdict;
  TermQuestion question;
  int rounds = 0;
};

/// "wave t (P = 2.3)".
std::string option_label(const TermModel& model, const PlacedTerm& option);

/// Missing::found.
void describe_findings(const TermModel& model, const Settled& settled, Missing& missing);

/// Missing::visible and not_testable.
void describe_limits(const Settled& settled, const FitData& data, Missing& missing);

/// Three or more kinds of terms of one input, or two terms of the same two inputs, may only approximate another
/// function: they are not confirmed.
void doubt_approximations(Missing& missing);

/// Missing::structure and answer. Deviations that neighbouring rows share are not noise.
void look_for_structure(const TermModel& model, const FitData& data, const Inputs& inputs, Missing& missing);

}  // namespace llmt::discovery
