#include "spread/scaled_residuals.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <vector>

#include "llmt/bounds.hpp"

namespace llmt {
namespace {

// The values of a part that may be the one that is looked for: from `begin` to before `end`.
struct Window {
  const ScaledResiduals* part;
  std::size_t begin;
  std::size_t end;

  // The first index in the window whose value is at least `value`, or above it.
  std::size_t first_at_least(double value) const {
    return first([&](double other) { return other >= value; });
  }
  std::size_t first_above(double value) const {
    return first([&](double other) { return other > value; });
  }

 private:
  template <class Test>
  std::size_t first(Test&& test) const {
    std::size_t low = begin;
    std::size_t high = end;
    while (low < high) {
      const std::size_t middle = low + (high - low) / 2;
      test(part->value(middle)) ? high = middle : low = middle + 1;
    }
    return low;
  }
};

}  // namespace

double largest_value(std::span<const ScaledResiduals> parts, Eigen::Index rank) {
  auto left = static_cast<std::size_t>(rank);
  std::vector<Window> windows;
  for (const ScaledResiduals& part : parts) {
    // Only the `rank` largest of a part can be among the `rank` largest of all.
    windows.push_back({&part, part.residuals.size() - std::min(part.residuals.size(), left), part.residuals.size()});
  }
  while (true) {
    const Window& widest = *std::ranges::max_element(windows, {}, [](const Window& w) { return w.end - w.begin; });
    const double pivot = widest.part->value(widest.begin + (widest.end - widest.begin) / 2);
    std::size_t above = 0;
    std::size_t at_least = 0;
    for (const Window& window : windows) {
      above += window.end - window.first_above(pivot);
      at_least += window.end - window.first_at_least(pivot);
    }
    if (above < left && left <= at_least) return pivot;
    for (Window& window : windows) {
      (left <= above ? window.begin : window.end) =
          left <= above ? window.first_above(pivot) : window.first_at_least(pivot);
    }
    if (left > at_least) left -= at_least;
  }
}

Bounds holding(Bounds bounds, const Eigen::Ref<const Eigen::MatrixXd>& predictions) {
  bounds.lower = bounds.lower.cwiseMin(predictions);
  bounds.upper = bounds.upper.cwiseMax(predictions);
  return bounds;
}

std::vector<double> levels_of_quantiles(const std::vector<double>& probabilities) {
  std::vector<double> levels;
  double before = 0.0;
  for (const double p : probabilities) {
    if (!(p > before && p < 1.0)) {
      throw std::invalid_argument(
          fmt::format("llmt::quantiles: the probability {} must lie between 0 and 1, and above those before it", p));
    }
    before = p;
    if (p != 0.5) levels.push_back(std::abs(1.0 - 2.0 * p));
  }
  return levels;
}

std::vector<Eigen::MatrixXd> quantiles_from(const std::vector<Bounds>& bounds,
                                            const Eigen::Ref<const Eigen::MatrixXd>& predictions,
                                            const std::vector<double>& probabilities) {
  std::vector<Eigen::MatrixXd> quantiles;
  for (Eigen::Index o = 0; o < predictions.cols(); ++o) {
    Eigen::MatrixXd& of_output = quantiles.emplace_back(predictions.rows(), std::ssize(probabilities));
    std::size_t next = 0;
    for (Eigen::Index k = 0; k < of_output.cols(); ++k) {
      const double p = probabilities[static_cast<std::size_t>(k)];
      if (p == 0.5) {
        of_output.col(k) = predictions.col(o);
      } else {
        of_output.col(k) = (p < 0.5 ? bounds[next].lower : bounds[next].upper).col(o);
        ++next;
      }
    }
    for (Eigen::Index row = 0; row < of_output.rows(); ++row) {
      if (!of_output.row(row).hasNaN()) std::sort(of_output.row(row).begin(), of_output.row(row).end());
    }
  }
  return quantiles;
}

double factor_in_gaps(std::span<const ScaledResiduals> parts) {
  Eigen::Index rows = 0;
  for (const ScaledResiduals& part : parts) rows += std::ssize(part.residuals);
  const auto percentile = [&](double level) {
    return largest_value(parts, std::max<Eigen::Index>(values_outside(level, rows), 1));
  };
  if (rows == 0) return 1.0;
  const double usual = percentile(0.9);
  return usual > 0.0 ? percentile(0.99) / usual : 1.0;
}

Eigen::Index values_outside(double level, Eigen::Index rows) {
  constexpr double slack = 1.0 + 1e-12;  // keeps 0.1 * 30 from becoming 2
  const auto outside = static_cast<Eigen::Index>(std::floor((1.0 - level) * static_cast<double>(rows + 1) * slack));
  return std::min(outside, rows);  // a level below 1 / (rows + 1)
}

void check_level(const char* what, double level, Eigen::Index rows) {
  if (!(level > 0.0 && level < 1.0)) {
    throw std::invalid_argument(fmt::format("{}: level is {}, it must lie between 0 and 1", what, level));
  }
  if (values_outside(level, rows) < 1) {
    throw std::invalid_argument(fmt::format("{}: level {} needs at least {:.0f} held-out rows, there are {}", what,
                                            level, std::ceil(1.0 / (1.0 - level) - 1e-9) - 1.0, rows));
  }
}

}  // namespace llmt
