/// \file
/// What watches the errors of a stream's tree: rises of the error, comparisons of two models, misplaced thresholds.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cmath>

namespace llmt {

/// Detects a rise of absolute errors: Page's (1954) cumulative sum, in the form of the Page-Hinkley test, of the errors
/// in units of their mean.
class RiseDetector {
 public:
  /// Takes an error. Returns true if the errors have risen.
  bool add(double absolute_error);
  void reset() { *this = {}; }

 private:
  double usual_ = 0.0;  // mean of the absolute errors over about the last `memory` rows
  double excess_ = 0.0;
  Eigen::Index rows_ = 0;
};

/// Compares the absolute errors of two models over the last rows.
class Duel {
 public:
  void add(double first, double second);
  Eigen::Index rows() const { return rows_; }
  /// Mean of first - second, divided by its standard error.
  double t() const;

 private:
  double weight_ = 0.0;
  double mean_ = 0.0;
  double square_ = 0.0;
  Eigen::Index rows_ = 0;
};

/// Decides where a threshold should be. For rows near the threshold it sums up, in bins, by how much the squared error
/// of the prediction of the left side is larger than that of the right side.
class ThresholdWatch {
 public:
  ThresholdWatch() = default;
  ThresholdWatch(double threshold, double reach) : threshold_(threshold), reach_(reach) {}

  /// Whether a value is near the threshold.
  bool concerns(double x) const { return std::abs(x - threshold_) < reach_; }

  /// Takes the squared errors of both sides' predictions on a row near the threshold, before the row is learned.
  /// Returns the threshold from now on.
  double add(double x, double squared_left, double squared_right);

 private:
  static constexpr std::size_t half = 16;  // bins on either side

  double best_edge() const;

  double threshold_ = 0.0;
  double reach_ = 0.0;
  Eigen::Index rows_ = 0;
  std::array<double, 2 * half> sums_{};
  std::array<double, 2 * half> squares_{};
};

}  // namespace llmt
