/// \file
/// The table of what the numbers of rows and inputs decide in a sum of trees.
#pragma once

#include <Eigen/Core>
#include <array>
#include <limits>
#include <span>

#include "llmt/boosted.hpp"
#include "llmt/options.hpp"

namespace llmt {

inline constexpr Eigen::Index no_limit = std::numeric_limits<Eigen::Index>::max();
inline constexpr std::array by_ra = {GrowthRule::ra};
inline constexpr std::array by_ra_or_rd = {GrowthRule::ra, GrowthRule::rd};

/// On which held-out rows variants of the trees are compared after a few rounds.
enum class RaceRows {
  none,
  all_parts,     ///< of each part in turn: few rows
  the_held_out,  ///< those that stop the sum
};

/// One line of the table: how a sum of so many rows is fitted.
struct Regime {
  Eigen::Index rows = 0;                           ///< from so many rows on, up to the next regime
  double rate = 0.0;                               ///< RoundOptions::rate
  int slopes = 0;                                  ///< TreeOptions::slopes
  double ridge = 0.0;                              ///< of constants, in rows
  int patience = 0;                                ///< RoundOptions::patience
  bool takes_turns = false;                        ///< every fifth is held out in turn, and variants are averaged
  Eigen::Index held_out = 0;                       ///< about so many rows; 0: a fifth
  bool uses_all_parts = false;                     ///< the printed error is of all fifths, not of the one that chose
  RaceRows race = RaceRows::none;                  ///< on which rows variants are compared after a few rounds
  bool directions = false;                         ///< variants with directions are among them
  std::span<const GrowthRule> rules_of_tree = {};  ///< by which one tree beside the sum is tried; empty: by none
  Eigen::Index most_inputs_of_tree = 0;            ///< with more none is tried
  Eigen::Index most_rounds_of_tree = no_limit;     ///< and none if the sum has trees of more rounds
  Eigen::Index searched = no_limit;                ///< TreeOptions::searched
};

/// From so many rows on one hold-out decides. Of fewer rows it would decide by chance, so five decide together.
inline constexpr Eigen::Index enough_for_one_hold_out = 500;

/// docs/algorithms/boosting.md and llmt/boosted.hpp have the same table, and a test compares them. docs/benchmarks.md,
/// "Sums of trees", says on which data the numbers were chosen.
inline constexpr std::array<Regime, 6> regimes = {{
    {fewest_boosted_rows, 0.05, 3, 3.0, 100, true, 0, false, RaceRows::none, false, by_ra, 100},
    {enough_for_one_hold_out, 0.05, 3, 3.0, 200, false, 0, true, RaceRows::all_parts, true, by_ra_or_rd, 100},
    {5000, 0.05, 5, 1.0, 50, false, 0, false, RaceRows::the_held_out, true, by_ra, 32, 200},
    {10000, 0.07, 5, 1.0, 50, false, 0, false, RaceRows::the_held_out, true, by_ra, 32, 200},
    {50000, 0.07, 5, 1.0, 50, false, 0, false, RaceRows::the_held_out, true},
    {100001, 0.1, 5, 1.0, 50, false, 20000, false, RaceRows::the_held_out, false, {}, 0, 0, 250000},
}};

/// The regime of a table, without rules of a tree for too many inputs.
Regime regime_of(Eigen::Index rows, Eigen::Index inputs);

/// The depth of symmetric trees, (J.2) in docs/algorithms/boosting.md.
int depth_of(Eigen::Index rows);

/// How many parts the rows are dealt to, one of which is held out.
Eigen::Index num_parts_of(const Regime& regime, Eigen::Index rows);

/// How many of the rows that are not held out a race learns from: a quarter, but neither too few to tell the variants
/// apart nor more than it needs.
Eigen::Index raced_rows(Eigen::Index rows);

/// Whether so many rows were held out that a sum of all rows has more to learn than the sum that they stopped.
bool is_worth_refitting(Eigen::Index held_out, Eigen::Index rows);

}  // namespace llmt
