/// \file
/// The terms that a simulation lacks, as text and as JSON.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "llmt/discovery/simulation.hpp"
#include "report/text/json.hpp"
#include "report/text/text.hpp"

namespace llmt::report {

/// Where an output's gap is large.
struct GapRegion {
  std::string output;
  std::string conditions;  ///< "a > 3.2 and b <= 1"
  Eigen::Index rows = 0;
  double mean_gap = 0.0;  ///< of |measured - simulated|
};

/// The values of an input.
struct InputRange {
  double low = 0.0;
  double high = 0.0;
};

/// One for each input.
std::vector<InputRange> ranges_of(const discovery::Inputs& inputs);

/// What was compared and what was found.
struct TermsSummary {
  std::string simulated;  ///< names of the tables
  std::string measured;
  std::string corrected;  ///< the file that the corrected simulation was written to; may be empty
  std::vector<std::string> inputs;
  std::uint64_t seed = 1;
  Eigen::Index rows = 0;
  discovery::Missing missing;
  std::vector<Eigen::Index> outlier_lines;        ///< of missing.outliers, in the file `measured`
  std::vector<GapRegion> regions;                 ///< of each output by falling gap
  std::vector<InputRange> ranges = {};            ///< of the inputs, in their order
  std::string order = "";                         ///< discovery::Inputs::order
  std::vector<std::string> without_nominal = {};  ///< parameters of which only the change is known
  std::string counted = "line";                   ///< what `outlier_lines` are: lines of a file, or rows of a table
  std::vector<Eigen::Index> failing_lines = {};   ///< of missing.failing_rows, as `outlier_lines`
  std::string time = {};                          ///< column with the instants; may be empty
  std::string group = {};                         ///< column with the runs; may be empty
};

/// The library's terms: standard_terms(), then inner_state_terms().
std::vector<discovery::ModelTerm> library_terms(const discovery::Inputs& inputs, const Eigen::MatrixXd& simulated,
                                                const std::vector<std::string>& outputs,
                                                std::vector<discovery::UntestableCause>& untestable);

/// The user's own terms, then those of the library that are not the same as one of them. `own_only`: of the library,
/// only the generic ones.
std::vector<discovery::ModelTerm> with_own_terms(std::vector<discovery::ModelTerm> library,
                                                 std::vector<discovery::ModelTerm> own, bool own_only,
                                                 const discovery::Rows& rows);

/// Cuts the rows searched where the absolute deviation changes most, by a small tree.
std::vector<GapRegion> gap_regions(const discovery::Inputs& inputs, const discovery::MeasuredOutputs& measured,
                                   const discovery::Missing& missing);

/// Verdict, terms, gaps, and what could not be tested. `width`: of tables.
std::string terms_text(const TermsSummary& summary, std::size_t width = no_width_limit);
Json terms_json(const TermsSummary& summary);

}  // namespace llmt::report
