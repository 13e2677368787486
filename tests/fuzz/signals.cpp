// Logs: a table is refused with a LogError, or all that is made of it is finite and in the order of time.
#include <cmath>
#include <cstring>

#include "fuzz/fuzz.hpp"
#include "llmt/discovery/signals.hpp"

namespace fuzz_signals {

FUZZ_TARGET(signals) {
  using namespace llmt::discovery;
  const auto byte = [&](std::size_t k) { return size == 0 ? 0 : static_cast<int>(data[k % size]); };
  const Eigen::Index rows = 4 * static_cast<Eigen::Index>(std::min<std::size_t>(size, 500));
  Log log;
  log.time.resize(rows);
  log.positions.resize(rows, 2);
  log.torques.resize(rows, byte(0) % 2);
  double t = byte(1) * std::pow(10.0, byte(2) % 20 - 10);
  for (Eigen::Index i = 0; i < rows; ++i) {
    const int b = byte(static_cast<std::size_t>(i / 4 + i % 4 * 7));
    // Mostly even steps; some are jitter, gaps, repeats and new runs.
    t += b == 255 ? 0.0 : b > 250 ? 0.3 : b > 240 ? 0.0013 : 0.001;
    log.time(i) = t;
    log.positions(i, 0) = b * std::pow(2.0, byte(3) % 40 - 20);
    log.positions(i, 1) = b == 254 ? std::ldexp(1.0, byte(4) * 8 - 1000) : 1.0;
    if (log.torques.cols() > 0) log.torques(i, 0) = b == 253 ? std::numeric_limits<double>::quiet_NaN() : b;
    if (byte(5) % 3 == 0) log.runs.emplace_back(b == 252 ? "b" : std::to_string(i / 400));
  }
  SignalsOptions options{.cutoff = std::pow(10.0, byte(6) % 8 - 3)};
  if (byte(7) % 2 == 0) options.standstill = {byte(8) * 0.01};
  options.every = byte(9) % 5;
  try {
    const Signals table = signals(log, options);
    const Eigen::Index m = table.time.size();
    fuzz::require(m > 0 && std::ssize(table.rows) == m, "a table has rows");
    fuzz::require(table.positions.allFinite() && table.velocities.allFinite() && table.accelerations.allFinite() &&
                      table.torques.allFinite() && table.time.allFinite(),
                  "values are finite");
    Eigen::Index kept = 0;
    for (const Stretch& stretch : table.stretches) kept += stretch.kept;
    fuzz::require(kept == m, "every row comes from a stretch");
    for (Eigen::Index i = 1; i < m; ++i) {
      fuzz::require(table.rows[i] >= table.rows[i - 1], "rows are in the order of the log");
    }
  } catch (const LogError& error) {
    fuzz::require(error.row() < rows, "a row that is named is there");
  }
  return 0;
}

}  // namespace fuzz_signals
