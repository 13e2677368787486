#include "discovery/search/replacements.hpp"

#include <algorithm>
#include <cmath>
#include <set>

#include "discovery/search/explore.hpp"

namespace llmt::discovery {
namespace {

std::set<std::string> locations_of(const Scoring& scoring, const Set& set, const std::string& family) {
  std::set<std::string> locations;
  for (const std::size_t a : set) {
    if (scoring.candidates()[a].family == family) locations.insert(scoring.candidates()[a].location);
  }
  return locations;
}

Set of_family(const Scoring& scoring, const Set& set, const std::string& family) {
  return filtered(set, [&](std::size_t a) { return scoring.candidates()[a].family == family; });
}

// `set` with the best few candidates of `other` in the place of those of `family`. The same family is tried elsewhere:
// variants of a cause at the same place have one name.
Explained replaced(const Scoring& scoring, const Set& set, const std::string& family, const std::string& other,
                   const SearchOptions& options) {
  const std::vector<EffectCandidate>& candidates = scoring.candidates();
  const std::set<std::string> taken = locations_of(scoring, set, family);
  std::vector<bool> allowed(candidates.size());
  for (std::size_t a = 0; a < candidates.size(); ++a) {
    allowed[a] = candidates[a].family == other && !(other == family && taken.contains(candidates[a].location));
  }
  const Set rest = without_family(scoring, set, family);
  Explained current{rest, scoring.score(rest)};
  while (std::ssize(current.set) < options.largest_set) {
    Explained next;
    for (const Scoring::Move& move : scoring.additions(current.set, allowed)) {
      if (move.score >= current.score) break;
      const Set grown = with(current.set, move.candidate);
      const double grown_score = scoring.score(grown);
      if (grown_score >= current.score) continue;
      next = {grown, grown_score};
      break;
    }
    if (next.score >= current.score) break;
    current = next;
  }
  return current;
}

// What the family adds to the prediction of a set.
Eigen::VectorXd contribution(const Scoring& scoring, const SetFit& fit, const Set& set, const std::string& family) {
  const Workspace& workspace = scoring.workspace();
  Eigen::VectorXd sum = Eigen::VectorXd::Zero(workspace.basis().rows());
  Eigen::Index next = 0;
  for (const std::size_t a : set) {
    const Block& block = workspace.blocks()[a];
    if (scoring.candidates()[a].family == family) {
      sum += workspace.basis().middleCols(block.begin, block.size) * fit.coefficients.segment(next, block.size);
    }
    next += block.size;
  }
  return sum;
}

// Whether another set predicts the same at every sample as `set` with the family. That both leave as much is not
// enough: causes that differ may do so by chance.
bool predict_alike(const Scoring& scoring, const Set& set, const std::string& family, const Set& other) {
  // A share of the squares. Columns are good to about a thousandth of that where candidates are linear only nearly, so
  // what differs by less than three times that is the same.
  constexpr double same = 1e-5;
  const SetFit fit = scoring.fit(set);
  const SetFit other_fit = scoring.fit(other);
  const double explained = scoring.workspace().sum_of_squares() - fit.left;
  if (!(std::abs(other_fit.left - fit.left) < same * explained)) return false;
  const double own = std::min(explained, contribution(scoring, fit, set, family).squaredNorm());
  return (scoring.remaining(fit) - scoring.remaining(other_fit)).squaredNorm() < same * own;
}

// Whether another set has a more general law in the place of the family, which is nearly the same here.
bool is_generalisation(const Scoring& scoring, const Set& set, const std::string& family, const Set& other,
                       const Set& instead) {
  constexpr double nearly = 0.02;  // a share of the squares
  const Set own = of_family(scoring, set, family);
  const std::set<std::string> places = locations_of(scoring, set, family);
  const auto columns = [&](const Set& of) {
    Eigen::Index sum = 0;
    for (const std::size_t a : of) sum += scoring.workspace().blocks()[a].size;
    return sum;
  };
  if (instead.size() != own.size() || columns(instead) <= columns(own)) return false;
  for (const std::size_t a : instead) {
    if (!places.contains(scoring.candidates()[a].location)) return false;
  }
  const SetFit fit = scoring.fit(set);
  const double size = contribution(scoring, fit, set, family).squaredNorm();
  return (scoring.remaining(fit) - scoring.remaining(scoring.fit(other))).squaredNorm() < nearly * size;
}

// The families that could stand for a cause.
std::set<std::string> causes_of(const Scoring& scoring) {
  std::set<std::string> causes;
  for (std::size_t a = 0; a < scoring.candidates().size(); ++a) {
    if (scoring.usable(a) && !scoring.candidates()[a].generic) causes.insert(scoring.candidates()[a].family);
  }
  return causes;
}

int complexity_of(const Scoring& scoring, const Set& set) {
  int most = 0;
  for (const std::size_t a : set) most = std::max(most, scoring.candidates()[a].complexity);
  return most;
}

int sum_of_complexities(const Scoring& scoring, const Set& set) {
  int sum = 0;
  for (const std::size_t a : set) sum += scoring.candidates()[a].complexity;
  return sum;
}

// The set without the members that it does better without.
Explained without_needless(const Scoring& scoring, Explained found) {
  for (bool changed = true; changed;) {
    changed = false;
    for (const std::size_t member : found.set) {
      const Set rest = without(found.set, member);
      const double score = scoring.score(rest);
      if (score >= found.score) continue;
      found = {rest, score};
      changed = true;
      break;
    }
  }
  return found;
}

// Fewer and simpler terms that do better than `set` if another family stands in the place of one: with a hinge at the
// other side, the line and the offset beside it go. Empty: there are none.
Set fewer(const Scoring& scoring, const Set& set, const std::string& family, const SearchOptions& options) {
  for (const std::string& other : causes_of(scoring)) {
    if (other == family) continue;
    const Explained rival = without_needless(scoring, replaced(scoring, set, family, other, options));
    if (rival.set.size() < set.size() && rival.score <= scoring.score(set) &&
        sum_of_complexities(scoring, rival.set) < sum_of_complexities(scoring, set)) {
      return rival.set;
    }
  }
  return {};
}

// The least complex set that predicts the same as `set` with another family in the place of one, or that is a rival of
// it at the same place if the simplest of rivals is asked for; empty: there is none.
Set simpler(const Scoring& scoring, const Set& set, const std::string& family, const SearchOptions& options) {
  Set best;
  int least = complexity_of(scoring, of_family(scoring, set, family));
  if (least == 0) return best;
  const double enough = scoring.score(set) + options.rival_margin;
  const std::set<std::string> places = locations_of(scoring, set, family);
  const auto is_in_its_place = [&](std::size_t a) { return places.contains(scoring.candidates()[a].location); };
  const Set rest = without_family(scoring, set, family);
  // Of several terms of one place the least simple one may not be needed.
  const Set beside = filtered(rest, is_in_its_place);
  if (options.simplest_of_rivals && !beside.empty() && complexity_of(scoring, beside) <= least &&
      scoring.score(rest) <= enough) {
    return rest;
  }
  for (const std::string& other : causes_of(scoring)) {
    if (other == family) continue;
    const Explained rival = replaced(scoring, set, family, other, options);
    const Set instead = filtered(rival.set, [&](std::size_t a) { return !contains(set, a); });
    if (instead.empty() || rival.set.size() > set.size() || complexity_of(scoring, instead) >= least) continue;
    const bool is_in_place = std::ranges::all_of(instead, is_in_its_place);
    if (rival.score > enough) continue;
    if (!(options.simplest_of_rivals && is_in_place) && !predict_alike(scoring, set, family, rival.set)) continue;
    least = complexity_of(scoring, instead);
    best = rival.set;
  }
  return best;
}

}  // namespace

std::vector<Rival> rivals_of(const Scoring& scoring, const Set& set, const std::string& family,
                             const SearchOptions& options) {
  const std::vector<EffectCandidate>& candidates = scoring.candidates();
  const double score = scoring.score(set);
  const Set rest = without_family(scoring, set, family);
  const Set own = of_family(scoring, set, family);
  const std::set<std::string> places = locations_of(scoring, set, family);
  const double left = scoring.fit(set).left;
  const double explained = scoring.workspace().sum_of_squares() - left;
  std::vector<Rival> rivals;
  for (const std::string& other : causes_of(scoring)) {
    const Explained rival = replaced(scoring, set, family, other, options);
    if (rival.set.size() == rest.size()) continue;
    const bool is_as_good = rival.score <= score + options.rival_margin ||
                            scoring.fit(rival.set).left - left < options.model_error * explained;
    if (!is_as_good) continue;
    const Set instead = filtered(rival.set, [&](std::size_t a) { return !contains(rest, a); });
    const bool is_exact = predict_alike(scoring, set, family, rival.set);
    // What is more complex and says the same at the same place is another way of writing it.
    const bool is_rewritten =
        is_exact && complexity_of(scoring, instead) > complexity_of(scoring, own) &&
        std::ranges::all_of(instead, [&](std::size_t a) { return places.contains(candidates[a].location); });
    if (!is_rewritten && !(options.simplest_of_rivals && is_generalisation(scoring, set, family, rival.set, instead))) {
      rivals.push_back({other, instead, rival.score - score, is_exact});
    }
  }
  std::ranges::stable_sort(rivals, {}, &Rival::score_difference);
  return rivals;
}

Set least_complex(const Scoring& scoring, Set set, const SearchOptions& options) {
  // Every change lowers the sum of the complexities.
  for (bool changed = true; changed;) {
    changed = false;
    for (const std::string& family : families_of(scoring, set)) {
      Set better = simpler(scoring, set, family, options);
      if (better.empty() && options.simplest_of_rivals) better = fewer(scoring, set, family, options);
      if (better.empty()) continue;
      set = std::move(better);
      changed = true;
      break;
    }
  }
  return set;
}

}  // namespace llmt::discovery
