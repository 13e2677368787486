#include "selection/screening.hpp"

#include <algorithm>
#include <cmath>
#include <map>

#include "selection/fold_errors.hpp"

namespace llmt {
namespace {

// Widths that go on to all folds, and for which jumps are tried.
constexpr std::size_t finalists = 2;

// Candidates of each finalist that are compared on all folds, whatever their leaf count.
constexpr std::size_t candidates_on_all_folds = 3;

// Shrinkage in screening, in rows; the nearest of the candidates.
constexpr double screened_shrinkage = 0.1;

// Leaves are no longer added to a (width, jump) pair after this number of larger leaf counts without improvement.
constexpr std::size_t steps_without_gain = 2;

// Held-out rows that are enough to tell good candidates from bad ones.
constexpr Eigen::Index screening_rows = 1000;

// Largest leaf count of each form: where in some fold two steps brought nothing. The best of ever more leaves would
// often be best by chance.
std::map<std::size_t, std::size_t> last_counts(const std::map<Key, std::vector<double>>& all, std::size_t folds) {
  std::map<std::size_t, std::size_t> last;
  for (std::size_t fold = 0; fold < folds; ++fold) {
    std::map<std::size_t, std::pair<double, std::size_t>> best;  // of each form: error, leaf count
    for (const auto& [key, errors] : all) {
      const auto [entry, is_new] = best.try_emplace(key.form, errors[fold], key.leaves);
      if (errors[fold] < entry->second.first && key.leaves <= entry->second.second + steps_without_gain) {
        entry->second = {errors[fold], key.leaves};
      }
    }
    for (const auto& [form, entry] : best) {
      const auto [count, is_new] = last.try_emplace(form, entry.second + steps_without_gain);
      count->second = std::min(count->second, entry.second + steps_without_gain);
    }
  }
  return last;
}

std::size_t form_of(const Key& key) { return key.form; }

// Number of folds on which candidates are screened.
std::size_t screening_folds(const std::vector<FoldRows>& folds) {
  std::size_t screening = 0;
  for (Eigen::Index rows = 0; screening < folds.size() && rows < screening_rows; ++screening) {
    rows += folds[screening].held_out.count();
  }
  return screening;
}

class Screening {
 public:
  Screening(HeldOutErrors& comparison, const Candidates& candidates, Eigen::Index coefficients,
            const std::vector<FoldRows>& folds)
      : comparison_(comparison),
        candidates_(candidates),
        counts_(comparison.leaf_counts()),
        coefficients_(coefficients),
        screening_(screening_folds(folds)),
        folds_(folds.size()),
        ridges_(std::max<std::size_t>(candidates.ridges.size(), 1)) {}

  std::set<Key> run() {
    screen();
    refine();
    return compare_on_all_folds();
  }

 private:
  // Ridge and sparseness of the forms that are still in the race.
  using Race = std::map<std::size_t, std::pair<std::size_t, std::size_t>>;

  bool has_jumps(std::size_t form) const { return comparison_.forms()[form].jump < comparison_.forms().front().jump; }
  double width_of(const Key& key) const { return comparison_.forms()[key.form].width; }
  // The shrinkage with which blends are screened: larger ones favour small trees.
  std::size_t usual_shrinkage() const {
    const auto apart = [](double shrinkage) {
      return std::abs(std::log(std::max(shrinkage, 1e-3) / screened_shrinkage));
    };
    return std::ranges::min_element(candidates_.shrinkages, {}, apart) - candidates_.shrinkages.begin();
  }

  // Compares every width with few leaves, with jumps the best two of them; with the best jump threshold all of them if
  // it is better than none. Then the better half of these forms with three times the unknowns, and so on while that
  // helps.
  void screen() {
    Race race;
    for (std::size_t form = 0; form < comparison_.forms().size(); ++form) {
      if (!has_jumps(form)) race[form] = {ridges_ / 2, 0};
    }
    std::size_t next = 0;
    for (Eigen::Index unknowns = cheap_unknowns; next < counts_.size() && !race.empty(); unknowns *= next_unknowns) {
      const std::size_t begin = next;
      while (next < counts_.size() && counts_[next] * coefficients_ <= unknowns) ++next;
      if (next == begin) continue;
      evaluate_counts(race, begin, next, begin == 0);
      if (begin == 0) {
        race = with_jumps(race);
        evaluate_counts(race, begin, next, true);
        const Race same = with_best_jump();
        evaluate_counts(same, begin, next, false);
        race.insert(same.begin(), same.end());
      }
      race = better_half(race, next);
    }
  }

  // Leaf counts begin ... end - 1 of the forms in the race, with the best ridges so far or all of them.
  void evaluate_counts(const Race& race, std::size_t begin, std::size_t end, bool all_ridges) {
    std::set<Key> keys;
    for (std::size_t leaves = begin; leaves < end; ++leaves) {
      for (const auto& [form, best] : race) {
        for (std::size_t ridge = 0; ridge < ridges_; ++ridge) {
          for (std::size_t sparse = 0; sparse < candidates_.sparse.size(); ++sparse) {
            if (all_ridges || std::pair(ridge, sparse) == best) {
              keys.insert({form, leaves, ridge, usual_shrinkage(), sparse});
            }
          }
        }
      }
    }
    comparison_.evaluate(keys, screening_);
  }

  // Adds the best widths with jumps.
  Race with_jumps(Race race) const {
    Ranked best = first_of_each(ranked(comparison_, screening_), form_of);
    for (const auto& [error, key] : best) race[key.form] = {key.ridge, key.sparse};
    best.resize(std::min(best.size(), finalists));
    for (std::size_t form = 0; form < comparison_.forms().size(); ++form) {
      for (const auto& [error, key] : best) {
        if (has_jumps(form) && comparison_.forms()[form].width == width_of(key)) {
          race[form] = {key.ridge, key.sparse};
        }
      }
    }
    return race;
  }

  // If jumps predict best: the same threshold with every width, for wider transitions pay where none crosses a jump.
  Race with_best_jump() const {
    const std::vector<BlendForm>& forms = comparison_.forms();
    const Key best = ranked(comparison_, screening_).front().second;
    Race race;
    for (std::size_t form = 0; form < forms.size() && has_jumps(best.form); ++form) {
      if (forms[form].jump == forms[best.form].jump) race[form] = {best.ridge, best.sparse};
    }
    return race;
  }

  // The better half of the forms in the race that are neither at their end nor clearly worse than the best.
  Race better_half(const Race& racing, std::size_t next) const {
    Ranked best = first_of_each(ranked(comparison_, screening_), form_of);
    std::erase_if(best, [&](const auto& entry) { return !racing.contains(entry.second.form); });
    best.resize(std::min(best.size(), std::max(fewest_forms, (best.size() + 1) / 2)));
    Race race;
    for (const auto& [error, key] : best) {
      if (key.leaves + steps_without_gain >= next && !is_clearly_worse(key, best.front().second, screening_)) {
        race[key.form] = {key.ridge, key.sparse};
      }
    }
    return race;
  }

  // The best two widths, each with its best jump and with none, without those that are clearly worse than the best.
  Ranked finalists_of() const {
    const Ranked of_form = first_of_each(ranked(comparison_, screening_), form_of);
    Ranked result = first_of_each(of_form, [this](const Key& key) { return width_of(key); });
    result.resize(std::min(result.size(), finalists));
    for (std::size_t k = result.size(); k-- > 0;) {
      const Key best = result[k].second;
      const auto smooth = std::ranges::find_if(of_form, [&](const auto& entry) {
        return width_of(entry.second) == width_of(best) && !has_jumps(entry.second.form);
      });
      if (has_jumps(best.form) && smooth != of_form.end()) result.push_back(*smooth);
    }
    const Key best = of_form.front().second;
    std::erase_if(result, [&](const auto& entry) { return is_clearly_worse(entry.second, best, screening_); });
    return result;
  }

  // Other ridges and shrinkages at the finalists' best leaf counts. With the unknowns of the first round of screening,
  // at the neighbouring leaf counts too; with those of the second round, the best of them there.
  void refine() {
    const Ranked last = finalists_of();
    std::set<Key> keys;
    for (const auto& [error, best] : last) {
      for (const std::size_t leaves : neighbours(best.leaves, unknowns_of(best) <= cheap_unknowns ? 1 : 0)) {
        add_regularisations(best, leaves, keys);
      }
    }
    comparison_.evaluate(keys, screening_);
    keys.clear();
    for (const auto& [error, best] : last) {
      if (!tries_all_pairs(best)) continue;
      for (const Key& key : best_of_form(best.form, candidates_on_all_folds)) {
        for (const std::size_t leaves : neighbours(best.leaves, key.leaves == best.leaves ? 1 : 0)) {
          keys.insert({key.form, leaves, key.ridge, key.shrinkage, key.sparse});
        }
      }
    }
    comparison_.evaluate(keys, screening_);
  }

  // All pairs of a ridge and a shrinkage; with many unknowns the neighbouring ridges, and all shrinkages.
  void add_regularisations(const Key& best, std::size_t leaves, std::set<Key>& keys) const {
    for (std::size_t ridge = 0; ridge < ridges_; ++ridge) {
      for (std::size_t shrinkage = 0; shrinkage < candidates_.shrinkages.size(); ++shrinkage) {
        const bool next_ridge = ridge + 1 >= best.ridge && ridge <= best.ridge + 1;
        if (tries_all_pairs(best) || (next_ridge && shrinkage == best.shrinkage) || ridge == best.ridge) {
          for (std::size_t sparse = 0; sparse < candidates_.sparse.size(); ++sparse) {
            keys.insert({best.form, leaves, ridge, shrinkage, sparse});
          }
        }
      }
    }
  }

  Eigen::Index unknowns_of(const Key& key) const { return counts_[key.leaves] * coefficients_; }
  bool tries_all_pairs(const Key& key) const { return unknowns_of(key) <= next_unknowns * cheap_unknowns; }

  std::vector<std::size_t> neighbours(std::size_t leaves, std::size_t reach) const {
    std::vector<std::size_t> result;
    for (std::size_t each = leaves - std::min(reach, leaves); each < std::min(counts_.size(), leaves + reach + 1);
         ++each) {
      result.push_back(each);
    }
    return result;
  }

  // The first few candidates of a form.
  std::vector<Key> best_of_form(std::size_t form, std::size_t count) const {
    std::vector<Key> best;
    for (const auto& [error, key] : ranked(comparison_, screening_)) {
      if (key.form == form && best.size() < count) best.push_back(key);
    }
    return best;
  }

  // For each finalist the best few candidates, and the best of each leaf count near its best, are compared on half of
  // the other folds. Those that are not clearly worse are then compared on all.
  std::set<Key> compare_on_all_folds() {
    std::set<Key> kept;
    for (const auto& [least, best] : finalists_of()) {
      const std::size_t reach = counts_[best.leaves] * coefficients_ <= cheap_unknowns ? 2 : 1;
      Ranked order = ranked(comparison_, screening_);
      // clang 14 lets no lambda have a name of a structured binding.
      std::erase_if(order, [form = best.form](const auto& entry) { return entry.second.form != form; });
      for (const auto& [error, key] : first_of_each(order, [](const Key& each) { return each.leaves; })) {
        if (key.leaves + reach >= best.leaves && key.leaves <= best.leaves + reach) kept.insert(key);
      }
      for (std::size_t k = 0; k < std::min(order.size(), candidates_on_all_folds); ++k) kept.insert(order[k].second);
    }
    kept = without_clearly_worse(kept, screening_);
    const std::size_t half = screening_ + (folds_ - screening_ + 1) / 2;
    if (half < folds_) {
      comparison_.evaluate(kept, half, true);
      kept = without_clearly_worse(kept, half);
    }
    comparison_.evaluate(kept, folds_, true);
    return kept;
  }

  // Only where candidates are costly: a few folds may all miss what happens in the next one.
  bool is_clearly_worse(const Key& key, const Key& best, std::size_t folds) const {
    return !tries_all_pairs(key) && comparison_.is_clearly_worse(key, best, folds);
  }

  // If a candidate with jumps stays, the best of its width without jumps stays too: jumps must gain on it beyond
  // chance.
  std::set<Key> without_clearly_worse(const std::set<Key>& keys, std::size_t folds) const {
    Ranked order = ranked(comparison_, folds);
    std::erase_if(order, [&](const auto& entry) { return !keys.contains(entry.second); });
    std::set<Key> left;
    for (const auto& [error, key] : order) {
      if (!is_clearly_worse(key, order.front().second, folds)) left.insert(key);
    }
    for (const Key& key : std::set<Key>(left)) {
      const auto smooth = std::ranges::find_if(order, [&](const auto& entry) {
        return width_of(entry.second) == width_of(key) && !has_jumps(entry.second.form);
      });
      if (has_jumps(key.form) && smooth != order.end()) left.insert(smooth->second);
    }
    return left;
  }

  HeldOutErrors& comparison_;
  const Candidates& candidates_;
  const std::vector<Eigen::Index>& counts_;
  Eigen::Index coefficients_;
  std::size_t screening_;
  std::size_t folds_;
  std::size_t ridges_;
};

}  // namespace

Ranked ranked(const HeldOutErrors& comparison, std::size_t folds) {
  const std::map<Key, std::vector<double>> all = comparison.errors(folds);
  std::map<std::size_t, std::size_t> last = last_counts(all, folds);
  Ranked order;
  for (const auto& [key, errors] : all) {
    if (key.leaves <= last[key.form]) order.emplace_back(sum_of(errors), key);
  }
  std::ranges::sort(order);
  return order;
}

std::set<Key> compare_in_steps(HeldOutErrors& comparison, const Candidates& candidates, Eigen::Index coefficients,
                               const std::vector<FoldRows>& folds) {
  return Screening(comparison, candidates, coefficients, folds).run();
}

}  // namespace llmt
