/// \file
/// Options of a stream, and the counts that it keeps.
///
///     const llmt::StreamOptions options{.max_leaves = 20, .reservoir_rows = 5000};
///     llmt::Stream stream(inputs.cols(), outputs.cols(), options);
#pragma once

#include <Eigen/Core>
#include <type_traits>

#include "llmt/abi.hpp"
#include "llmt/options.hpp"

namespace llmt {

struct StreamOptions {
  /// Upper bound of the probability that a leaf whose rows follow one linear model with normal noise is ever split. The
  /// level of a single test is this divided by the number of candidate splits and shared out over the repeated tests.
  double significance = 0.05;
  /// Smallest decrease of the residual variance by a split, as a fraction of the variance of the output.
  double min_variance_gain = 0.0;
  Eigen::Index min_leaf_samples = 0;  ///< on either side of a split. 0: twice the coefficients of a local model
  /// Largest number of leaves of each tree, which bounds memory. 0: the number whose sums take about 64 MiB, within
  /// 16 ... 500; fewer where 16 leaves would take more than 1 GiB (about 100 inputs), 1 from about 250 inputs on.
  Eigen::Index max_leaves = 0;
  int bins = 16;  ///< bins of an input in a leaf, 4 ... 256
  /// A leaf's model is drawn to the model that its parent had when it was split, as if this many further rows of the
  /// leaf lay on it.
  double shrinkage = 0.1;
  /// Rows that are kept. One in eight is held out: these choose crisp or blended leaves and the leaf count of a
  /// snapshot. The others estimate blends. 0: a snapshot is the crisp tree as it stands.
  Eigen::Index reservoir_rows = 20000;

  bool operator==(const StreamOptions&) const = default;
};

/// Calls visit(name, member) for every option. `Options`: StreamOptions or const StreamOptions.
template <class Options, class Visitor>
requires std::is_same_v<std::remove_const_t<Options>, StreamOptions>
void for_each_field(Options& options, Visitor&& visit) {
  auto& [significance, min_variance_gain, min_leaf_samples, max_leaves, bins, shrinkage, reservoir_rows] = options;
  visit("significance", significance);
  visit("min_variance_gain", min_variance_gain);
  visit("min_leaf_samples", min_leaf_samples);
  visit("max_leaves", max_leaves);
  visit("bins", bins);
  visit("shrinkage", shrinkage);
  visit("reservoir_rows", reservoir_rows);
}

/// The options of a stream that is to learn as fit() would: min_leaf_samples, max_leaves, significance and one of
/// expert.shrinkages. FitOptions::validity is taken too, by Stream::snapshot(). Throws OptionRefused
/// (option_fields.hpp) for options that a stream does not take, and std::invalid_argument for several shrinkages.
StreamOptions stream_options(const FitOptions& options);

/// Counts of the rows, leaves and changes of a stream so far.
struct StreamCounts {
  Eigen::Index rows = 0;            ///< of positive weight
  Eigen::Index missing_values = 0;  ///< in the inputs
  Eigen::Index held_out = 0;        ///< rows in the reservoir that no tree has learned from
  Eigen::Index leaves = 0;          ///< of all trees
  Eigen::Index max_leaves = 0;      ///< of each tree, as used
  Eigen::Index splits = 0;
  Eigen::Index prunes = 0;        ///< splits taken back because recent rows do not need them
  Eigen::Index drifts = 0;        ///< alarms: branches whose errors rose abruptly and whose models restarted
  Eigen::Index replacements = 0;  ///< branches that a new one, grown from the alarm on, has replaced
  Eigen::Index bytes = 0;         ///< memory of sums, models and reservoir
};

}  // namespace llmt
