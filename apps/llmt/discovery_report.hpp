/// \file
/// What llmt discover found, for people and for programs.
#pragma once

#include <string>
#include <vector>

#include "llmt/discovery/simulation.hpp"
#include "shared/cli.hpp"

namespace llmt::apps {

/// Where an output's gap is large.
struct GapRegion {
  std::string output;
  std::string conditions;  ///< "a > 3.2 and b <= 1"
  Eigen::Index rows = 0;
  double mean_gap = 0.0;  ///< of |measured - simulated|
};

struct DiscoveryReport {
  std::string simulated;  ///< paths
  std::string measured;
  std::string corrected;  ///< written there; may be empty
  std::vector<std::string> inputs;
  std::uint64_t seed = 1;
  Eigen::Index rows = 0;
  discovery::Missing missing;
  std::vector<Eigen::Index> outlier_lines;  ///< of missing.outliers, in the file `measured`
  std::vector<GapRegion> regions;           ///< of each output by falling gap
};

/// Cuts the rows searched where the absolute deviation changes most, by a small tree.
std::vector<GapRegion> gap_regions(const discovery::Inputs& inputs, const discovery::MeasuredOutputs& measured,
                                   const discovery::Missing& missing);

void print_report(const DiscoveryReport& report);
Json report_json(const DiscoveryReport& report);

}  // namespace llmt::apps
