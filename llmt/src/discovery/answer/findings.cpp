#include "discovery/answer/findings.hpp"

#include <fmt/format.h>

#include <Eigen/QR>
#include <algorithm>
#include <boost/math/distributions/chi_squared.hpp>
#include <boost/math/distributions/normal.hpp>
#include <cmath>

#include "discovery/terms/term_model.hpp"

namespace llmt::discovery {
namespace {

std::string unit_of(const std::string& output, const std::string& per) {
  if (per.empty()) return output;
  if (per.starts_with("simulated")) return output + "/" + output + per.substr(std::string("simulated").size());
  return output + "/" + per;
}

}  // namespace

FoundTerm described(const TermModel& model, const PlacedTerm& placed, const Eigen::VectorXd& errors) {
  const ModelTerm& term = model.terms()[placed.term];
  FoundTerm found;
  found.term = placed.term;
  found.family = term.family;
  found.location = term.location;
  found.output = model.outputs()[placed.output];
  found.output_index = placed.output;
  found.formula = term.formula;
  found.inputs = term.inputs;
  found.generic = term.generic;
  found.code = term.code;
  found.inner_state = term.inner_state;
  found.regime = term.regime;
  found.shown_by = term.shown_by;
  found.whole = term.whole;
  for (std::size_t k = 0; k < term.coefficients.size() && !term.whole; ++k) {
    const std::string unit = term.unit.empty() ? unit_of(found.output, term.per) : k == 0 ? term.unit : "";
    found.values.push_back({.name = term.coefficients[k], .unit = unit});
  }
  for (const TermConstant& constant : term.constants) {
    found.values.push_back({.name = constant.name, .unit = constant.unit});
  }
  set_estimates(placed, errors, found);
  return found;
}

void set_estimates(const PlacedTerm& placed, const Eigen::VectorXd& errors, FoundTerm& found) {
  found.coefficients = placed.coefficients;
  found.constants = placed.constants;
  Eigen::VectorXd all(placed.coefficients.size() + placed.constants.size());
  all << placed.coefficients, placed.constants;
  const Eigen::Index first = found.whole ? placed.coefficients.size() : 0;
  for (std::size_t k = 0; k < found.values.size(); ++k) {
    found.values[k].value = all(first + static_cast<Eigen::Index>(k));
    found.values[k].standard_error = errors(first + static_cast<Eigen::Index>(k));
  }
}

std::string option_label(const TermModel& model, const PlacedTerm& option) {
  std::string text = model.label(option);
  const std::vector<TermConstant>& constants = model.terms()[option.term].constants;
  if (!constants.empty()) text += fmt::format(" ({} = {:.4g})", constants.front().name, option.constants(0));
  return text;
}

void describe_findings(const TermModel& model, const Settled& settled, Missing& missing) {
  std::size_t next = 0;
  for (const Finding& finding : settled.verdict.findings) {
    for (const FindingTerm& term : finding.terms) {
      FoundTerm found = described(model, settled.fit.placed[next], settled.fit.errors[next]);
      ++next;
      found.share = term.share;
      for (const Rival& rival : finding.rivals) {
        RivalTerms terms{.what = {}, .inputs = {}, .exact = rival.exact};
        for (const std::size_t a : rival.candidates) {
          terms.what += (terms.what.empty() ? "" : " + ") + missing.candidates[a];
          for (const std::string& input : model.terms()[settled.question.options[a].term].inputs) {
            if (std::ranges::find(terms.inputs, input) == terms.inputs.end()) terms.inputs.push_back(input);
          }
        }
        found.rivals.push_back(std::move(terms));
      }
      missing.found.push_back(std::move(found));
    }
  }
  std::ranges::stable_sort(missing.found, [](const FoundTerm& a, const FoundTerm& b) {
    return a.generic != b.generic ? b.generic : a.share > b.share;
  });
}

void describe_limits(const Settled& settled, const TermData& data, Missing& missing) {
  const auto n = static_cast<double>(data.samples.size());
  for (std::size_t a = 0; a < settled.question.options.size(); ++a) {
    const EffectCandidate& candidate = settled.question.candidates[a];
    const Sensitivity& own = settled.verdict.sensitivity[a];
    const bool found = std::ranges::any_of(settled.verdict.findings, [&](const Finding& finding) {
      return std::ranges::any_of(finding.terms, [&](const FindingTerm& term) { return term.candidate == a; });
    });
    if (candidate.generic || found) continue;
    if (own.absorbed) {
      missing.not_testable.push_back({missing.candidates[a], candidate.signature.norm() > 0.0
                                                                 ? "the simulation's own parameters imitate it"
                                                                 : "it is zero at every row"});
      continue;
    }
    Eigen::Index k = 0;
    const double visible = own.visible.maxCoeff(&k);
    const double sigma = data.sigma(settled.question.options[a].output);
    missing.visible.push_back(
        {missing.candidates[a], visible, visible * candidate.signature.col(k).norm() / std::sqrt(n) * sigma});
  }
  std::ranges::stable_sort(missing.visible, {}, &VisibleTerm::rms);
}

Gap gap_of(std::string output, const Eigen::VectorXd& nominal, const Eigen::VectorXd& before,
           const Eigen::VectorXd& after, double noise_floor) {
  // A row that only the terms found throw off is no outlier.
  Gap gap{.output = std::move(output),
          .before = 0.0,
          .after = 0.0,
          .noise_floor = noise_floor,
          .outliers = 0,
          .nominal = 0.0};
  Eigen::Index used = 0;
  for (Eigen::Index i = 0; i < before.size(); ++i) {
    if (std::min(std::abs(before(i)), std::abs(after(i))) > far_off * noise_floor) {
      ++gap.outliers;
      continue;
    }
    gap.nominal += nominal(i) * nominal(i);
    gap.before += before(i) * before(i);
    gap.after += after(i) * after(i);
    ++used;
  }
  if (static_cast<double>(gap.outliers) > largest_share_of_outliers * static_cast<double>(before.size())) {
    gap.nominal = nominal.squaredNorm();
    gap.before = before.squaredNorm();
    gap.after = after.squaredNorm();
    gap.outliers = 0;
    used = before.size();
  }
  gap.nominal = std::sqrt(gap.nominal / static_cast<double>(used));
  gap.before = std::sqrt(gap.before / static_cast<double>(used));
  gap.after = std::sqrt(gap.after / static_cast<double>(used));
  return gap;
}

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
      if ((column - accepted.columns * shares).norm() < absorbed_share) {
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
