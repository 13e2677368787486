#include "selection/selection.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <optional>

#include "base/parallel.hpp"
#include "estimation/squared_errors.hpp"
#include "numerics/paired_difference.hpp"
#include "selection/crisp_trees.hpp"
#include "selection/held_out_errors.hpp"

namespace llmt {
namespace {

// Held-out rows that are enough to tell good candidates from bad ones, and how many of a fold are looked at.
constexpr Eigen::Index screening_rows = 1000;
constexpr Eigen::Index most_held_out_rows = 10000;

// Widths that go on to all folds.
constexpr std::size_t finalists = 2;

// Candidates of each finalist that are compared on all folds, whatever their leaf count.
constexpr std::size_t candidates_on_all_folds = 3;

// What is less simple has to be better by more than this many standard errors of the gain.
constexpr double standard_errors_of_a_gain = 2.0;

// Up to this many unknowns every ridge is tried with every leaf count; beyond, in screening, the best one so far.
constexpr Eigen::Index cheap_unknowns = 300;

// Leaves are no longer added to a (width, jump) pair after this number of larger leaf counts without improvement.
constexpr std::size_t steps_without_gain = 2;

// Each round of screening triples the unknowns and keeps the better half of the (width, jump) pairs, at least three.
constexpr Eigen::Index next_unknowns = 3;
constexpr std::size_t fewest_shapes = 3;

using Ranked = std::vector<std::pair<double, Key>>;

// Largest leaf count of each shape: where in some fold two steps brought nothing. The best of ever more leaves would
// often be best by chance.
std::map<std::size_t, std::size_t> last_counts(const std::map<Key, std::vector<double>>& all, std::size_t folds) {
  std::map<std::size_t, std::size_t> last;
  for (std::size_t fold = 0; fold < folds; ++fold) {
    std::map<std::size_t, std::pair<double, std::size_t>> best;  // of each shape: error, leaf count
    for (const auto& [key, errors] : all) {
      const auto [entry, is_new] = best.try_emplace(key.shape, errors[fold], key.leaves);
      if (errors[fold] < entry->second.first && key.leaves <= entry->second.second + steps_without_gain) {
        entry->second = {errors[fold], key.leaves};
      }
    }
    for (const auto& [shape, entry] : best) {
      const auto [count, is_new] = last.try_emplace(shape, entry.second + steps_without_gain);
      count->second = std::min(count->second, entry.second + steps_without_gain);
    }
  }
  return last;
}

// Best first; ties: the smaller key.
Ranked ranked(const HeldOutErrors& comparison, std::size_t folds) {
  const std::map<Key, std::vector<double>> all = comparison.errors(folds);
  std::map<std::size_t, std::size_t> last = last_counts(all, folds);
  Ranked order;
  for (const auto& [key, errors] : all) {
    if (key.leaves <= last[key.shape]) {
      order.emplace_back(sum_of(errors), key);
    }
  }
  std::ranges::sort(order);
  return order;
}

// The first of each kind, a kind being what `kind_of` makes of a key.
template <class KindOf>
Ranked first_of_each(Ranked order, const KindOf& kind_of) {
  std::set<decltype(kind_of(order.front().second))> seen;
  Ranked firsts;
  for (const auto& entry : order) {
    if (seen.insert(kind_of(entry.second)).second) {
      firsts.push_back(entry);
    }
  }
  return firsts;
}

// Compares every (width, jump) pair with few leaves, then the better half with three times the unknowns, and so on
// while that helps.
void screen(HeldOutErrors& comparison, const Candidates& candidates, Eigen::Index coefficients, std::size_t folds) {
  const std::vector<Eigen::Index>& counts = comparison.leaf_counts();
  const std::size_t usual = candidates.shrinkages.size() / 2;
  const std::size_t ridges = std::max<std::size_t>(candidates.ridges.size(), 1);
  // Ridge and sparseness of those still in the race.
  std::map<std::size_t, std::pair<std::size_t, std::size_t>> best_of_shape;
  for (std::size_t shape = 0; shape < comparison.shapes().size(); ++shape) {
    best_of_shape[shape] = {ridges / 2, 0};
  }
  std::size_t next = 0;
  for (Eigen::Index unknowns = cheap_unknowns; next < counts.size() && !best_of_shape.empty();
       unknowns *= next_unknowns) {
    std::set<Key> keys;
    std::size_t end = next;
    for (; end < counts.size() && (counts[end] * coefficients <= unknowns); ++end) {
      for (const auto& [shape, best] : best_of_shape) {
        for (std::size_t r = 0; r < ridges; ++r) {
          for (std::size_t s = 0; s < candidates.sparse.size(); ++s) {
            if (std::pair(r, s) == best || unknowns == cheap_unknowns) {
              keys.insert({shape, end, r, usual, s});
            }
          }
        }
      }
    }
    if (end == next) continue;
    next = end;
    comparison.evaluate(keys, folds);
    // The better half of those in the race. One at its end goes no further.
    const auto racing = std::move(best_of_shape);
    best_of_shape.clear();
    Ranked best = first_of_each(ranked(comparison, folds), [](const Key& key) { return key.shape; });
    std::erase_if(best, [&](const auto& entry) { return !racing.contains(entry.second.shape); });
    best.resize(std::min(best.size(), std::max(fewest_shapes, (best.size() + 1) / 2)));
    for (const auto& [error, key] : best) {
      if (key.leaves + steps_without_gain >= next) {
        best_of_shape[key.shape] = {key.ridge, key.sparse};
      }
    }
  }
}

// The best two widths, each with its best jump and with none.
Ranked finalists_of(const HeldOutErrors& comparison, std::size_t folds) {
  const std::vector<Shape>& shapes = comparison.shapes();
  const Ranked of_shape = first_of_each(ranked(comparison, folds), [](const Key& key) { return key.shape; });
  Ranked result = first_of_each(of_shape, [&](const Key& key) { return shapes[key.shape].width; });
  result.resize(std::min(result.size(), finalists));
  for (std::size_t k = result.size(); k-- > 0;) {
    for (const auto& entry : of_shape) {
      const Shape& shape = shapes[entry.second.shape];
      if (shape.width == shapes[result[k].second.shape].width && shape.jump == shapes.front().jump &&
          entry.second.shape != result[k].second.shape) {
        result.push_back(entry);
      }
    }
  }
  return result;
}

// Other ridges and shrinkages at the finalists' best leaf counts; where that is cheap, at its neighbours too.
void refine(HeldOutErrors& comparison, const Candidates& candidates, Eigen::Index coefficients, std::size_t folds) {
  const std::vector<Eigen::Index>& counts = comparison.leaf_counts();
  std::set<Key> keys;
  for (const auto& [error, best] : finalists_of(comparison, folds)) {
    const bool cheap = counts[best.leaves] * coefficients <= next_unknowns * cheap_unknowns;
    const std::size_t reach = cheap ? 1 : 0;
    for (std::size_t leaves = best.leaves - std::min(reach, best.leaves);
         leaves < std::min(counts.size(), best.leaves + reach + 1); ++leaves) {
      for (std::size_t ridge = 0; ridge < std::max<std::size_t>(candidates.ridges.size(), 1); ++ridge) {
        for (std::size_t shrinkage = 0; shrinkage < candidates.shrinkages.size(); ++shrinkage) {
          const bool next_ridge = ridge + 1 >= best.ridge && ridge <= best.ridge + 1;
          if (cheap || (next_ridge && shrinkage == best.shrinkage) || ridge == best.ridge) {
            for (std::size_t sparse = 0; sparse < candidates.sparse.size(); ++sparse) {
              keys.insert({best.shape, leaves, ridge, shrinkage, sparse});
            }
          }
        }
      }
    }
  }
  comparison.evaluate(keys, folds);
}

// On all folds: of each finalist the best few, and the best of each leaf count near its best.
std::set<Key> compare_on_all_folds(HeldOutErrors& comparison, Eigen::Index coefficients, std::size_t screening,
                                   std::size_t folds) {
  std::set<Key> kept;
  for (const auto& [least, best] : finalists_of(comparison, screening)) {
    const std::size_t reach = comparison.leaf_counts()[best.leaves] * coefficients <= cheap_unknowns ? 2 : 1;
    Ranked order = ranked(comparison, screening);
    // clang 14 lets no lambda have a name of a structured binding.
    std::erase_if(order, [shape = best.shape](const auto& entry) { return entry.second.shape != shape; });
    for (const auto& [error, key] : first_of_each(order, [](const Key& each) { return each.leaves; })) {
      if (key.leaves + reach >= best.leaves && key.leaves <= best.leaves + reach) {
        kept.insert(key);
      }
    }
    for (std::size_t k = 0; k < std::min(order.size(), candidates_on_all_folds); ++k) {
      kept.insert(order[k].second);
    }
  }
  comparison.evaluate(kept, folds);
  return kept;
}

// The best of each width: with jumps only if their gain on none is beyond chance.
std::vector<CandidateError> best_of_widths(const HeldOutErrors& comparison, const std::set<Key>& kept,
                                           const std::vector<FoldRows>& folds, const FoldErrors& error_of_folds) {
  const std::map<Key, std::vector<double>> errors = comparison.errors(folds.size());
  Ranked order = ranked(comparison, folds.size());
  std::erase_if(order, [&](const auto& entry) { return !kept.contains(entry.second); });
  std::vector<CandidateError> result;
  for (const auto& [error, key] : first_of_each(order, [](const Key& each) { return each.shape; })) {
    const CandidateError entry = error_of_folds(comparison.candidate(key), errors.at(key));
    const auto same = std::ranges::find_if(result, [&](const CandidateError& other) {
      return other.candidate.validity.width == entry.candidate.validity.width;
    });
    if (same == result.end()) {
      result.push_back(entry);
    } else if (entry.candidate.jump == no_jump && !is_beyond_chance(entry, *same)) {
      *same = entry;
    }
  }
  std::ranges::stable_sort(result, [](const auto& a, const auto& b) { return a.rmse < b.rmse; });
  return result;
}

// Candidates are told apart on samples of the training rows. Against a crisp tree, whose models all rows have made,
// the best blend is at a disadvantage then: it is made from all rows too, where one hold-out says that there are many.
Partition make_from_all_rows(const FoldRows& fold, const GrownTree& grown, const Eigen::VectorXd& weights,
                             int max_threads, const FoldErrors& error_of_folds, CandidateError& best) {
  Candidate candidate = best.candidate;
  candidate.leaves = std::min(candidate.leaves, grown.partition.num_leaves());
  Partition partition = estimate(fold.training, grown, candidate, max_threads);
  std::vector<int> all(fold.held_out.count());
  std::iota(all.begin(), all.end(), 0);
  const std::vector<Chunk> held_out = {fetch(fold.held_out, all, partition.outputs)};
  best = error_of_folds(best.candidate, {squared_error(partition, fold.training, held_out, weights)});
  return partition;
}

}  // namespace

bool is_beyond_chance(const CandidateError& simple, const CandidateError& other) {
  if (simple.fold_rmse.size() < 2) return other.rmse < simple.rmse;
  const PairedDifference gain = paired_difference(simple.fold_rmse, other.fold_rmse);
  return gain.mean > standard_errors_of_a_gain * gain.standard_error;
}

Selection select(const std::vector<FoldRows>& folds, const std::vector<GrownTree>& grown, const Candidates& candidates,
                 const Eigen::VectorXd& weights, int max_threads) {
  std::vector<FoldRows> compared;
  Selection selection;
  for (const FoldRows& fold : folds) {
    compared.push_back({fold.training, thinned(fold.held_out, most_held_out_rows)});
    selection.held_out_rows += compared.back().held_out.count();
  }
  const FoldErrors error_of_folds(compared, weights.size());
  compare_crisp(compared, grown, candidates, weights, max_threads, error_of_folds, selection);
  if (!candidates.widths.empty() && selection.crisp_rmse.size() > 1) {
    std::size_t screening = 0;
    for (Eigen::Index rows = 0; screening < compared.size() && rows < screening_rows; ++screening) {
      rows += compared[screening].held_out.count();
    }
    const Eigen::Index coefficients = std::ssize(compared.front().training.regressors) + 1;
    HeldOutErrors comparison(compared, grown, candidates, weights, max_threads);
    screen(comparison, candidates, coefficients, screening);
    refine(comparison, candidates, coefficients, screening);
    const std::set<Key> kept = compare_on_all_folds(comparison, coefficients, screening, compared.size());
    std::vector<CandidateError> best = best_of_widths(comparison, kept, compared, error_of_folds);
    std::optional<Partition> made;
    if (compared.size() == 1 && !best.empty()) {
      made = make_from_all_rows(compared.front(), grown.front(), weights, max_threads, error_of_folds, best.front());
    }
    selection.best_of_kind.insert(selection.best_of_kind.end(), best.begin(), best.end());
    if (!candidates.crisp) {
      selection.chosen.rmse = std::numeric_limits<double>::infinity();  // least squares is no candidate
    }
    for (const CandidateError& other : best) {
      selection.chosen =
          other.candidate.jump == no_jump && other.rmse < selection.chosen.rmse ? other : selection.chosen;
    }
    for (const CandidateError& other : best) {
      const bool is_only_one = !std::isfinite(selection.chosen.rmse);
      if (other.candidate.jump < no_jump && (is_only_one || is_beyond_chance(selection.chosen, other))) {
        selection.chosen = other;
      }
    }
    if (made && !best.empty() && selection.chosen.rmse == best.front().rmse) {
      selection.made.push_back(std::move(*made));
    }
  }
  // The best of many candidates gains a little on noise too.
  const CandidateError& least_squares = selection.best_of_kind.front();
  if (candidates.crisp && compared.size() > 1 && !is_beyond_chance(least_squares, selection.chosen)) {
    selection.chosen = least_squares;
  }
  return selection;
}

}  // namespace llmt
