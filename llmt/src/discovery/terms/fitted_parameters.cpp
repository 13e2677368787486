#include "discovery/terms/fitted_parameters.hpp"

#include <fmt/format.h>

#include <Eigen/QR>
#include <algorithm>
#include <boost/math/distributions/chi_squared.hpp>
#include <boost/math/distributions/normal.hpp>
#include <cmath>
#include <set>

#include "discovery/recording/refuse.hpp"

namespace llmt::discovery {
namespace {

// Columns of unit length that were accepted, and the parameters that they belong to.
struct Accepted {
  Eigen::MatrixXd columns;
  std::vector<std::size_t> sums;
};

// 1 is not written, and rounding of derivatives is not shown.
std::string factor_text(double factor) {
  constexpr double rounding = 1e-3;
  const double size = std::abs(factor);
  return (factor < 0.0 ? " - " : " + ") + (std::abs(size - 1.0) < rounding ? "" : fmt::format("{:.3g} ", size));
}

FittedParameter described(const ParameterFits& fits, const ParameterSum& sum, double false_alarm_rate) {
  const std::vector<Parameter>& parameters = fits.model.parameters();
  FittedParameter fitted;
  fitted.name = parameters[sum.first].name;
  fitted.unit = parameters[sum.first].unit;
  fitted.parts = {fitted.name};
  fitted.nominal = fits.nominal(sum.first);
  for (const ParameterSum::Part& part : sum.others) {
    fitted.name += factor_text(part.factor) + parameters[part.parameter].name;
    fitted.parts.push_back(parameters[part.parameter].name);
    fitted.nominal += part.factor * fits.nominal(part.parameter);
  }
  fitted.change = fits.beside.parameters(sum.first) - fits.nominal(sum.first);
  fitted.alone = fits.alone.parameters(sum.first) - fits.nominal(sum.first);
  fitted.standard_error = fits.beside.parameter_errors(sum.first);
  fitted.changed = is_beyond_chance(fitted, false_alarm_rate);
  return fitted;
}

// sum_o ln(RSS_o at the nominal values / RSS_o fitted), with the terms found beside both.
double log_ratio(const ParameterFits& fits) {
  constexpr double least = 1e-24;  // what counts as an exact fit
  const Eigen::Index d = fits.data.measured.cols();
  const Eigen::VectorXd before = scaled_residuals(fits.model, fits.data, fits.nominal, fits.beside.placed);
  const Eigen::VectorXd after = scaled_residuals(fits.model, fits.data, fits.beside.parameters, fits.beside.placed);
  double sum = 0.0;
  for (Eigen::Index o = 0; o < d; ++o) {
    const double nominal = before(Eigen::seq(o, Eigen::last, d)).squaredNorm();
    const double fitted = after(Eigen::seq(o, Eigen::last, d)).squaredNorm();
    if (nominal > 0.0) sum += std::log(nominal / std::max(fitted, least * nominal));
  }
  return sum;
}

}  // namespace

DistinctParameters distinct_parameters(const Eigen::MatrixXd& jacobian, std::vector<Parameter>& parameters) {
  // As SearchOptions::absorbed_tolerance: what less of a column lies outside of the others is not told from them.
  constexpr double dependent = 1e-3;
  constexpr double material = 1e-3;  // share of a column in a sum
  constexpr double nothing = 1e-12;  // in scales, against the parameter that acts most
  std::vector<std::size_t> free;
  for (std::size_t k = 0; k < parameters.size(); ++k) {
    if (parameters[k].free) free.push_back(k);
  }
  double most = 0.0;
  for (std::size_t j = 0; j < free.size(); ++j) {
    most = std::max(most, jacobian.col(j).norm() * parameters[free[j]].scale);
  }
  DistinctParameters distinct;
  std::vector<ParameterSum>& sums = distinct.sums;
  Accepted accepted{Eigen::MatrixXd(jacobian.rows(), 0), {}};
  std::vector<double> lengths;
  for (std::size_t j = 0; j < free.size(); ++j) {
    Parameter& parameter = parameters[free[j]];
    const double length = jacobian.col(j).norm();
    if (parameter.prior_sigma) {
      sums.push_back({free[j], {}});
      continue;
    }
    if (!(length * parameter.scale > nothing * most)) {
      parameter.free = false;
      distinct.without_effect.push_back(free[j]);
      continue;
    }
    const Eigen::VectorXd column = jacobian.col(j) / length;
    if (accepted.columns.cols() > 0) {
      const Eigen::VectorXd shares = accepted.columns.householderQr().solve(column);
      if ((column - accepted.columns * shares).norm() < dependent) {
        parameter.free = false;
        for (Eigen::Index a = 0; a < shares.size(); ++a) {
          if (std::abs(shares(a)) < material) continue;
          sums[accepted.sums[a]].others.push_back({free[j], shares(a) * length / lengths[a]});
        }
        continue;
      }
    }
    accepted.columns.conservativeResize(Eigen::NoChange, accepted.columns.cols() + 1);
    accepted.columns.rightCols(1) = column;
    accepted.sums.push_back(sums.size());
    lengths.push_back(length);
    sums.push_back({free[j], {}});
  }
  return distinct;
}

bool is_beyond_chance(const FittedParameter& fitted, double false_alarm_rate) {
  const boost::math::normal_distribution<> normal;
  const double z = boost::math::quantile(boost::math::complement(normal, 0.5 * false_alarm_rate));
  return std::abs(fitted.change) > z * fitted.standard_error;
}

void describe_parameters(const ParameterFits& fits, const DistinctParameters& distinct, double false_alarm_rate,
                         Missing& missing) {
  for (const std::size_t k : distinct.without_effect) {
    missing.not_testable.push_back({"parameter " + missing.parameters[k].name, "no row depends on it"});
  }
  const std::vector<ParameterSum>& sums = distinct.sums;
  if (sums.empty()) return;
  for (const ParameterSum& sum : sums) missing.fitted_parameters.push_back(described(fits, sum, false_alarm_rate));
  const auto k = static_cast<double>(sums.size());
  const auto d = static_cast<double>(fits.data.measured.cols());
  const auto n = static_cast<double>(fits.data.measured.rows());
  const double ratio = log_ratio(fits);
  // In time, samples count as far as they are independent.
  const double independent = fits.data.independent_share * n;
  missing.parameter_gain = independent * ratio - k * std::log(independent * d);
  // Beside n values of an output, k / d parameters were fitted to it.
  const double statistic = std::max(0.0, (independent - k / d) * ratio);
  const double chance = boost::math::cdf(boost::math::complement(boost::math::chi_squared(k), statistic));
  missing.parameters_explain = missing.parameter_gain > 0.0 && chance < false_alarm_rate;
}

}  // namespace llmt::discovery
