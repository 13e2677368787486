#include "discovery/terms/averaged_rows.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "discovery/terms/row_split.hpp"
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

std::optional<AveragedRows> averaged(const Inputs& inputs, const MeasuredOutputs& measured,
                                     const MissingOptions& options, Eigen::Index most) {
  const Eigen::Index n = inputs.values.rows();
  if (inputs.instants.size() == 0 || inputs.cutoff > 0.0 || n < 2 * most) return std::nullopt;
  constexpr Eigen::Index share_of_a_sample = 12;
  const Eigen::Index length = std::min(n / most, bearable_block(inputs, options) / share_of_a_sample);
  if (length < 2) return std::nullopt;
  AveragedRows few{inputs, measured, blocks_in_time(inputs, length)};
  few.inputs.values = means(inputs.values, few.blocks);
  few.inputs.instants = means(inputs.instants, few.blocks);
  few.inputs.noise /= std::sqrt(static_cast<double>(length));
  few.measured.values = means(measured.values, few.blocks);
  few.measured.noise /= std::sqrt(static_cast<double>(length));
  few.inputs.runs.clear();
  for (Eigen::Index b = 0; b < few.blocks.size() && !inputs.runs.empty(); ++b) {
    few.inputs.runs.push_back(inputs.runs[few.blocks.rows_of(b).front()]);
  }
  return few;
}

Simulation averaged(const Simulation& simulation, const Inputs& inputs, const Samples& blocks) {
  Simulation of_means = simulation;
  of_means.predict = [&](const Eigen::MatrixXd&, const Eigen::VectorXd& values) -> Eigen::MatrixXd {
    return means(simulation.predict(inputs.values, values), blocks);
  };
  return of_means;
}

Missing of_all_rows(Missing missing, const AveragedRows& few, const Simulation& simulation,
                    const std::vector<ModelTerm>& terms, const Inputs& inputs) {
  const Eigen::Index n = inputs.values.rows();
  const Samples& blocks = few.blocks;
  Eigen::VectorXd nominal(std::ssize(simulation.parameters));
  for (std::size_t k = 0; k < simulation.parameters.size(); ++k) nominal(k) = simulation.parameters[k].value;
  const Eigen::MatrixXd simulated = simulation.predict(inputs.values, nominal);
  missing.before = simulated + spread_out(missing.before - means(simulated, blocks), blocks, n);
  missing.corrected = with_found_terms(simulation, missing, terms, inputs);
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
