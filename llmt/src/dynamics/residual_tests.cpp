#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <stdexcept>

#include "dynamics/one_step.hpp"
#include "dynamics/windows.hpp"
#include "llmt/dynamic_analysis.hpp"

namespace llmt {
namespace {

constexpr Eigen::Index correlated_lags = 25;
constexpr double quantile_of_99_per_cent = 2.5758293035489004;  // of the normal distribution, both sides

double correlation(const Eigen::VectorXd& first, const Eigen::VectorXd& second, Eigen::Index lag) {
  const Eigen::Index rows = first.size() - lag;
  return first.tail(rows).dot(second.head(rows));
}

// Values of a column on rows that follow each other, in pieces; their mean is taken away.
std::vector<Eigen::VectorXd> centred(const std::vector<Eigen::VectorXd>& pieces) {
  double sum = 0.0;
  Eigen::Index count = 0;
  for (const Eigen::VectorXd& piece : pieces) {
    sum += piece.sum();
    count += piece.size();
  }
  std::vector<Eigen::VectorXd> result = pieces;
  for (Eigen::VectorXd& piece : result) piece.array() -= sum / static_cast<double>(std::max<Eigen::Index>(count, 1));
  return result;
}

double sum_of_correlations(const std::vector<Eigen::VectorXd>& first, const std::vector<Eigen::VectorXd>& second,
                           Eigen::Index lag) {
  double sum = 0.0;
  for (std::size_t k = 0; k < first.size(); ++k) {
    if (first[k].size() > lag) sum += correlation(first[k], second[k], lag);
  }
  return sum;
}

// Errors of a run, or of the next row, in pieces without gaps, and the inputs there.
struct Pieces {
  std::vector<Eigen::VectorXd> errors;
  std::vector<Eigen::MatrixXd> inputs;
};

Pieces pieces_of(const Series& series, const Eigen::MatrixXd& predicted, Eigen::Index output) {
  Pieces pieces;
  for (const Stretch& record : records_of(series)) {
    Eigen::Index begin = record.begin;
    for (Eigen::Index row = record.begin; row <= record.end; ++row) {
      const bool is_there =
          row < record.end && std::isfinite(predicted(row, output)) && std::isfinite(series.outputs(row, output));
      if (is_there) continue;
      if (row > begin) {
        pieces.errors.emplace_back(series.outputs.col(output).segment(begin, row - begin) -
                                   predicted.col(output).segment(begin, row - begin));
        pieces.inputs.emplace_back(series.inputs.middleRows(begin, row - begin));
      }
      begin = row + 1;
    }
  }
  return pieces;
}

// One-sided spectrum of pieces at frequencies of a segment of `length` rows; empty: no piece is as long.
Eigen::VectorXd spectrum_of(const std::vector<Eigen::VectorXd>& pieces, Eigen::Index length, double sample_time) {
  Eigen::VectorXd window(length);
  Eigen::MatrixXd turns(2, length);  // cosine and sine of each place on the circle
  for (Eigen::Index k = 0; k < length; ++k) {
    const double angle = 2.0 * std::numbers::pi * static_cast<double>(k) / static_cast<double>(length);
    window(k) = 0.5 * (1.0 - std::cos(angle));
    turns.col(k) << std::cos(angle), std::sin(angle);
  }
  Eigen::VectorXd power = Eigen::VectorXd::Zero(length / 2);
  Eigen::Index segments = 0;
  for (const Eigen::VectorXd& piece : pieces) {
    for (Eigen::Index begin = 0; begin + length <= piece.size(); begin += length / 2) {
      const Eigen::VectorXd values = piece.segment(begin, length).cwiseProduct(window);
      ++segments;
      for (Eigen::Index f = 1; f <= length / 2; ++f) {
        Eigen::Vector2d sum = Eigen::Vector2d::Zero();
        for (Eigen::Index k = 0; k < length; ++k) sum += values(k) * turns.col(f * k % length);
        power(f - 1) += (2 * f < length ? 2.0 : 1.0) * sum.squaredNorm();
      }
    }
  }
  if (segments == 0) return {};
  return power * (sample_time / (static_cast<double>(segments) * window.squaredNorm()));
}

// The even length of the segments of both spectra.
Eigen::Index segment_length(const std::vector<Eigen::VectorXd>& first, const std::vector<Eigen::VectorXd>& second) {
  constexpr Eigen::Index longest = 256;
  constexpr Eigen::Index shortest = 16;
  const auto most = [](const std::vector<Eigen::VectorXd>& pieces) {
    Eigen::Index rows = 0;
    for (const Eigen::VectorXd& piece : pieces) rows = std::max(rows, piece.size());
    return rows;
  };
  // Four segments at least, so that a spectrum is a mean of several.
  const Eigen::Index rows = std::min(most(first), most(second));
  const Eigen::Index length = std::min(longest, std::max(shortest, 2 * rows / 5)) / 2 * 2;
  return length <= rows ? length : 0;
}

Eigen::MatrixXd next_rows(const DynamicModel& model, const Series& series) {
  Eigen::MatrixXd predicted =
      Eigen::MatrixXd::Constant(series.rows(), series.outputs.cols(), std::numeric_limits<double>::quiet_NaN());
  const RegressorRows rows =
      regressor_rows(series, model.parts().lags, complete_stretches(series, model.memory() + 1), model.memory());
  OneStep map(model.parts());
  Eigen::VectorXd x;
  Eigen::VectorXd y(series.outputs.cols());
  for (Eigen::Index k = 0; k < std::ssize(rows.rows); ++k) {
    x = rows.regressors.row(k).transpose();
    map.values(x.data(), y.data());
    predicted.row(rows.rows[k]) = y.transpose() + rows.last.row(k);
  }
  return predicted;
}

}  // namespace

Eigen::Index ResidualTests::autocorrelations_outside() const {
  return (autocorrelation.array().abs() > autocorrelation_bound).count();
}

Eigen::Index ResidualTests::cross_correlations_outside() const {
  Eigen::Index count = 0;
  for (Eigen::Index i = 0; i < cross_correlation.rows(); ++i) {
    count += (cross_correlation.row(i).array().abs() > cross_correlation_bound(i)).count();
  }
  return count;
}

std::vector<ResidualTests> residual_tests(const DynamicModel& model, const Series& series,
                                          const Eigen::Ref<const Eigen::MatrixXd>& simulated) {
  if (simulated.rows() != series.rows() || simulated.cols() != series.outputs.cols() ||
      series.outputs.cols() != model.num_outputs() || series.inputs.cols() != model.num_inputs()) {
    throw std::invalid_argument("llmt::residual_tests: model, series and run have different shapes");
  }
  const Eigen::MatrixXd predicted = next_rows(model, series);
  std::vector<ResidualTests> all;
  for (Eigen::Index o = 0; o < model.num_outputs(); ++o) {
    ResidualTests tests;
    tests.output = model.parts().outputs[o].name;
    const std::vector<Eigen::VectorXd> next = centred(pieces_of(series, predicted, o).errors);
    double rows = 0.0;
    for (const Eigen::VectorXd& piece : next) rows += static_cast<double>(piece.size());
    tests.autocorrelation_bound = quantile_of_99_per_cent / std::sqrt(rows);
    tests.autocorrelation.resize(correlated_lags);
    const double power = sum_of_correlations(next, next, 0);
    for (Eigen::Index k = 1; k <= correlated_lags; ++k) {
      tests.autocorrelation(k - 1) = power > 0.0 ? sum_of_correlations(next, next, k) / power : 0.0;
    }
    const Pieces run = pieces_of(series, simulated, o);
    const std::vector<Eigen::VectorXd> errors = centred(run.errors);
    double run_rows = 0.0;
    for (const Eigen::VectorXd& piece : errors) run_rows += static_cast<double>(piece.size());
    if (const Eigen::Index length = segment_length(next, errors); length > 0) {
      const double sample_time = model.parts().sample_time;
      tests.frequency = Eigen::VectorXd::LinSpaced(length / 2, 1.0, static_cast<double>(length / 2)) /
                        (static_cast<double>(length) * sample_time);
      tests.next_row_spectrum = spectrum_of(next, length, sample_time);
      tests.run_spectrum = spectrum_of(errors, length, sample_time);
    }
    tests.cross_correlation.setZero(model.num_inputs(), correlated_lags + 1);
    tests.cross_correlation_bound.setZero(model.num_inputs());
    const double error_power = sum_of_correlations(errors, errors, 0);
    for (Eigen::Index i = 0; i < model.num_inputs(); ++i) {
      std::vector<Eigen::VectorXd> input;
      for (const Eigen::MatrixXd& piece : run.inputs) input.emplace_back(piece.col(i));
      input = centred(input);
      const double input_power = sum_of_correlations(input, input, 0);
      if (!(error_power > 0.0) || !(input_power > 0.0)) continue;
      for (Eigen::Index k = 0; k <= correlated_lags; ++k) {
        tests.cross_correlation(i, k) = sum_of_correlations(errors, input, k) / std::sqrt(error_power * input_power);
      }
      // The variance of the estimate is P / rows, P = sum over all lags of the product of both autocorrelations.
      double spread = 1.0;
      for (Eigen::Index k = 1; k <= 4 * correlated_lags; ++k) {
        spread += 2.0 * sum_of_correlations(errors, errors, k) / error_power * sum_of_correlations(input, input, k) /
                  input_power;
      }
      tests.cross_correlation_bound(i) = quantile_of_99_per_cent * std::sqrt(std::max(spread, 1.0) / run_rows);
    }
    all.push_back(std::move(tests));
  }
  return all;
}

}  // namespace llmt
