// Which rows are searched, which are set aside, and what counts as one observation.
#pragma once

#include <vector>

#include "discovery/recording/recording.hpp"
#include "discovery/recording/samples.hpp"
#include "llmt/discovery/missing.hpp"

namespace llmt::discovery {

struct RowSplit {
  Samples searched;
  Samples held_out;
  std::vector<Eigen::Index> repeats;    ///< of the searched samples: equal numbers for equal inputs; empty in time
  std::vector<Eigen::Index> stretches;  ///< of the searched samples in time: neighbours in a stretch follow each other
  Eigen::Index rows_per_sample = 1;
  double step = 0.0;  ///< median time between rows
  /// Of filtered rows: the weights of the filter of the measured outputs. Next to nothing of a row that does not count
  /// may be in a sample.
  Eigen::VectorXd reach = {};
};

/// A row is a sample. Rows of equal inputs, the order aside, keep together.
RowSplit split_independent(const Inputs& inputs, const MissingOptions& options);

/// For rows in time (Inputs::instants). Set aside are whole runs where there are at least four; else stretches of
/// consecutive rows. A sample is the mean over a block of consecutive rows, as long as the inputs bear: the longest
/// block within which every smooth input varies by at most 3 % of its variance, its noise not counted.
RowSplit split_in_time(const Recording& recording, const MissingOptions& options, Eigen::Index fewest_samples);

/// The longest block, of those that leave at least largest_sample of them, that the inputs bear, as in split_in_time();
/// 1 where fewer than half of the inputs are smooth.
Eigen::Index bearable_block(const Recording& recording, const MissingOptions& options);

/// Blocks of `length` consecutive rows or a little more, each within one stretch of a recording.
Samples blocks_in_time(const Recording& recording, Eigen::Index length);

/// Whether rows follow each other as those of a log do.
enum class AlongRows {
  independent,     ///< most inputs that vary jump from row to row
  smooth,          ///< most inputs are smooth along the rows
  measured_signal  ///< smooth, and with noise, or with more rows than a search takes: a log
};
AlongRows along_rows(const Inputs& inputs, const MissingOptions& options);

/// The split without the rows set apart. A sample keeps those of its rows that are left, if half of them are.
RowSplit without_rows(const RowSplit& split, const std::vector<bool>& apart);

}  // namespace llmt::discovery
