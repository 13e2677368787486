// Logs with more rows than a search can use.
#pragma once

#include <optional>
#include <vector>

#include "discovery/recording/recording.hpp"
#include "discovery/recording/samples.hpp"
#include "llmt/discovery/missing.hpp"

namespace llmt::discovery {

/// Means over few consecutive rows, in the place of the rows.
struct AveragedRows {
  Recording recording;
  MeasuredOutputs measured;
  Samples blocks;  ///< the rows of each mean
};

/// For rows in time (Inputs::instants) of which there are twice as many as `most` or more: means over as many rows as
/// leave `most` of them, but over no more than a twelfth of what split_in_time() would average. Within these no smooth
/// input changes by more than about 1.5 % of its standard deviation, so a term of the means is the mean of the term.
/// Nothing where that is one row.
std::optional<AveragedRows> averaged(const Recording& recording, const MeasuredOutputs& measured,
                                     const MissingOptions& options, Eigen::Index most = 50000);

/// Its outputs are means over the blocks of those that `simulation` has at the rows of `inputs`. Keeps references.
Simulation averaged(const Simulation& simulation, const Inputs& inputs, const Samples& blocks);

/// What was found in means, told of all rows: each of them stands where its mean does. Missing::corrected is that of
/// the rows; Missing::before is the nominal simulation of the rows and what the mean of the block differs from that.
Missing of_all_rows(Missing missing, const AveragedRows& few, const Simulation& simulation,
                    const std::vector<ModelTerm>& terms, const Recording& recording);

}  // namespace llmt::discovery
