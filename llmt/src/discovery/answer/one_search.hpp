// A search with rows set aside, and the last fit to all of them.
#pragma once

#include <memory>
#include <set>
#include <vector>

#include "discovery/answer/term_fit.hpp"
#include "discovery/recording/row_split.hpp"
#include "discovery/terms/term_model.hpp"
#include "llmt/discovery/missing.hpp"

namespace llmt::discovery {

/// The rows of a search.
struct SearchedRows {
  std::vector<bool> apart = {};               ///< not searched, not set aside either
  Eigen::VectorXd bands_of_rest = {};         ///< p, or empty: rows with an input within its band are apart, at rest
  Eigen::Index fewest_samples = 1000;         ///< that averaging rows in time may leave
  std::shared_ptr<ColumnCache> columns = {};  ///< of filtered rows
};

/// The rows that are searched and those set aside.
RowSplit split_of(const Recording& recording, const SearchedRows& searched, const MissingOptions& options);

/// With nothing set aside.
RowSplit split_of_all(const Recording& recording, const SearchedRows& searched, MissingOptions options);

/// Searches all terms but those refuted at all rows but those apart, and judges what it finds on the rows set aside.
Missing search_once(const Simulation& simulation, const Recording& recording, const MeasuredOutputs& measured,
                    const std::vector<ModelTerm>& terms, const SearchedRows& searched, const MissingOptions& options,
                    const std::set<std::size_t>& refuted);

/// What was found, fitted again on the rows searched and those set aside together: coefficients, constants, parameters,
/// their standard errors, Missing::before and corrected. The answer, what is confirmed and the errors on the rows set
/// aside stay those of the search. Outliers and rows apart are left out.
void fit_on_all_rows(const Simulation& simulation, const Recording& recording, const MeasuredOutputs& measured,
                     const std::vector<ModelTerm>& terms, const SearchedRows& rows, const MissingOptions& options,
                     Missing& missing);

/// Rows at rest are not fitted, because friction may be anything there, and so a threshold within the band of rest of
/// its input is not determined by those that are. It is placed where the sum over all rows of the band
///
///     sum min((measured - predicted)^2 / noise floor^2, 9)
///
/// is least, of 41 places, unless what is gained over the place that was fitted, times the share of the rows that are
/// independent, is less than ln m, the cost of a number. `independent`: m, the number of independent samples.
void place_thresholds_at_rest(const TermModel& model, const MeasuredOutputs& measured, const SearchedRows& searched,
                              const Missing& missing, double independent, TermFit& fit);

/// For each term found that is a cause, the other terms of the library that explain as much in its place: beside
/// everything else that was fitted, they leave squares S' for S with
///
///     phi N / 2 ln(S'/S) + (k' - k) / 2 ln(phi N) <= 3,
///
/// k and k' the numbers fitted in each; but not those of more numbers that are within a fiftieth the same, which
/// contain it. The eight likeliest become its rivals; those that are already are not repeated. Where one differs from
/// it by more than a tenth of what it adds, rows cannot tell which function it is: the term is tentative, and a
/// sentence says where the two differ most.
void name_groups(const TermModel& model, const TermData& data, const TermFit& fit, Missing& missing);

}  // namespace llmt::discovery
