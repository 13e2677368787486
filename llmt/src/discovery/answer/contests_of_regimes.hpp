// What the contests of regimes search.
#pragma once

#include <map>
#include <set>
#include <string>
#include <vector>

#include "llmt/discovery/missing.hpp"
#include "llmt/discovery/model_term.hpp"

namespace llmt::discovery {

/// Whether something is left that no term without a regime explains: more than 1.5 times the noise, where that is
/// known, on the rows searched or set aside; elsewhere if the answer says so, or what is left is alike in neighbouring
/// rows. A state's errors are not those of its inputs, so nothing counts as left beside one.
bool leaves_something(const Missing& missing);

/// "where x > c", of the location of a term that acts in a regime; empty: it acts everywhere.
std::string gate_of(const std::string& location);

/// The indices of terms that act in a regime alone.
std::set<std::size_t> terms_of_regimes(const std::vector<ModelTerm>& terms);

/// What a contest searches, but for the terms left out.
struct Others {
  std::vector<ModelTerm> terms;
  std::set<std::size_t> left_out;
};

/// `left`, and those of `terms` for which test(term) holds.
template <class Test>
std::set<std::size_t> with_those(std::set<std::size_t> left, const std::vector<ModelTerm>& terms, Test test) {
  for (std::size_t t = 0; t < terms.size(); ++t) {
    if (test(terms[t])) left.insert(t);
  }
  return left;
}

/// Thresholds of inputs.
using Gates = std::map<std::string, double>;

/// Each is searched by itself, and meets who won before; none where the contest does not apply. `of_size`: see
/// gates_of_size().
using OthersOf = std::vector<Others> (*)(const Missing& found, const std::vector<ModelTerm>& terms,
                                         const std::set<std::size_t>& refuted, const Gates& of_size);

/// Terms without constants find the input and the threshold, and those that were found everywhere.
std::vector<Others> plain_regimes(const Missing& found, const std::vector<ModelTerm>& terms,
                                  const std::set<std::size_t>& refuted, const Gates& of_size);

/// All terms, beyond the thresholds that were found. A step is an offset in a regime: where it stands for another term
/// its threshold is only near that one's, so others are tried too. A step of another input there may be the same step.
std::vector<Others> same_regimes(const Missing& found, const std::vector<ModelTerm>& terms,
                                 const std::set<std::size_t>& refuted, const Gates& of_size);

/// The same of what stands now, where something is left.
std::vector<Others> same_regimes_again(const Missing& found, const std::vector<ModelTerm>& terms,
                                       const std::set<std::size_t>& refuted, const Gates& of_size);

/// Nothing without a constant comes near some laws. Where deviations change their size, all terms are tried.
std::vector<Others> regimes_of_size(const Missing& found, const std::vector<ModelTerm>& terms,
                                    const std::set<std::size_t>& refuted, const Gates& of_size);

/// A law of several numbers comes close to simpler ones: others in its place, then those without constants of their
/// own.
std::vector<Others> simpler_in_these_regimes(const Missing& found, const std::vector<ModelTerm>& terms,
                                             const std::set<std::size_t>& refuted, const Gates& of_size);

}  // namespace llmt::discovery
