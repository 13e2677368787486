// Systems that move, as records.
#pragma once

#include <algorithm>
#include <cmath>
#include <functional>
#include <string>
#include <vector>

#include "llmt/random.hpp"
#include "llmt/series.hpp"

namespace systems {

// A record of one input, held for three rows each time, and the outputs that `next(y1, y2, u1)` makes of it.
inline llmt::Series record(Eigen::Index rows, std::uint64_t seed,
                           const std::function<double(double, double, double)>& next, double noise = 0.0,
                           double amplitude = 1.0) {
  llmt::Random random(seed);
  llmt::Series series;
  series.input_names = {"u"};
  series.output_names = {"y"};
  series.inputs.resize(rows, 1);
  series.outputs.resize(rows, 1);
  double u = 0.0;
  double y1 = 0.0;
  double y2 = 0.0;
  double before = 0.0;
  for (Eigen::Index row = 0; row < rows; ++row) {
    if (row % 3 == 0) u = random.uniform(-amplitude, amplitude);
    const double y = next(y1, y2, before);
    series.inputs(row, 0) = u;
    series.outputs(row, 0) = y + noise * random.normal();
    y2 = y1;
    y1 = y;
    before = u;
  }
  return series;
}

// A damped oscillator; poles 0.8 exp(+-0.5 i), steady gain 0.5 / (1 - a1 - a2).
constexpr double a1 = 1.6 * 0.8775825618903728;
constexpr double a2 = -0.64;
inline double oscillator(double y1, double y2, double u1) { return a1 * y1 + a2 * y2 + 0.5 * u1; }

// The same with a stiffening spring.
inline double duffing(double y1, double y2, double u1) { return a1 * y1 + a2 * y2 + 0.5 * u1 - 0.03 * y1 * y1 * y1; }

}  // namespace systems
