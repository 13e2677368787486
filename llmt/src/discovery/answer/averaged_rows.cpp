#include "discovery/answer/averaged_rows.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "discovery/recording/row_split.hpp"
#include "discovery/terms/term_model.hpp"

namespace llmt::discovery {
namespace {

std::vector<Eigen::Index> rows_of_all(const std::vector<Eigen::Index>& chosen, const Samples& blocks) {
  std::vector<Eigen::Index> rows;
  for (const Eigen::Index block : chosen) {
    const auto own = blocks.rows_of(block);
    rows.insert(rows.end(), own.begin(), own.end());
  }
  return rows;
}

// Rows of a block have the value of its mean.
Eigen::MatrixXd spread_out(const Eigen::MatrixXd& of_blocks, const Samples& blocks, Eigen::Index rows) {
  Eigen::MatrixXd values(rows, of_blocks.cols());
  for (Eigen::Index b = 0; b < blocks.size(); ++b) {
    for (const Eigen::Index row : blocks.rows_of(b)) values.row(row) = of_blocks.row(b);
  }
  return values;
}

}  // namespace

std::optional<AveragedRows> averaged(const Recording& recording, const MeasuredOutputs& measured,
                                     const MissingOptions& options, Eigen::Index most) {
  const Inputs& inputs = recording.inputs();
  const Eigen::Index n = inputs.values.rows();
  if (!recording.is_in_time() || recording.is_filtered() || n < 2 * most) return std::nullopt;
  constexpr Eigen::Index share_of_a_sample = 12;
  const Eigen::Index length = std::min(n / most, bearable_block(recording, options) / share_of_a_sample);
  if (length < 2) return std::nullopt;
  Samples blocks = blocks_in_time(recording, length);
  Inputs of_means = inputs;
  of_means.values = means(inputs.values, blocks);
  of_means.instants = means(inputs.instants, blocks);
  of_means.noise /= std::sqrt(static_cast<double>(length));
  of_means.runs.clear();
  for (Eigen::Index b = 0; b < blocks.size() && !inputs.runs.empty(); ++b) {
    of_means.runs.push_back(inputs.runs[blocks.rows_of(b).front()]);
  }
  MeasuredOutputs outputs = measured;
  outputs.values = means(measured.values, blocks);
  outputs.noise /= std::sqrt(static_cast<double>(length));
  return AveragedRows{Recording(std::move(of_means)), std::move(outputs), std::move(blocks)};
}

Simulation averaged(const Simulation& simulation, const Inputs& inputs, const Samples& blocks) {
  Simulation of_means = simulation;
  of_means.predict = [&](const Eigen::MatrixXd&, const Eigen::VectorXd& values) -> Eigen::MatrixXd {
    return means(simulation.predict(inputs.values, values), blocks);
  };
  return of_means;
}

Missing of_all_rows(Missing missing, const AveragedRows& few, const Simulation& simulation,
                    const std::vector<ModelTerm>& terms, const Recording& recording) {
  const Eigen::MatrixXd& inputs = recording.inputs().values;
  const Eigen::Index n = inputs.rows();
  const Samples& blocks = few.blocks;
  const Eigen::MatrixXd simulated = simulation.predict(inputs, values_of(simulation.parameters));
  missing.before = simulated + spread_out(missing.before - means(simulated, blocks), blocks, n);
  missing.corrected = with_found_terms(simulation, missing, terms, recording);
  if (missing.change_by_smoothing.size() > 0) {
    missing.change_by_smoothing = spread_out(missing.change_by_smoothing, blocks, n);
  }
  std::vector<Eigen::Index> samples;
  for (std::size_t k = 0; k < missing.held_out.size(); ++k) {
    samples.insert(samples.end(), blocks.rows_of(missing.held_out[k]).size(), missing.held_out_samples[k]);
  }
  missing.held_out_samples = std::move(samples);
  missing.searched = rows_of_all(missing.searched, blocks);
  missing.held_out = rows_of_all(missing.held_out, blocks);
  missing.outliers = rows_of_all(missing.outliers, blocks);
  missing.failing_rows = rows_of_all(missing.failing_rows, blocks);
  const double length = static_cast<double>(n) / static_cast<double>(blocks.size());
  missing.notes.insert(missing.notes.begin(),
                       fmt::format("the {} rows were searched as {} means over {:.0f} rows each, within which the "
                                   "inputs hardly change; errors of the inputs are those of the means",
                                   n, blocks.size(), length));
  missing.time.rows_per_sample = std::lround(static_cast<double>(missing.time.rows_per_sample) * length);
  missing.time.step /= length;
  return missing;
}

}  // namespace llmt::discovery
