#include "discovery/search/explore.hpp"

#include <algorithm>
#include <cmath>
#include <set>

namespace llmt::discovery {
namespace {

constexpr double smallest_improvement = 1e-6;

// The best addition whose score stands when limits are looked at.
Explained best_addition(const Scoring& scoring, const Set& set, const std::vector<bool>& allowed, double bound) {
  for (const Scoring::Move& move : scoring.additions(set, allowed)) {
    if (move.score >= bound - smallest_improvement) break;
    const Set grown = with(set, move.candidate);
    const double score = scoring.score(grown);
    if (score < bound - smallest_improvement) return {grown, score};
  }
  return {};
}

// `seen`: sets from which the search has gone on before; from there it would end where it ended then.
Explained improve(const Scoring& scoring, const std::vector<bool>& allowed, Explained current, int largest_set,
                  std::set<Set>& seen) {
  const auto consider = [](Explained& best, const Explained& other) {
    if (other.score < best.score - smallest_improvement) best = other;
  };
  for (int step = 0; step < 60 && seen.insert(current.set).second; ++step) {
    Explained best = current;
    if (std::ssize(current.set) < largest_set) consider(best, best_addition(scoring, current.set, allowed, best.score));
    std::set<std::string> families;
    for (const std::size_t member : current.set) {
      const Set rest = without(current.set, member);
      consider(best, {rest, scoring.score(rest)});
      families.insert(scoring.candidates()[member].family);
    }
    for (const std::string& family : families) {
      const Set rest = filtered(current.set, [&](std::size_t a) { return scoring.candidates()[a].family != family; });
      consider(best, {rest, scoring.score(rest)});
    }
    // Swaps are dearer: only when nothing simpler helps.
    if (best.score >= current.score - smallest_improvement) {
      for (const std::size_t member : current.set) {
        consider(best, best_addition(scoring, without(current.set, member), allowed, best.score));
      }
    }
    if (best.score >= current.score - smallest_improvement) break;
    current = best;
  }
  return current;
}

// All usable members of a family, best first, as long as the set can be solved and respects its limits.
Set whole_family(const Scoring& scoring, const std::vector<bool>& allowed, const std::string& family, int largest_set) {
  Set set;
  std::vector<bool> own = allowed;
  for (std::size_t a = 0; a < own.size(); ++a) own[a] = own[a] && scoring.candidates()[a].family == family;
  while (std::ssize(set) < largest_set) {
    const std::size_t before = set.size();
    for (const Scoring::Move& move : scoring.additions(set, own)) {
      if (move.score == impossible || scoring.score(with(set, move.candidate)) == impossible) continue;
      set = with(set, move.candidate);
      break;
    }
    if (set.size() == before) break;
  }
  return set;
}

}  // namespace

Explained best_set(const Scoring& scoring, const std::vector<bool>& allowed, const Set& start, int largest_set) {
  constexpr std::size_t families_tried = 4;
  std::vector<Set> starts = {{}};
  if (!start.empty()) starts.push_back(filtered(start, [&](std::size_t a) { return allowed[a]; }));
  std::vector<std::string> tried;
  for (const Scoring::Move& move : scoring.additions({}, allowed)) {
    if (tried.size() >= families_tried) break;
    const std::string& family = scoring.candidates()[move.candidate].family;
    if (std::ranges::find(tried, family) != tried.end()) continue;
    if (scoring.score({move.candidate}) == impossible) continue;
    tried.push_back(family);
    starts.push_back({move.candidate});
    starts.push_back(whole_family(scoring, allowed, family, largest_set));
  }
  Explained best{{}, scoring.score({})};
  std::set<Set> seen;
  for (const Set& first : starts) {
    const double score = scoring.score(first);
    if (score == impossible) continue;
    const Explained found = improve(scoring, allowed, {first, score}, largest_set, seen);
    if (found.score < best.score - smallest_improvement) best = found;
  }
  return best;
}

namespace {

struct Suspect {
  std::size_t sample = 0;
  double score = impossible;
};

Suspect worst_sample(const Scoring& scoring, const SetFit& fit, const Set& set) {
  const Scoring::Deletion deletion = scoring.deletion(fit);
  Eigen::Index sample = 0;
  const double gain = deletion.gains.maxCoeff(&sample);
  return {static_cast<std::size_t>(sample),
          scoring.misfit(std::max(0.0, fit.left - gain), std::ssize(fit.columns) + scoring.workspace().components()) +
              scoring.cost(set) + scoring.outlier_cost()};
}

}  // namespace

std::vector<std::size_t> competing_outliers(const Workspace& workspace, const std::vector<EffectCandidate>& candidates,
                                            int largest_set, std::size_t largest) {
  Workspace current = workspace;
  const std::vector<bool> all(candidates.size(), true);
  Set set;
  while (current.dropped().size() < largest) {
    const Scoring scoring(current, candidates);
    const double score = scoring.score(set);
    if (score == impossible) {
      // Without the dropped samples its candidates depend on each other.
      if (set.empty()) break;
      set.clear();
      continue;
    }
    const Suspect suspect = worst_sample(scoring, scoring.fit(set), set);
    const Explained grown =
        std::ssize(set) < largest_set ? best_addition(scoring, set, all, std::min(score, suspect.score)) : Explained{};
    if (grown.score < impossible) {
      set = grown.set;
    } else if (suspect.score < score - smallest_improvement) {
      current.drop({suspect.sample});
    } else {
      break;
    }
  }
  return current.dropped();
}

std::vector<std::size_t> outliers_given(const Workspace& workspace, const std::vector<EffectCandidate>& candidates,
                                        const Set& set, std::size_t largest) {
  Workspace current = workspace;
  while (current.dropped().size() < largest) {
    const Scoring scoring(current, candidates);
    const SetFit fit = scoring.fit(set);
    if (!fit.solvable) break;
    const Suspect suspect = worst_sample(scoring, fit, set);
    if (suspect.score >= scoring.misfit(fit.left, std::ssize(fit.columns)) + scoring.cost(set)) break;
    current.drop({suspect.sample});
  }
  return current.dropped();
}

}  // namespace llmt::discovery
