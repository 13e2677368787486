/// \file
/// Models that are compared, and how one of them is estimated and judged.
#pragma once

#include <Eigen/Core>
#include <string>
#include <vector>

#include "dynamics/windows.hpp"
#include "llmt/fit_dynamic.hpp"
#include "llmt/series.hpp"

namespace llmt {

/// What the rest of a candidate is.
enum class RestKind { none, tree, readable, sum };

struct ModelStructure {
  Lags lags = {};
  int degree = 1;
  bool is_held = true;
  double ridge = 0.0;
  RestKind rest = RestKind::none;
  GrowthRule rule = GrowthRule::hilomot;
  Eigen::Index leaves = 1;
  bool is_quadratic = false;
  bool has_stops = false;
  bool on_runs = false;  ///< estimated on simulated records

  bool is_linear() const { return degree == 1 && rest == RestKind::none; }
};

/// "polynomial of degree 2 and HILOMOT tree of 3 leaves, estimated on runs".
std::string description_of(const ModelStructure& candidate);

/// What all candidates have in common.
struct Task {
  const Series& series;
  std::vector<Signal> inputs;   ///< with ranges
  std::vector<Signal> outputs;  ///< with ranges and, for candidates that have them, stops
  Eigen::VectorXd scale;        ///< standard deviation of each output
  Eigen::VectorXd step_scale;   ///< of the changes of each output from row to row
  Eigen::Index horizon = 0;
  int max_threads = 0;
};

Task task_of(const Series& series, const DynamicOptions& options);

/// The candidate learned from stretches; `iterations` at most on runs. Infinite parameters never occur: where nothing
/// could be estimated, on_runs leaves the least-squares estimate.
DynamicParts estimate(const Task& task, const ModelStructure& candidate, const std::vector<Stretch>& stretches,
                      int iterations);

/// The same by least squares of the next row, from some rows of the series alone.
DynamicParts estimate_rows(const Task& task, const ModelStructure& candidate, const RegressorRows& rows);

/// Sums over held-out runs.
struct Judged {
  Eigen::VectorXd squares;  ///< one an output
  double rows = 0.0;
  Eigen::Index runs = 0;
  Eigen::Index diverged = 0;
  double one_step = 0.0;  ///< sum of squares of predictions of the next row, in units of the scales

  Judged& operator+=(const Judged& other);
};

/// Runs over windows; a row from which on a run has left its bounds counts with the upper bound as its prediction.
Judged judge_runs(const DynamicParts& parts, const Series& series, const std::vector<Window>& windows);

/// Runs of the model over stretches, begun by its longest lag of measured rows.
Judged judge(const Task& task, const DynamicParts& parts, const std::vector<Stretch>& stretches);

/// Root mean square in units of the scales.
double error_of(const Task& task, const Judged& judged);

}  // namespace llmt
