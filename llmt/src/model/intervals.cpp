#include "llmt/intervals.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <utility>

#include "base/parallel.hpp"
#include "model/codes.hpp"
#include "model/incomplete.hpp"
#include "model/interval_checks.hpp"
#include "spread/scaled_residuals.hpp"

namespace llmt {
namespace {

using Kind = Eigen::MatrixXd HeldOutPart::*;  // residuals of complete or of incomplete rows

Eigen::Index count_rows(const std::vector<HeldOutPart>& parts, Kind kind) {
  Eigen::Index rows = 0;
  for (const HeldOutPart& part : parts) rows += (part.*kind).rows();
  return rows;
}

// An interval of one output at one row.
struct Interval {
  double lower;
  double upper;
};

// Residuals that count alike, and how many of the outermost values lie beyond an end.
struct Calibration {
  std::vector<Kind> kinds;
  Eigen::Index rank;
};

// The calibrations whose intervals a row is given the hull of: that of its kind, or where the kind has too few rows
// that of all rows, and the outermost residuals of the kind.
std::vector<Calibration> calibrations_of(const std::vector<HeldOutPart>& parts, Kind kind, Kind other, double level) {
  const Eigen::Index rows = count_rows(parts, kind);
  if (const Eigen::Index rank = values_outside(level, rows); rank >= 1) return {{{kind}, rank}};
  std::vector<Calibration> result = {{{kind, other}, values_outside(level, rows + count_rows(parts, other))}};
  if (rows > 0) result.push_back({{kind}, 1});
  return result;
}

// What the model and the spread of a part say of a row.
struct Estimate {
  double prediction;
  double spread;
};

// By how much the models usually disagree as a part of the spread, squared, for each output.
Eigen::VectorXd usual_disagreement(const std::vector<HeldOutPart>& parts, Eigen::Index outputs) {
  Eigen::VectorXd squares = Eigen::VectorXd::Zero(outputs);
  for (const HeldOutPart& part : parts) {
    for (std::size_t o = 0; o < part.disagreement.size(); ++o) {
      squares(static_cast<Eigen::Index>(o)) += part.disagreement[o] * part.disagreement[o];
    }
  }
  return squares / static_cast<double>(parts.size());
}

// Leaves of the disagreement of the folds' models what is beyond the usual one, which the residuals hold already,
// (I.4).
void draw_together(std::vector<Estimate>& estimates, double usual) {
  if (usual <= 0.0) return;
  const auto count = static_cast<double>(estimates.size());
  double mean = 0.0;
  double expected = 0.0;
  for (const Estimate& estimate : estimates) {
    mean += estimate.prediction / count;
    expected += usual * estimate.spread * estimate.spread / count;
  }
  double variance = 0.0;
  for (const Estimate& estimate : estimates) {
    variance += (estimate.prediction - mean) * (estimate.prediction - mean) / (count - 1.0);
  }
  const double left = variance > expected ? std::sqrt(1.0 - expected / variance) : 0.0;
  for (Estimate& estimate : estimates) estimate.prediction = mean + left * (estimate.prediction - mean);
}

// `estimates`: of each part.
Interval interval_at(const std::vector<HeldOutPart>& parts, const std::vector<Estimate>& estimates,
                     const Calibration& calibration, Eigen::Index output) {
  std::vector<ScaledResiduals> above;
  std::vector<ScaledResiduals> below;  // with the other sign, so that the smallest is the largest
  for (const Kind kind : calibration.kinds) {
    for (std::size_t p = 0; p < parts.size(); ++p) {
      const auto residuals = (parts[p].*kind).col(output);
      const std::span<const double> values(residuals.data(), static_cast<std::size_t>(residuals.size()));
      above.push_back({values, estimates[p].prediction, estimates[p].spread});
      below.push_back({values, -estimates[p].prediction, estimates[p].spread});
    }
  }
  const Interval interval{-largest_value(below, calibration.rank), largest_value(above, calibration.rank)};
  if (interval.lower <= interval.upper) return interval;
  // The folds' models disagree by more than their residuals.
  const double middle = 0.5 * (interval.lower + interval.upper);
  return {middle, middle};
}

// The hull of the intervals of all calibrations.
Interval hull_at(const std::vector<HeldOutPart>& parts, const std::vector<Estimate>& estimates,
                 const std::vector<Calibration>& calibrations, Eigen::Index output) {
  for (const Estimate& estimate : estimates) {
    if (std::isnan(estimate.prediction)) return {std::nan(""), std::nan("")};
  }
  Interval hull = interval_at(parts, estimates, calibrations.front(), output);
  for (std::size_t c = 1; c < calibrations.size(); ++c) {
    const Interval other = interval_at(parts, estimates, calibrations[c], output);
    hull = {std::min(hull.lower, other.lower), std::max(hull.upper, other.upper)};
  }
  return hull;
}

[[noreturn]] void refuse_intervals(const std::string& problem) {
  throw std::invalid_argument("llmt::Intervals: " + problem);
}

// Throws std::invalid_argument if the residuals are not those of `outputs` outputs, and sorts them.
void check_and_sort(Eigen::MatrixXd& residuals, std::size_t part, Eigen::Index outputs) {
  if (residuals.cols() != outputs) {
    refuse_intervals(
        fmt::format("fold {} has {} columns of residuals for {} outputs", part, residuals.cols(), outputs));
  }
  if (!residuals.allFinite() || (residuals.array() < 0.0).any()) {
    refuse_intervals(fmt::format("a residual of fold {} is negative or not finite", part));
  }
  for (Eigen::Index o = 0; o < outputs; ++o) std::sort(residuals.col(o).begin(), residuals.col(o).end());
}

void check_disagreement(const std::vector<double>& disagreement, std::size_t part, Eigen::Index outputs,
                        std::size_t models) {
  const auto is_size = [](double value) { return value >= 0.0 && std::isfinite(value); };
  if (models < 2 || std::ssize(disagreement) != outputs || !std::ranges::all_of(disagreement, is_size)) {
    refuse_intervals(fmt::format("the disagreement of part {} is not one number of at least 0 for each of {} outputs",
                                 part, outputs));
  }
}

// By how much spreads are larger in gaps, of each output.
std::vector<double> factors_in_gaps(const std::vector<HeldOutPart>& parts, Eigen::Index outputs) {
  std::vector<double> factors;
  for (Eigen::Index o = 0; o < outputs; ++o) {
    std::vector<ScaledResiduals> residuals;
    for (const HeldOutPart& part : parts) {
      for (const Eigen::MatrixXd* kind : {&part.residuals, &part.incomplete}) {
        residuals.push_back({{kind->col(o).data(), static_cast<std::size_t>(kind->rows())}});
      }
    }
    factors.push_back(factor_in_gaps(residuals));
  }
  return factors;
}

std::vector<HeldOutPart> parts_of(std::vector<Eigen::MatrixXd> residuals, std::vector<Eigen::MatrixXd> incomplete) {
  if (!incomplete.empty() && incomplete.size() != residuals.size()) {
    refuse_intervals(fmt::format("{} and {} matrices of residuals", residuals.size(), incomplete.size()));
  }
  std::vector<HeldOutPart> parts;
  for (std::size_t k = 0; k < residuals.size(); ++k) {
    HeldOutPart& part = parts.emplace_back();
    part.model = k;
    part.incomplete = incomplete.empty() ? Eigen::MatrixXd(0, residuals[k].cols()) : std::move(incomplete[k]);
    part.residuals = std::move(residuals[k]);
  }
  return parts;
}

}  // namespace

Intervals::Intervals(std::vector<Model> models, std::vector<HeldOutPart> parts, std::vector<Gap> gaps,
                     TrainingRecord record)
    : models_(std::move(models)), parts_(std::move(parts)), gaps_(std::move(gaps)), record_(std::move(record)) {
  check_gaps(gaps_, models_.empty() ? 0 : models_.front().num_inputs());
  if (!models_.empty()) check_record(record_, models_.front().inputs(), models_.front().outputs().size());
  for (std::size_t k = 0; k < models_.size(); ++k) {
    if (const std::string difference = difference_of_columns(models_[k], models_[0]); !difference.empty()) {
      refuse_intervals(fmt::format("fold {} and fold 0 differ: {}", k, difference));
    }
  }
  std::vector<bool> has_part(models_.size(), false);
  for (std::size_t p = 0; p < parts_.size(); ++p) {
    HeldOutPart& part = parts_[p];
    if (part.model >= models_.size() || (p > 0 && part.model < parts_[p - 1].model)) {
      refuse_intervals(
          fmt::format("part {} is of model {} of {}, in the order of the models", p, part.model, models_.size()));
    }
    has_part[part.model] = true;
    const Model& model = models_[part.model];
    check_and_sort(part.residuals, p, model.num_outputs());
    check_and_sort(part.incomplete, p, model.num_outputs());
    if (!part.spreads.empty() && std::ssize(part.spreads) != model.num_outputs()) {
      refuse_intervals(
          fmt::format("part {} has {} spreads for {} outputs", p, part.spreads.size(), model.num_outputs()));
    }
    if (!part.disagreement.empty()) check_disagreement(part.disagreement, p, model.num_outputs(), models_.size());
    for (const Spread& spread : part.spreads) check_spread(spread, model.inputs());
  }
  if (std::ranges::count(has_part, false) > 0) {
    refuse_intervals(fmt::format("{} models and {} matrices of residuals", models_.size(), parts_.size()));
  }
}

Intervals::Intervals(std::vector<Model> models, std::vector<Eigen::MatrixXd> residuals,
                     std::vector<Eigen::MatrixXd> incomplete)
    : Intervals(std::move(models), parts_of(std::move(residuals), std::move(incomplete))) {}

Bounds Intervals::predict(const Eigen::Ref<const Eigen::MatrixXd>& inputs, double level, int max_threads,
                          const Eigen::VectorXd& weights) const {
  return predict(inputs, std::vector<double>{level}, max_threads, weights).front();
}

std::vector<Bounds> Intervals::predict(const Eigen::Ref<const Eigen::MatrixXd>& inputs,
                                       const std::vector<double>& levels, int max_threads,
                                       const Eigen::VectorXd& weights) const {
  if (empty()) {
    refuse_intervals("there are no held-out residuals; fit with folds and with FitOptions::intervals = true");
  }
  check_row_weights("llmt::Intervals", weights, inputs.rows());
  const Eigen::Index lacking = count_rows(parts_, &HeldOutPart::incomplete);
  std::vector<std::vector<Calibration>> of_complete;
  std::vector<std::vector<Calibration>> of_incomplete;
  for (const double level : levels) {
    check_level("llmt::Intervals", level, count_rows(parts_, &HeldOutPart::residuals) + lacking);
    of_complete.push_back(calibrations_of(parts_, &HeldOutPart::residuals, &HeldOutPart::incomplete, level));
    of_incomplete.push_back(calibrations_of(parts_, &HeldOutPart::incomplete, &HeldOutPart::residuals, level));
  }
  std::vector<Eigen::MatrixXd> predicted;
  for (const Model& model : models_) {
    predicted.push_back(model.predict(inputs, max_threads));
  }
  const std::vector<bool> incomplete = incomplete_rows(models_, inputs);
  const Eigen::Index outputs = predicted[0].cols();
  const Eigen::VectorXd usual = usual_disagreement(parts_, outputs);
  const Eigen::MatrixXd at = at_positions(models_[0].inputs(), inputs);
  const std::vector<Eigen::Index> in_gap = rows_in_gaps(gaps_, inputs);
  const std::vector<double> in_gaps = factors_in_gaps(parts_, in_gap.empty() ? 0 : outputs);
  std::vector<Bounds> bounds(levels.size());
  for (Bounds& each : bounds) each.lower = each.upper = Eigen::MatrixXd(inputs.rows(), outputs);
  constexpr Eigen::Index block = 256;
  parallel_for((inputs.rows() + block - 1) / block, max_threads, [&](Eigen::Index index) {
    std::vector<Estimate> estimates(parts_.size());  // of each part
    for (Eigen::Index row = index * block; row < std::min(inputs.rows(), (index + 1) * block); ++row) {
      for (Eigen::Index o = 0; o < outputs; ++o) {
        for (std::size_t p = 0; p < parts_.size(); ++p) {
          const double prediction = predicted[parts_[p].model](row, o);
          const std::vector<Spread>& spreads = parts_[p].spreads;
          estimates[p] = {prediction, spreads.empty() ? 1.0 : spread_at(spreads[o], at, row, prediction)};
        }
        draw_together(estimates, usual[o]);
        if (std::ranges::binary_search(in_gap, row)) {
          for (Estimate& estimate : estimates) estimate.spread *= in_gaps[static_cast<std::size_t>(o)];
        }
        for (std::size_t p = 0; weights.size() > 0 && p < parts_.size(); ++p) {
          if (!parts_[p].spreads.empty()) estimates[p].spread *= factor_of_weight(parts_[p].spreads[o], weights(row));
        }
        for (std::size_t k = 0; k < levels.size(); ++k) {
          const auto& calibrations = incomplete[row] ? of_incomplete[k] : of_complete[k];
          const auto [lower, upper] = hull_at(parts_, estimates, calibrations, o);
          bounds[k].lower(row, o) = lower;
          bounds[k].upper(row, o) = upper;
        }
      }
    }
  });
  for (std::size_t k = 0; k < levels.size(); ++k) {
    bounds[k].in_gap = in_gap;
    const bool has_few = values_outside(levels[k], lacking) < 1;
    for (Eigen::Index row = 0; has_few && row < inputs.rows(); ++row) {
      if (incomplete[row]) bounds[k].uncalibrated.push_back(row);
    }
  }
  return bounds;
}

std::vector<Eigen::MatrixXd> quantiles(const ModelWithIntervals& model, const Eigen::Ref<const Eigen::MatrixXd>& inputs,
                                       const std::vector<double>& probabilities, int max_threads,
                                       const Eigen::VectorXd& weights) {
  return quantiles_from(model.intervals.predict(inputs, levels_of_quantiles(probabilities), max_threads, weights),
                        model.model.predict(inputs, max_threads), probabilities);
}

}  // namespace llmt
