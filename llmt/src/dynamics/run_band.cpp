#include "llmt/run_band.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "dynamics/windows.hpp"
#include "llmt/lags.hpp"

namespace llmt {
namespace {

double quantile_of(const std::vector<double>& errors, double level) {
  const auto count = static_cast<double>(errors.size());
  const double rank = std::ceil(level * (count + 1.0) - 1e-9);
  if (rank > count) {
    throw std::invalid_argument(
        fmt::format("llmt::run_bounds: {} held-out errors are too few for the level {}", errors.size(), level));
  }
  return errors[static_cast<std::size_t>(std::max(rank, 1.0)) - 1];
}

// The band of an output: half its width at some numbers of rows.
struct Widths {
  std::vector<double> rows;
  std::vector<double> widths;
  bool grows = false;

  double at(double row) const {
    if (row <= rows.front()) return widths.front();
    if (row >= rows.back()) return grows ? widths.back() * row / rows.back() : widths.back();
    const auto above = std::ranges::upper_bound(rows, row) - rows.begin();
    const double share = (row - rows[above - 1]) / (rows[above] - rows[above - 1]);
    return widths[above - 1] + share * (widths[above] - widths[above - 1]);
  }
};

Widths widths_of(const DynamicModel& model, Eigen::Index output, double level) {
  const DynamicParts& parts = model.parts();
  if (parts.band.outputs.empty()) {
    throw std::invalid_argument("llmt::run_bounds: the model has no errors of held-out runs");
  }
  if (output < 0 || output >= model.num_outputs()) {
    throw std::invalid_argument(fmt::format("llmt::run_bounds: there is no output {}", output));
  }
  if (!(level > 0.0 && level < 1.0)) {
    throw std::invalid_argument(fmt::format("llmt::run_bounds: the level is {}, it lies between 0 and 1", level));
  }
  Widths result{{}, {}, adds_up(parts.lags, output)};
  for (const HeldOutErrors& part : parts.band.outputs[output]) {
    result.rows.push_back(part.rows);
    result.widths.push_back(quantile_of(part.errors, level));
  }
  return result;
}

}  // namespace

double half_width(const DynamicModel& model, Eigen::Index output, double rows, double level) {
  return widths_of(model, output, level).at(rows);
}

Bounds run_bounds(const DynamicModel& model, const Run& run, double level) {
  Bounds bounds{run.outputs, run.outputs};
  for (Eigen::Index o = 0; o < model.num_outputs(); ++o) {
    const Widths widths = widths_of(model, o, level);
    const Signal& output = model.parts().outputs[o];
    for (Eigen::Index row = run.first; row < run.outputs.rows(); ++row) {
      const double width = widths.at(static_cast<double>(row - run.first + 1));
      bounds.lower(row, o) = held_at_stops(output, run.outputs(row, o) - width);
      bounds.upper(row, o) = held_at_stops(output, run.outputs(row, o) + width);
    }
  }
  return bounds;
}

}  // namespace llmt
