// The answer and what is confirmed, decided in one place from the verdict of the search and the objections to it.
#pragma once

#include <cstddef>
#include <vector>

#include "llmt/discovery/missing.hpp"

namespace llmt::discovery {

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

}  // namespace llmt::discovery
