/// \file
/// The comparison of blends in steps, docs/algorithms/selection.md.
#pragma once

#include <set>
#include <utility>
#include <vector>

#include "selection/held_out_errors.hpp"

namespace llmt {

/// Unknowns of the first round of screening, in which every ridge is tried; where no candidate has so few, in the first
/// round that has one. Each round triples the unknowns and keeps the better half of the forms, at least three.
inline constexpr Eigen::Index cheap_unknowns = 300;
inline constexpr Eigen::Index next_unknowns = 3;
inline constexpr std::size_t fewest_forms = 3;

/// Candidates and the sums of their squared errors, the best first. Ties: the smaller key.
using Ranked = std::vector<std::pair<double, Key>>;

/// The candidates that the first `folds` folds have compared, but for leaf counts beyond those that helped.
Ranked ranked(const HeldOutErrors& comparison, std::size_t folds);

/// The first of each kind, a kind being what `kind_of` makes of a key.
template <class KindOf>
Ranked first_of_each(const Ranked& order, const KindOf& kind_of) {
  std::set<decltype(kind_of(order.front().second))> seen;
  Ranked firsts;
  for (const auto& entry : order) {
    if (seen.insert(kind_of(entry.second)).second) firsts.push_back(entry);
  }
  return firsts;
}

/// Compares the candidates on the first few folds, and the best of them on all folds: returns these.
/// `coefficients`: of a local model.
std::set<Key> compare_in_steps(HeldOutErrors& comparison, const Candidates& candidates, Eigen::Index coefficients,
                               const std::vector<FoldRows>& folds);

}  // namespace llmt
