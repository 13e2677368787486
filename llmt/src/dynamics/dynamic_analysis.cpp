#include "llmt/dynamic_analysis.hpp"

#include <fmt/format.h>

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <stdexcept>

#include "base/decompositions.hpp"
#include "dynamics/one_step.hpp"
#include "dynamics/windows.hpp"

namespace llmt {
namespace {

constexpr Eigen::Index correlated_lags = 25;
constexpr double quantile_of_99_per_cent = 2.5758293035489004;  // of the normal distribution, both sides
constexpr double on_unit_circle = 1e-9;

Pole pole_of(std::complex<double> z, double sample_time) {
  const std::complex<double> s = std::log(z) / sample_time;
  Pole pole{z};
  const double size = std::abs(s);
  pole.frequency = size / (2.0 * std::numbers::pi);
  pole.damping = size > 0.0 ? -s.real() / size : 1.0;
  const bool on_circle = std::abs(std::abs(z) - 1.0) < on_unit_circle;
  pole.time_constant = on_circle ? std::numeric_limits<double>::infinity() : -1.0 / s.real();
  return pole;
}

// The row of regressors with the first output at rest at a value and all else in the middle of the training rows.
Eigen::VectorXd at_rest(const DynamicModel& model, double value) {
  Eigen::VectorXd x = model.parts().polynomial.centre;
  for (std::size_t c = 0; c < model.columns().size(); ++c) {
    const LaggedColumn& column = model.columns()[c];
    if (!column.is_output) continue;
    if (column.minus_lag >= 0) {
      x(static_cast<Eigen::Index>(c)) = 0.0;
    } else if (column.signal == 0) {
      x(static_cast<Eigen::Index>(c)) = value;
    }
  }
  return x;
}

// Mean of the rows of a leaf, as regressors.
Eigen::VectorXd mean_of_leaf(const Model& tree, const Node& node) {
  Eigen::VectorXd x(tree.num_inputs());
  for (Eigen::Index j = 0; j < x.size(); ++j) x(j) = tree.inputs()[j].centre;
  for (std::size_t r = 0; r < tree.regressors().size(); ++r) {
    const Regressor& regressor = tree.regressors()[r];
    if (regressor.second_input >= 0) continue;
    x(regressor.input) = regressor.centre + node.mean(static_cast<Eigen::Index>(r));
  }
  return x;
}

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

LocalDynamics dynamics_at(const DynamicModel& model, const Eigen::VectorXd& regressors, std::string where) {
  if (regressors.size() != std::ssize(model.columns()) || !regressors.allFinite()) {
    throw std::invalid_argument("llmt::dynamics_at: a finite value is needed for each regressor");
  }
  OneStep map(model.parts());
  Eigen::VectorXd y(model.num_outputs());
  Eigen::MatrixXd by_regressor;
  Eigen::MatrixXd by_parameter;
  map.derivatives(regressors.data(), y.data(), by_regressor, by_parameter);
  const Eigen::Index outputs = model.num_outputs();
  const Eigen::Index memory = std::max<Eigen::Index>(model.memory(), 1);
  // y(t) = sum_k A_k y(t - k) + sum_k B_k u(t - k); the state is y(t - 1), y(t - 2), ...
  Eigen::MatrixXd companion = Eigen::MatrixXd::Zero(outputs * memory, outputs * memory);
  Eigen::MatrixXd of_outputs = Eigen::MatrixXd::Zero(outputs, outputs);
  Eigen::MatrixXd of_inputs = Eigen::MatrixXd::Zero(outputs, model.num_inputs());
  for (std::size_t c = 0; c < model.columns().size(); ++c) {
    const LaggedColumn& column = model.columns()[c];
    const auto slope = by_regressor.col(static_cast<Eigen::Index>(c));
    if (!column.is_output) {
      of_inputs.col(column.signal) += slope;
      continue;
    }
    companion.block(0, (column.lag - 1) * outputs + column.signal, outputs, 1) += slope;
    if (column.minus_lag >= 0) {
      companion.block(0, (column.minus_lag - 1) * outputs + column.signal, outputs, 1) -= slope;
    } else {
      of_outputs.col(column.signal) += slope;
    }
  }
  for (Eigen::Index o = 0; o < outputs; ++o) {
    if (!adds_up(model.parts().lags, o)) continue;
    companion(o, o) += 1.0;
    of_outputs(o, o) += 1.0;
  }
  companion.bottomLeftCorner(outputs * (memory - 1), outputs * (memory - 1)).setIdentity();
  LocalDynamics local{std::move(where), {}, {}, true};
  const Eigen::VectorXcd eigenvalues = Eigen::EigenSolver<Eigen::MatrixXd>(companion, false).eigenvalues();
  for (const std::complex<double> z : eigenvalues) {
    if (std::abs(z) < on_unit_circle) continue;
    local.poles.push_back(pole_of(z, model.parts().sample_time));
    local.is_stable = local.is_stable && std::abs(z) <= 1.0 + on_unit_circle;
  }
  std::ranges::sort(local.poles, [](const Pole& left, const Pole& right) {
    const double a = std::abs(left.z);
    const double b = std::abs(right.z);
    return a != b ? a > b : left.z.imag() > right.z.imag();
  });
  const Eigen::MatrixXd at_rest = Eigen::MatrixXd::Identity(outputs, outputs) - of_outputs;
  const Eigen::ColPivHouseholderQR<Eigen::MatrixXd> solver(at_rest);
  local.steady_gain = solver.solve(of_inputs);
  if (solver.maxPivot() == 0.0 || solver.rank() < outputs) {
    local.steady_gain.setConstant(outputs, model.num_inputs(), std::numeric_limits<double>::quiet_NaN());
  }
  return local;
}

std::vector<LocalDynamics> local_dynamics(const DynamicModel& model) {
  const DynamicParts& parts = model.parts();
  std::vector<LocalDynamics> all;
  if (const auto* tree = std::get_if<Model>(&parts.rest)) {
    for (std::size_t p = 0; p < tree->partitions().size(); ++p) {
      const Partition& partition = tree->partitions()[p];
      int number = 0;
      for (const Leaf& leaf : tree->leaves(static_cast<Eigen::Index>(p))) {
        const std::string of_output =
            tree->partitions().size() > 1 ? " of " + parts.outputs[partition.outputs.front()].name : "";
        all.push_back(dynamics_at(model, mean_of_leaf(*tree, partition.nodes[leaf.node]),
                                  fmt::format("leaf {}{}", ++number, of_output)));
      }
    }
    return all;
  }
  const bool is_linear = std::holds_alternative<std::monostate>(parts.rest) &&
                         std::ranges::all_of(parts.polynomial.terms, [](const auto& term) { return term.size() < 2; });
  const Signal& first = parts.outputs.front();
  if (is_linear || adds_up(parts.lags, 0))
    return {dynamics_at(model, at_rest(model, 0.5 * (first.low + first.high)), "everywhere")};
  for (const double value : {first.low, 0.5 * (first.low + first.high), first.high}) {
    all.push_back(dynamics_at(model, at_rest(model, value), fmt::format("{} = {:.4g}", first.name, value)));
  }
  return all;
}

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
