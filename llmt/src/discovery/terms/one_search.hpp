// One search with rows set aside.
#pragma once

#include <memory>
#include <set>
#include <vector>

#include "discovery/recording/row_split.hpp"
#include "discovery/terms/column_cache.hpp"
#include "llmt/discovery/missing.hpp"
#include "llmt/discovery/model_term.hpp"

namespace llmt::discovery {

/// The rows of a search.
struct SearchedRows {
  std::vector<bool> apart;                    ///< not searched, not set aside either
  Eigen::Index fewest_samples = 1000;         ///< that averaging rows in time may leave
  std::shared_ptr<ColumnCache> columns = {};  ///< of filtered rows
};

/// The rows that are searched and those set aside.
RowSplit split_of(const Recording& recording, const SearchedRows& searched, const MissingOptions& options);

/// Searches all terms but those refuted at all rows but those apart, and judges what it finds on the rows set aside.
Missing search_once(const Simulation& simulation, const Recording& recording, const MeasuredOutputs& measured,
                    const std::vector<ModelTerm>& terms, const SearchedRows& searched, const MissingOptions& options,
                    const std::set<std::size_t>& refuted);

}  // namespace llmt::discovery
