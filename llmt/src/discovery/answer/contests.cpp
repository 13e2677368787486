#include "discovery/answer/contests.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <string>
#include <utility>

#include "discovery/answer/judges.hpp"

namespace llmt::discovery {
namespace {

using Terms = std::vector<ModelTerm>;
using Left = std::set<std::size_t>;

bool is_certain(const Missing& missing) {
  if (missing.found.empty()) return missing.answer != Answer::unknown && missing.answer != Answer::undecided;
  return std::ranges::all_of(missing.found, &FoundTerm::confirmed);
}

bool has_shapes(const Missing& missing) { return std::ranges::any_of(missing.found, &FoundTerm::generic); }

Eigen::Index fitted_numbers(const Missing& missing) {
  Eigen::Index count = 0;
  for (const FoundTerm& term : missing.found) {
    count += (term.whole ? 0 : term.coefficients.size()) + term.constants.size();
    // A threshold of 0 is no fitted number.
    if (!term.regime.empty() && term.constants(term.constants.size() - 1) == 0.0) --count;
  }
  return count;
}

bool has_same_terms(const Missing& a, const Missing& b) {
  const auto terms = [](const Missing& missing) {
    std::set<std::pair<std::size_t, Eigen::Index>> all;
    for (const FoundTerm& found : missing.found) all.insert({found.term, found.output_index});
    return all;
  };
  return terms(a) == terms(b);
}

// Whether what the answers add is within a tenth the same at all rows.
bool is_same_function(const Missing& a, const Missing& b) {
  for (Eigen::Index o = 0; o < a.corrected.cols(); ++o) {
    const double size = (a.corrected.col(o) - a.before.col(o)).norm();
    if ((a.corrected.col(o) - b.corrected.col(o)).norm() > same_function * size) return false;
  }
  return true;
}

// Those terms of `other` that are not among those of `found`, on the output of `term`.
RivalTerms in_its_place(const FoundTerm& term, const std::vector<FoundTerm>& found, const Missing& other) {
  RivalTerms rival;
  for (const FoundTerm& instead : other.found) {
    const bool is_shared = std::ranges::any_of(found, [&](const FoundTerm& own) {
      return own.term == instead.term && own.output_index == instead.output_index;
    });
    if (is_shared || instead.output_index != term.output_index) continue;
    rival.what +=
        (rival.what.empty() ? "" : " + ") + instead.family + (instead.location.empty() ? "" : " " + instead.location);
    rival.inputs.insert(rival.inputs.end(), instead.inputs.begin(), instead.inputs.end());
  }
  return rival;
}

// `other` as a rival of the terms of `found` that it does without.
Missing with_rival(Missing found, const Missing& other, std::optional<Reason> objection) {
  const std::vector<FoundTerm> all = found.found;
  for (std::size_t k = 0; k < found.found.size(); ++k) {
    FoundTerm& term = found.found[k];
    const bool is_shared = std::ranges::any_of(other.found, [&](const FoundTerm& own) {
      return own.term == term.term && own.output_index == term.output_index;
    });
    if (is_shared) continue;
    const RivalTerms rival = in_its_place(term, all, other);
    if (rival.what.empty()) continue;
    term.rivals.insert(term.rivals.begin(), rival);
    if (objection) object(found, *objection, {k});
  }
  decide(found);
  return found;
}

// A state filters the simulated output, errors of the inputs too, so that its standard error alone is no proof.
std::vector<Others> all(const Missing& found, const Terms& terms, const Left&, const Gates&) {
  if (found.answer != Answer::inner_state) return {};
  return {{terms, with_those({}, terms, [](const ModelTerm&) { return true; })}};
}

std::vector<Others> states(const Missing& found, const Terms& terms, const Left& refuted, const Gates&) {
  if (found.answer != Answer::inner_state) return {};
  return {{terms, with_those(refuted, terms, [](const ModelTerm& term) { return !term.inner_state.empty(); })}};
}

// A shape has so many numbers that it explains more than the term that acts, noise and outliers among it.
std::vector<Others> shapes(const Missing& found, const Terms& terms, const Left& refuted, const Gates&) {
  if (!has_shapes(found)) return {};
  return {{terms, with_those(refuted, terms, [](const ModelTerm& term) { return term.generic; })}};
}

// A search goes one term after another. Where it took one for another, what it found beside it is wrong too, and no
// exchange of one term for one leads back.
std::vector<Others> each_left_out(const Missing& found, const Terms& terms, const Left& refuted, const Gates&) {
  constexpr std::size_t most = 4;  // more approximate what was not tried
  std::vector<Others> others;
  if (is_certain(found) || found.answer == Answer::inner_state || found.found.size() > most) return others;
  for (const FoundTerm& term : found.found) {
    if (term.generic) continue;
    others.push_back({terms, refuted});
    others.back().left_out.insert(term.term);
  }
  return others;
}

std::vector<Others> constants(const Missing& found, const Terms& terms, const Left& refuted, const Gates&) {
  std::set<std::vector<std::string>> places;
  for (const FoundTerm& term : found.found) {
    if (!term.generic && term.constants.size() > 0 && term.inputs.size() == 1) places.insert(term.inputs);
  }
  if (places.empty() || found.answer == Answer::inner_state) return {};
  return {{terms, with_those(refuted, terms, [&](const ModelTerm& term) {
             return places.contains(term.inputs) && !term.constants.empty();
           })}};
}

// Terms and the values of their constants were chosen on all rows: a term costs the logarithm of the number of those
// that it was chosen from.
double cost_of_choice(const Missing& answer, const Terms& terms) {
  const auto of_regimes =
      static_cast<double>(std::ranges::count_if(terms, [](const ModelTerm& term) { return !term.regime.empty(); }));
  const double of_others = static_cast<double>(std::ssize(terms)) - of_regimes;
  double cost = 0.0;
  for (const FoundTerm& found : answer.found) {
    const ModelTerm& term = terms[found.term];
    cost += std::log(term.regime.empty() ? of_others : of_regimes);
    for (const TermConstant& constant : term.constants)
      cost += std::log(std::max(1.0, static_cast<double>(constant.tried.size())));
  }
  return cost;
}

struct Contest {
  const char* name;
  OthersOf others;
  bool (*may_win)(const Missing& other);
};

bool any_answer(const Missing&) { return true; }

// Terms in the place of a shape are a name for it only where they are certain.
bool names(const Missing& other) { return !other.found.empty() && is_certain(other); }

// Regimes last, because they are tried where everything else leaves something.
constexpr std::array<Contest, 10> contests = {{{"no states", states, any_answer},
                                               {"no terms", all, any_answer},
                                               {"no shapes", shapes, names},
                                               {"no such term", each_left_out, names},
                                               {"no searched constants", constants, any_answer},
                                               {"regimes", plain_regimes, any_answer},
                                               {"terms of these regimes", same_regimes, any_answer},
                                               {"terms of these again", same_regimes_again, any_answer},
                                               {"regimes by size", regimes_of_size, any_answer},
                                               {"simpler in these", simpler_in_these_regimes, any_answer}}};

Missing winner(Missing found, Missing other, const Terms& terms, const CrossValidation& validation) {
  Eigen::VectorXd floors(std::ssize(found.gaps));
  for (std::size_t o = 0; o < found.gaps.size(); ++o) {
    floors(static_cast<Eigen::Index>(o)) = std::max(found.gaps[o].noise_floor, other.gaps[o].noise_floor);
  }
  const double share = std::max(found.time.independent_share, other.time.independent_share);
  // What is uncertain by one of the two answers counts as uncertain.
  const Eigen::MatrixXd weights = found.weights.cwiseMin(other.weights);
  Advantage of_other = advantage(validation.errors(found, weights), validation.errors(other, weights), floors, share);
  of_other.log_likelihood -= cost_of_choice(other, terms) - cost_of_choice(found, terms);
  return better_of(std::move(found), std::move(other), of_other);
}

}  // namespace

Missing better_of(Missing found, Missing other, const Advantage& of_other) {
  constexpr double sure = 2.0;  // standard errors
  const double margin = sure * of_other.standard_error;
  const bool may_replace = is_certain(other) || !is_certain(found);
  if (of_other.log_likelihood < -margin) return found;
  if (of_other.log_likelihood > margin) {
    return may_replace ? other : with_rival(std::move(found), other, Reason::likelier);
  }
  const std::optional<Reason> objection =
      is_same_function(found, other) ? std::nullopt : std::optional<Reason>(Reason::rival);
  const bool is_simpler = fitted_numbers(other) < fitted_numbers(found);
  return is_simpler && may_replace ? with_rival(std::move(other), found, objection)
                                   : with_rival(std::move(found), other, objection);
}

Missing contested(Missing found, const Terms& terms, const Left& refuted, const CrossValidation& validation,
                  const std::function<Missing(const Terms&, const Left&)>& search) {
  const Gates of_size = terms_of_regimes(terms).empty() ? Gates() : gates_of_size(validation, found);
  for (const Contest& contest : contests) {
    for (const Others& others : contest.others(found, terms, refuted, of_size)) {
      Missing other = search(others.terms, others.left_out);
      const bool competes = other.answer != Answer::failed_held_out && beyond_constants(other, terms).empty() &&
                            !(has_shapes(other) && !has_shapes(found)) && !has_same_terms(found, other) &&
                            contest.may_win(other);
      if (competes) found = winner(std::move(found), std::move(other), terms, validation);
    }
  }
  return found;
}

}  // namespace llmt::discovery
