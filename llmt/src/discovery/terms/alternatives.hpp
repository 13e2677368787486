// Searches among fewer terms, whose answer is taken where it does better on the rows set aside.
#pragma once

#include <cstddef>
#include <functional>
#include <set>
#include <vector>

#include "discovery/terms/one_search.hpp"

namespace llmt::discovery {

/// Of one question, for rows in time. Each search returns what was found where it does no better.
class Alternatives {
 public:
  /// Keeps references.
  Alternatives(const Simulation& simulation, const Inputs& inputs, const MeasuredOutputs& measured,
               const std::vector<ModelTerm>& terms, const SearchedRows& rows, const MissingOptions& options,
               const std::set<std::size_t>& refuted)
      : simulation_(&simulation),
        inputs_(&inputs),
        measured_(&measured),
        terms_(&terms),
        rows_(&rows),
        options_(&options),
        refuted_(&refuted) {}

  /// Replaces all terms by terms of states alone if a term of a state was refuted beside others, but such terms alone
  /// hold and leave less. States and terms of the row itself explain a part of each other.
  Missing state_for_terms(Missing found) const;

  /// Replaces terms of states by no more plain terms if these leave next to nothing and little more than the states do.
  /// A state also explains what a measured input shows, as a second encoder shows a spring, and has no error of its
  /// own.
  Missing terms_for_state(Missing found) const;

  /// Replaces shapes by causes if these leave as little. Shapes follow noise that is alike in neighbours farther than
  /// causes do, and they follow what is small beside the causes.
  Missing causes_for_shapes(Missing found) const;

  /// Replaces a term that has a searched constant by plain terms if these leave less than 80 % of the squares, or no
  /// more with fewer fitted numbers, or, all certain and with no more numbers, as much by the margin of a rival. If
  /// uncertain ones do as well by that margin, the term becomes tentative, as it may be an approximation too. The
  /// errors of such a term make neighbours alike, so that few samples count and two plain terms do not seem to be worth
  /// their cost.
  Missing plain_for_searched(Missing found) const;

 private:
  const Simulation* simulation_;
  const Inputs* inputs_;
  const MeasuredOutputs* measured_;
  const std::vector<ModelTerm>* terms_;
  const SearchedRows* rows_;
  const MissingOptions* options_;
  const std::set<std::size_t>* refuted_;

  bool has_judges(const Missing& found) const { return inputs_->instants.size() > 0 && !found.held_out.empty(); }
  Missing without(std::set<std::size_t> refuted, const std::function<bool(const ModelTerm&)>& left_out) const;
};

/// Whether a share of the simulated output was found, or of its size.
bool has_gain(const Missing& missing);

/// The indices of terms that are a share of the simulated output.
std::set<std::size_t> shares_of_the_simulation(const std::vector<ModelTerm>& terms);

/// The indices of terms that act in a regime alone.
std::set<std::size_t> terms_of_regimes(const std::vector<ModelTerm>& terms);

/// Whether something is left that no term without a regime explains: more than twice the noise, as far as that is
/// known, and the answer says so, or what is left is alike in neighbouring rows.
bool leaves_something(const Missing& missing);

/// An answer with terms of regimes in the place of one that leaves something, where it holds and leaves less than 80 %
/// of the squares on the rows set aside.
Missing regimes_for_unknown(Missing found, Missing of_regimes);

/// Changes of an inertia and of friction together change the output by almost a share of it, and so do changes of all
/// free parameters. `of_inputs` is the answer without shares. Where it explains as well on the rows set aside, by the
/// margin of a rival: if it has fewer terms, it is the answer, and otherwise those that stand in the place of a gain
/// become a rival of it, which is tentative if they are.
Missing inputs_for_gain(Missing found, Missing of_inputs, const MeasuredOutputs& measured, double rival_margin);

}  // namespace llmt::discovery
