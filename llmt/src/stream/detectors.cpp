#include "stream/detectors.hpp"

#include <algorithm>

namespace llmt {
namespace {

// RiseDetector. Number of rows over which the mean error is taken, and number of rows before the sum begins. Errors are
// in units of the mean error: an excess is what is above 1 + tolerated, and an error counts as at most `largest`, so
// that outliers raise no alarm. The alarm is raised when the sum of the excesses passes `alarm`.
constexpr double memory = 5000.0;
constexpr Eigen::Index settling = 300;
constexpr double tolerated = 0.1;
constexpr double largest = 4.0;
constexpr double alarm = 80.0;

// Number of rows over which a duel averages the errors.
constexpr double duel_memory = 500.0;

// ThresholdWatch. After 200 rows near a threshold the watch begins anew; before, every 50 rows, the threshold may move.
// It moves if the gain is larger than 4 standard errors.
constexpr Eigen::Index watch_rows = 200;
constexpr Eigen::Index watch_interval = 50;
constexpr double watch_t = 4.0;

}  // namespace

bool RiseDetector::add(double absolute_error) {
  ++rows_;
  if (rows_ > settling) {
    const double multiple = absolute_error < largest * usual_ ? absolute_error / usual_ : largest;
    excess_ = std::max(0.0, excess_ + multiple - 1.0 - tolerated);
  }
  usual_ += (absolute_error - usual_) / std::min(static_cast<double>(rows_), memory);
  return excess_ > alarm;
}

void Duel::add(double first, double second) {
  ++rows_;
  const double keep = 1.0 - 1.0 / duel_memory;
  const double difference = first - second;
  weight_ = keep * weight_ + 1.0;
  mean_ += (difference - mean_) / weight_;
  square_ += (difference * difference - square_) / weight_;
}

double Duel::t() const {
  const double variance = square_ - mean_ * mean_;
  return variance > 0.0 ? mean_ / std::sqrt(variance / weight_) : 0.0;
}

double ThresholdWatch::add(double x, double squared_left, double squared_right) {
  const double width = reach_ / static_cast<double>(half);
  const double position = (x - threshold_) / width + static_cast<double>(half);
  const std::size_t bin = std::min(2 * half - 1, static_cast<std::size_t>(std::max(0.0, position)));
  const double difference = squared_left - squared_right;
  sums_[bin] += difference;
  squares_[bin] += difference * difference;
  ++rows_;
  if (rows_ < watch_rows && rows_ % watch_interval != 0) return threshold_;
  const double to = best_edge();
  if (to != threshold_) {
    *this = ThresholdWatch(to, reach_);
  } else if (rows_ >= watch_rows) {
    *this = ThresholdWatch(to, 0.5 * reach_);  // it stays, and is looked at more closely
  }
  return to;
}

// Rows between the threshold and a better one are on the wrong side. Returns the edge of a bin that gains most, or the
// threshold if no gain is significant.
double ThresholdWatch::best_edge() const {
  const double width = reach_ / static_cast<double>(half);
  double most = 0.0;
  double to = threshold_;
  for (const int sign : {1, -1}) {
    double gain = 0.0;
    double square = 0.0;
    for (std::size_t k = 0; k < half; ++k) {
      const std::size_t at = sign > 0 ? half + k : half - 1 - k;
      gain -= sign * sums_[at];
      square += squares_[at];
      if (gain > most && gain > watch_t * std::sqrt(square)) {
        most = gain;
        to = threshold_ + sign * static_cast<double>(k + 1) * width;
      }
    }
  }
  return to;
}

}  // namespace llmt
