/// \file
/// Boosting: a sum of many small local linear model trees, each fitted to what the trees before it leave. More accurate
/// than one tree where the truth has many steps; nobody reads it. docs/algorithms/boosting.md has the equations.
///
///     const llmt::BoostResult result = llmt::fit_boosted({inputs, outputs});
///     const double error = result.summaries[0].rmse;   // on held-out rows
///     llmt::save(result.model, "model.json");
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <string>
#include <type_traits>
#include <vector>

#include "llmt/abi.hpp"
#include "llmt/boosted_model.hpp"
#include "llmt/progress.hpp"
#include "llmt/training_data.hpp"

namespace llmt {

/// Rows that differ, which fit_boosted() needs.
inline constexpr Eigen::Index fewest_boosted_rows = 10;

/// Levels of a categorical input that have features of their own in fit_boosted(), the most frequent ones; the others
/// are told from these, not from each other. With more than 800 000 rows there are 200 000 000 / rows of them, but at
/// least 50: each takes 7 bytes a row.
inline constexpr int most_boosted_levels = 255;

/// Of BoostOptions::seeds.
inline constexpr int most_seeds = 100;

struct BoostOptions {
  /// Factor on every tree. 0: 0.1 where the trees are soft, else that of the table at fit_boosted().
  double rate = 0.0;
  int max_rounds = 2000;     ///< trees of an output at most, before the sum is fitted to all rows
  std::uint64_t seed = 1;    ///< of the rows that are held out, and of the features that a split looks at
  int seeds = 1;             ///< the sum is the mean of this many, whose splits look at other features each
  int max_threads = 0;       ///< 0: all that the machine has. The result does not depend on it
  bool mean_of_few = false;  ///< of fewer than `fewest_boosted_rows` different rows: their mean, in place of an error
};

/// Calls visit(name, member) for every option. `Options`: BoostOptions or const BoostOptions.
template <class Options, class Visitor>
requires std::is_same_v<std::remove_const_t<Options>, BoostOptions>
void for_each_field(Options& options, Visitor&& visit) {
  auto& [rate, max_rounds, seed, seeds, max_threads, mean_of_few] = options;
  visit("rate", rate);
  visit("max_rounds", max_rounds);
  visit("seed", seed);
  visit("seeds", seeds);
  visit("max_threads", max_threads);
  visit("mean_of_few", mean_of_few);
}

/// A variant of the trees that was compared on held-out rows: with all its trees, or in a race after 50 rounds, of
/// fewer than 5000 rows on all fifths. If one tree is tried after a race, the sum with all its trees, on the rows that
/// stopped it, and the one tree come last.
struct BoostVariant {
  std::string name;  ///< "symmetric", "free", "symmetric with constants", "soft with pairs", "one tree", ...
  double rmse = 0.0;
  double share = 0.0;  ///< of the sum
};

/// How the sum of one output was made.
struct BoostSummary {
  Eigen::Index rows = 0;               ///< that the sum is fitted to; equal rows count once
  Eigen::Index held_out = 0;           ///< rows that `rmse` is of
  double rmse = 0.0;                   ///< on these, of the trees fitted without them, in the output's unit; or NaN
  double spread = 0.0;                 ///< standard deviation of the RMSE of the five parts of these rows; 0: one part
  std::string variant;                 ///< the one taken; "blend": a mean; "mean": see BoostOptions::mean_of_few
  std::vector<BoostVariant> compared;  ///< empty: symmetric trees, without a choice
  int seeds = 1;                       ///< BoostOptions::seeds
  Eigen::Index trees = 0;
  double train_rmse = 0.0;
};

struct BoostResult {
  BoostedModel model;
  std::vector<BoostSummary> summaries;  ///< one an output
};

/// Fits a sum of trees to each output.
///
/// The number of rows decides how. docs/algorithms/boosting.md explains the columns.
///
/// | rows from | rate | slopes | c | patience | held out | race | one tree | splits from |
/// | --- | --- | --- | --- | --- | --- | --- | --- | --- |
/// | 10 | 0.05 | 3 | 3 | 100 | each fifth in turn | no | RA, to 100 inputs | all rows |
/// | 500 | 0.05 | 3 | 3 | 200 | a fifth, then all | all fifths, directions | RA or RD, to 100 inputs | all rows |
/// | 5000 | 0.05 | 5 | 1 | 50 | a fifth | yes, directions | RA, to 32 inputs, 200 trees | all rows |
/// | 10 000 | 0.07 | 5 | 1 | 50 | a fifth | yes, directions | RA, to 32 inputs, 200 trees | all rows |
/// | 50 000 | 0.07 | 5 | 1 | 50 | a fifth | yes, directions | none | all rows |
/// | 100 001 | 0.1 | 5 | 1 | 50 | about 20 000 | yes | none | 250 000 rows |
///
/// Whole groups of rows are held out. The held-out rows decide which trees are taken and when boosting stops. Then the
/// sum is fitted to all rows with a quarter more trees, if more than a twentieth was held out. With
/// TrainingData::held_out these rows decide instead, and the sum of the other rows is the result. Where each fifth is
/// held out in turn, the sum is a weighted mean of two variants and one tree, as fit() makes it; its error is that of
/// the whole procedure, shares and number of trees chosen without the row. With more rows it is the mean of the sum and
/// such a tree where the tree alone is better than the sum on the held-out rows.
///
/// The mean of several seeds has the error of the mean: of each row that of trees fitted without it, so below 5000 rows
/// every seed holds out other rows, and with more all hold out the same ones. The race is that of the first seed.
///
/// BoostedModel::intervals() gives intervals, from the held-out rows' residuals and their spread.
///
/// Inputs may be missing (NaN). A category is taken as the indicators of its most frequent levels,
/// `most_boosted_levels` of them. Weights are as for fit(); a row of the weight k is k equal rows, to the byte. Up to
/// the values of the seed, the result does not depend on the scale of outputs and inputs, nor on the number of threads,
/// for which it is the same to the byte.
///
/// Throws std::invalid_argument as fit(), and for fewer than `fewest_boosted_rows` different rows.
BoostResult fit_boosted(const TrainingData& data, const BoostOptions& options = {}, const Progress& progress = {});

}  // namespace llmt
