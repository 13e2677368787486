#include "discovery/answer/term_fit.hpp"

#include <fmt/format.h>

#include <Eigen/QR>
#include <algorithm>
#include <cmath>
#include <limits>

#include "discovery/recording/noise.hpp"
#include "discovery/recording/refuse.hpp"
#include "discovery/search/workspace.hpp"
#include "llmt/discovery/least_squares.hpp"

namespace llmt::discovery {
namespace {

// The places of the parameters of the joint fit.
struct Layout {
  std::vector<Parameter> parameters;
  std::size_t own = 0;
};

Layout layout_of(const TermModel& model, const TermData& data, const Eigen::VectorXd& start,
                 const std::vector<PlacedTerm>& placed, bool constants_are_free) {
  Layout layout{model.parameters(), model.parameters().size()};
  for (std::size_t k = 0; k < layout.own; ++k) layout.parameters[k].value = start(k);
  const Eigen::MatrixXd& simulated = model.simulated(start);
  for (std::size_t t = 0; t < placed.size(); ++t) {
    const ModelTerm& term = model.terms()[placed[t].term];
    const Eigen::MatrixXd columns = model.columns(placed[t], simulated);
    const double sigma = data.sigma(placed[t].output);
    for (Eigen::Index k = 0; k < columns.cols(); ++k) {
      const double rms = columns.col(k).norm() / std::sqrt(static_cast<double>(columns.rows()));
      Parameter parameter;
      parameter.name = fmt::format("term{}.coefficient{}", t, k);
      parameter.value = placed[t].coefficients(k);
      parameter.scale = rms > 0.0 ? sigma / rms : 1.0;
      parameter.free = !placed[t].is_held(k);
      layout.parameters.push_back(std::move(parameter));
    }
    for (std::size_t c = 0; c < term.constants.size(); ++c) {
      Parameter parameter;
      parameter.name = fmt::format("term{}.constant{}", t, c);
      parameter.value = placed[t].constants(c);
      parameter.scale = 0.1 * spacing(term.constants[c].tried, parameter.value);
      parameter.free = constants_are_free && term.constants[c].smooth;
      layout.parameters.push_back(std::move(parameter));
    }
  }
  return layout;
}

std::vector<PlacedTerm> unpack(const TermModel& model, const std::vector<PlacedTerm>& placed,
                               const Eigen::VectorXd& values, std::size_t own) {
  std::vector<PlacedTerm> result = placed;
  Eigen::Index next = own;
  for (PlacedTerm& term : result) {
    term.coefficients = values.segment(next, term.coefficients.size());
    next += term.coefficients.size();
    term.constants = within_range(model.terms()[term.term], values.segment(next, term.constants.size()));
    next += term.constants.size();
  }
  return result;
}

// A constant that left the values tried is no longer what was found.
bool within_tried(const TermModel& model, const std::vector<PlacedTerm>& before, const std::vector<PlacedTerm>& after) {
  for (std::size_t t = 0; t < after.size(); ++t) {
    const ModelTerm& term = model.terms()[after[t].term];
    for (std::size_t c = 0; c < term.constants.size(); ++c) {
      const std::vector<double>& tried = term.constants[c].tried;
      const double start = before[t].constants(c);
      const double value = after[t].constants(c);
      constexpr double far = 5.0;  // steps
      const double step = spacing(tried, start);
      if (value < tried.front() - step || value > tried.back() + step || std::abs(value - start) > far * step)
        return false;
    }
  }
  return true;
}

// Derivatives of the residuals: by coefficients the columns, by constants differences of the term's own columns, by
// parameters of the simulation differences of everything.
Eigen::MatrixXd jacobian_of(const TermModel& model, const TermData& data, const Layout& layout,
                            const std::vector<PlacedTerm>& placed, const Eigen::VectorXd& values) {
  const double relative_step = std::cbrt(std::numeric_limits<double>::epsilon());
  const auto own = static_cast<Eigen::Index>(layout.own);
  const std::vector<PlacedTerm> here = unpack(model, placed, values, layout.own);
  Eigen::MatrixXd jacobian = Eigen::MatrixXd::Zero(data.measured.size(), values.size());
  const auto step_of = [&](Eigen::Index k) {
    return relative_step * std::max(std::abs(values(k)), layout.parameters[k].scale);
  };
  for (Eigen::Index k = 0; k < own; ++k) {
    if (!layout.parameters[k].free) continue;
    Eigen::VectorXd moved = values.head(own);
    moved(k) = values(k) + step_of(k);
    const double upper = moved(k);
    const Eigen::VectorXd above = scaled_residuals(model, data, moved, here);
    moved(k) = values(k) - step_of(k);
    jacobian.col(k) = (above - scaled_residuals(model, data, moved, here)) / (upper - moved(k));
  }
  const Eigen::MatrixXd simulated = model.simulated(values.head(own));
  Eigen::Index next = own;
  for (const PlacedTerm& term : here) {
    const Eigen::Index count = term.coefficients.size();
    jacobian.middleCols(next, count) = -stacked_signature(model, data, term, simulated);
    next += count;
    for (Eigen::Index c = 0; c < term.constants.size(); ++c, ++next) {
      if (!layout.parameters[next].free) continue;
      PlacedTerm moved = term;
      moved.constants(c) = term.constants(c) + step_of(next);
      const double upper = moved.constants(c);
      const Eigen::VectorXd above = stacked_signature(model, data, moved, simulated) * term.coefficients;
      moved.constants(c) = term.constants(c) - step_of(next);
      const Eigen::VectorXd below = stacked_signature(model, data, moved, simulated) * term.coefficients;
      jacobian.col(next) = (below - above) / (upper - moved.constants(c));
    }
  }
  return jacobian;
}

// The factors on standard errors that correlated noise makes. The estimate of parameter j is sum_i z_ij e_i, Z the
// transposed pseudo-inverse of the Jacobian; its variance is inflated output by output.
Eigen::VectorXd error_factors(const TermData& data, const LeastSquaresProblem& problem, const SolverResult& result) {
  Eigen::VectorXd factors = Eigen::VectorXd::Ones(std::ssize(problem.parameters));
  const std::vector<std::vector<double>> correlations = correlations_of(data, result.residuals);
  if (std::ranges::all_of(correlations, &std::vector<double>::empty)) return factors;
  std::vector<Eigen::Index> free;
  for (Eigen::Index k = 0; k < std::ssize(problem.parameters); ++k) {
    if (problem.parameters[k].free) free.push_back(k);
  }
  if (free.empty()) return factors;
  Eigen::MatrixXd jacobian = problem.jacobian(result.values)(Eigen::all, free);
  for (std::size_t j = 0; j < free.size(); ++j) jacobian.col(j) *= problem.parameters[free[j]].scale;
  const Eigen::MatrixXd influences = jacobian.completeOrthogonalDecomposition().pseudoInverse().transpose();
  const Eigen::Index d = data.measured.cols();
  for (std::size_t j = 0; j < free.size(); ++j) {
    double inflated = 0.0;
    for (Eigen::Index o = 0; o < d; ++o) {
      const Eigen::VectorXd own = influences.col(j)(Eigen::seqN(o, data.samples.size(), d));
      inflated += own.squaredNorm() * variance_inflation(correlations[o], own, data.stretches);
    }
    const double plain = influences.col(j).squaredNorm();
    if (plain > 0.0) factors(free[j]) = std::sqrt(inflated / plain);
  }
  return factors;
}

}  // namespace

Eigen::VectorXd weights_of(const TermData& data, Eigen::Index output) {
  if (!data.weights) return Eigen::VectorXd::Ones(data.samples.size());
  return means_of_filtered(data.weights->col(output), data.samples);
}

TermData without_samples(const TermData& data, const std::vector<std::size_t>& left_out) {
  std::vector<Eigen::Index> kept;
  for (Eigen::Index i = 0; i < data.samples.size(); ++i) {
    if (std::ranges::find(left_out, static_cast<std::size_t>(i)) == left_out.end()) kept.push_back(i);
  }
  TermData result{
      {}, data.measured(kept, Eigen::all), data.sigma, {}, data.independent_share, data.weights, data.known_variances};
  for (const Eigen::Index i : kept) {
    result.samples.add(data.samples, i);
    if (!data.stretches.empty()) result.stretches.push_back(data.stretches[i]);
  }
  return result;
}

Eigen::VectorXd scaled_residuals(const TermModel& model, const TermData& data, const Eigen::VectorXd& parameters,
                                 const std::vector<PlacedTerm>& placed) {
  const Eigen::MatrixXd& simulated = model.simulated(parameters);
  Eigen::MatrixXd predicted = means(simulated, data.samples);
  for (const PlacedTerm& term : placed) {
    predicted.col(term.output) += model.means_of(term, simulated, data.samples) * term.coefficients;
  }
  const Eigen::Index d = data.measured.cols();
  Eigen::VectorXd residuals(data.measured.size());
  for (Eigen::Index o = 0; o < d; ++o) {
    residuals(Eigen::seqN(o, data.measured.rows(), d)) =
        (data.measured.col(o) - predicted.col(o)).cwiseProduct(weights_of(data, o)) / data.sigma(o);
  }
  return residuals;
}

Eigen::MatrixXd baseline_jacobian(const TermModel& model, const TermData& data, const Eigen::VectorXd& parameters,
                                  const std::vector<PlacedTerm>& placed) {
  LeastSquaresProblem problem;
  problem.parameters = model.parameters();
  problem.residual = [&](const Eigen::VectorXd& values) { return scaled_residuals(model, data, values, placed); };
  std::vector<Eigen::Index> free;
  for (std::size_t k = 0; k < problem.parameters.size(); ++k) {
    if (problem.parameters[k].free) free.push_back(k);
  }
  if (free.empty()) return Eigen::MatrixXd(data.measured.size(), 0);
  return -difference_jacobian(problem, parameters)(Eigen::all, free);
}

Eigen::MatrixXd stacked_signature(const TermModel& model, const TermData& data, const PlacedTerm& placed,
                                  const Eigen::MatrixXd& simulated) {
  const Eigen::MatrixXd of_samples = model.means_of(placed, simulated, data.samples);
  const Eigen::Index d = data.measured.cols();
  Eigen::MatrixXd signature = Eigen::MatrixXd::Zero(data.measured.size(), of_samples.cols());
  const Eigen::VectorXd scale = weights_of(data, placed.output) / data.sigma(placed.output);
  signature(Eigen::seqN(placed.output, data.measured.rows(), d), Eigen::all) = scale.asDiagonal() * of_samples;
  return signature;
}

std::vector<std::vector<double>> correlations_of(const TermData& data, const Eigen::VectorXd& residuals) {
  const Eigen::Index d = data.measured.cols();
  std::vector<std::vector<double>> correlations(d);
  if (data.stretches.empty()) return correlations;
  for (Eigen::Index o = 0; o < d; ++o) {
    const Eigen::VectorXd own = residuals(Eigen::seqN(o, data.samples.size(), d));
    correlations[o] = autocorrelation(own, data.stretches, std::vector<bool>(own.size(), true));
  }
  return correlations;
}

void hold(const TermModel& model, const TermData& data, const Eigen::VectorXd& parameters,
          std::vector<PlacedTerm>& placed) {
  const Eigen::MatrixXd by_parameters = baseline_jacobian(model, data, parameters, {});
  const Eigen::MatrixXd own_range = range_basis(by_parameters, absorbed_share);
  const Eigen::MatrixXd simulated = model.simulated(parameters);
  for (PlacedTerm& term : placed) {
    const bool whole = model.terms()[term.term].whole;
    term.held.assign(term.coefficients.size(), whole);
    if (whole) term.coefficients.setOnes();
    if (whole || own_range.cols() == 0) continue;
    Eigen::MatrixXd range = own_range;
    const Eigen::MatrixXd columns = stacked_signature(model, data, term, simulated);
    for (Eigen::Index k = 0; k < columns.cols(); ++k) {
      Eigen::VectorXd outside = columns.col(k) - range * (range.transpose() * columns.col(k));
      outside -= range * (range.transpose() * outside);
      if (outside.norm() < absorbed_share * columns.col(k).norm()) {
        term.held[k] = true;
        term.coefficients(k) = 0.0;
        continue;
      }
      range.conservativeResize(Eigen::NoChange, range.cols() + 1);
      range.rightCols(1) = outside.normalized();
    }
  }
}

TermFit fit_terms(const TermModel& model, const TermData& data, const Eigen::VectorXd& start,
                  const std::vector<PlacedTerm>& placed) {
  const Eigen::MatrixXd simulated = model.simulated(start);
  const Eigen::Index bad = first_bad_row(simulated);
  if (bad < simulated.rows()) refuse("find_missing", fmt::format("the simulation is not finite at row {}", bad + 1));
  for (const bool constants_are_free : {true, false}) {
    const Layout layout = layout_of(model, data, start, placed, constants_are_free);
    const Eigen::Index own = layout.own;
    LeastSquaresProblem problem;
    problem.parameters = layout.parameters;
    problem.residual = [&](const Eigen::VectorXd& values) {
      return scaled_residuals(model, data, values.head(own), unpack(model, placed, values, layout.own));
    };
    problem.jacobian = [&](const Eigen::VectorXd& values) { return jacobian_of(model, data, layout, placed, values); };
    SolverResult result = solve(problem);
    if (!data.stretches.empty()) {
      result.standard_errors.array() *= error_factors(data, problem, result).array();
    }
    TermFit fit{result.values.head(own),
                result.standard_errors.head(own),
                unpack(model, placed, result.values, layout.own),
                {}};
    if (constants_are_free && !within_tried(model, placed, fit.placed)) continue;
    Eigen::Index next = own;
    for (const PlacedTerm& term : placed) {
      const Eigen::Index k = term.coefficients.size() + term.constants.size();
      Eigen::VectorXd errors = result.standard_errors.segment(next, k);
      const std::vector<TermConstant>& constants = model.terms()[term.term].constants;
      for (std::size_t c = 0; c < constants.size(); ++c) {
        const Eigen::Index place = term.coefficients.size() + c;
        if (!constants_are_free || !constants[c].smooth) errors(place) = std::numeric_limits<double>::quiet_NaN();
      }
      for (Eigen::Index c = 0; c < term.coefficients.size(); ++c) {
        if (term.is_held(c)) errors(c) = std::numeric_limits<double>::quiet_NaN();
      }
      fit.errors.push_back(errors);
      next += k;
    }
    return fit;
  }
  return {};
}

}  // namespace llmt::discovery
