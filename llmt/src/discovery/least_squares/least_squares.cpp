#include "llmt/discovery/least_squares.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "discovery/least_squares/check.hpp"
#include "discovery/least_squares/linearisation.hpp"

namespace llmt::discovery {
namespace {

constexpr double largest_damping = 1e12;
constexpr double negligible_damping = 1e-14;
// A relative decrease of the sum of squares below this is lost in its own rounding: residuals are often a millionth of
// what they are the difference of.
constexpr double resolvable_decrease = 1e-10;

// The problem as the iteration sees it: free columns, scaled, weighted, priors as extra rows.
class Solver {
 public:
  Solver(const LeastSquaresProblem& problem, const SolverOptions& options);
  SolverResult run();

 private:
  Eigen::VectorXd weighted(const Eigen::VectorXd& residuals, const Eigen::VectorXd& values) const;
  Eigen::VectorXd residuals_at(const Eigen::VectorXd& values) const;
  Eigen::MatrixXd jacobian_at(const Eigen::VectorXd& values) const;
  Linearisation linearise_here();
  bool finished_at(const Linearisation& linear);
  bool advance(const Linearisation& linear);
  bool try_step(const Eigen::VectorXd& scaled_step);
  void stop(Termination termination, std::string reason);
  void estimate_sigma(const Eigen::MatrixXd& whitened);
  void describe_uncertainty(const Linearisation& linear);

  const LeastSquaresProblem& problem_;
  const SolverOptions& options_;
  std::vector<Eigen::Index> free_;
  std::vector<Eigen::Index> prior_;  // positions within free_
  Eigen::VectorXd start_;
  Eigen::VectorXd scales_;  // of the free parameters
  Eigen::VectorXd values_;
  Eigen::VectorXd residuals_;
  Eigen::VectorXd weighted_;
  Eigen::MatrixXd jacobian_;  // free columns, own units, not weighted
  double damping_;
  bool met_non_finite_ = false;
  SolverResult result_;
};

Solver::Solver(const LeastSquaresProblem& problem, const SolverOptions& options)
    : problem_(problem), options_(options), damping_(options.damping) {
  check(options);
  check(problem.parameters);
  if (!problem.residual) refuse_to_solve("the problem has no residual function");
  const auto count = std::ssize(problem.parameters);
  start_.resize(count);
  std::vector<double> scales;
  for (Eigen::Index k = 0; k < count; ++k) {
    const Parameter& p = problem.parameters[k];
    start_(k) = p.value;
    if (!p.free) continue;
    if (p.prior_sigma) prior_.push_back(std::ssize(free_));
    free_.push_back(k);
    scales.push_back(p.scale);
  }
  scales_ = Eigen::Map<const Eigen::VectorXd>(scales.data(), std::ssize(scales));
  values_ = start_;
  residuals_ = problem.residual(values_);
  const Eigen::Index weights = problem.weights.size();
  if (weights != 0 && weights != residuals_.size()) {
    refuse_to_solve(fmt::format("weights has {} entries but there are {} residuals", weights, residuals_.size()));
  }
  if (weights != 0 && !(problem.weights.allFinite() && problem.weights.minCoeff() >= 0.0)) {
    refuse_to_solve("weights must be finite and >= 0");
  }
  for (Eigen::Index i = 0; i < residuals_.size(); ++i) {
    if (!std::isfinite(residuals_(i)))
      refuse_to_solve(fmt::format("residual {} is {} at the start values", i, residuals_(i)));
  }
  weighted_ = weighted(residuals_, values_);
}

Eigen::VectorXd Solver::weighted(const Eigen::VectorXd& residuals, const Eigen::VectorXd& values) const {
  const Eigen::Index n = residuals.size();
  Eigen::VectorXd rows(n + std::ssize(prior_));
  rows.head(n) = residuals;
  if (problem_.weights.size() != 0) rows.head(n).array() *= problem_.weights.array();
  for (std::size_t i = 0; i < prior_.size(); ++i) {
    const Eigen::Index k = free_[prior_[i]];
    const Parameter& parameter = problem_.parameters[k];
    rows(n + i) = (values(k) - parameter.prior_value.value_or(parameter.value)) / *parameter.prior_sigma;
  }
  return rows;
}

Eigen::VectorXd Solver::residuals_at(const Eigen::VectorXd& values) const {
  Eigen::VectorXd residuals = problem_.residual(values);
  if (residuals.size() != residuals_.size()) {
    refuse_to_solve(
        fmt::format("the residual function returned {} rows, then {}", residuals_.size(), residuals.size()));
  }
  return residuals;
}

Eigen::MatrixXd Solver::jacobian_at(const Eigen::VectorXd& values) const {
  const Eigen::MatrixXd all = evaluate_jacobian(problem_, values);
  if (all.rows() != residuals_.size() || all.cols() != start_.size()) {
    refuse_to_solve(fmt::format("the Jacobian is {} x {}, expected {} x {}", all.rows(), all.cols(), residuals_.size(),
                                start_.size()));
  }
  Eigen::MatrixXd columns(all.rows(), std::ssize(free_));
  for (std::size_t i = 0; i < free_.size(); ++i) columns.col(i) = all.col(free_[i]);
  return columns;
}

Linearisation Solver::linearise_here() {
  const Eigen::Index n = residuals_.size();
  Eigen::MatrixXd matrix = Eigen::MatrixXd::Zero(weighted_.size(), scales_.size());
  matrix.topRows(n) = jacobian_ * scales_.asDiagonal();
  if (problem_.weights.size() != 0) matrix.topRows(n).array().colwise() *= problem_.weights.array();
  for (std::size_t i = 0; i < prior_.size(); ++i) {
    const Eigen::Index column = prior_[i];
    const Eigen::Index k = free_[column];
    matrix(n + i, column) = scales_(column) / *problem_.parameters[k].prior_sigma;
  }
  return linearise(matrix, weighted_, options_.rank_tolerance);
}

void Solver::stop(Termination termination, std::string reason) {
  result_.termination = termination;
  result_.reason = std::move(reason);
}

// The test is made with the undamped step, whatever the damping: a damped step is small for other reasons than a
// minimum.
bool Solver::finished_at(const Linearisation& linear) {
  if (linear.rank == 0) {
    stop(Termination::no_information, "no free parameter changes any residual");
    return true;
  }
  const double norm = weighted_.norm();
  const double removable = linear.removable_norm();
  if (removable <= options_.gradient_tolerance * norm) {
    stop(Termination::converged, fmt::format("a further step would remove {:.1e} of {:.6g}", removable, norm));
    return true;
  }
  const double step = linear.step(0.0).cwiseAbs().maxCoeff();
  if (step <= options_.step_tolerance) {
    stop(Termination::converged, fmt::format("the next step is {:.1e} parameter scales", step));
    return true;
  }
  return false;
}

// Takes the step if the deviations decrease.
bool Solver::try_step(const Eigen::VectorXd& scaled_step) {
  Eigen::VectorXd values = values_;
  for (std::size_t i = 0; i < free_.size(); ++i) {
    values(free_[i]) += scales_(i) * scaled_step(i);
  }
  ++result_.iterations;
  Eigen::VectorXd residuals = residuals_at(values);
  Eigen::VectorXd rows = weighted(residuals, values);
  met_non_finite_ = !rows.allFinite();
  if (met_non_finite_ || !(rows.squaredNorm() < weighted_.squaredNorm())) return false;
  values_ = std::move(values);
  residuals_ = std::move(residuals);
  weighted_ = std::move(rows);
  result_.residual_norms.push_back(weighted_.norm());
  return true;
}

// One accepted step, or false with the reason to stop.
bool Solver::advance(const Linearisation& linear) {
  const double norm = weighted_.norm();
  while (result_.iterations < options_.max_iterations) {
    if (try_step(linear.step(damping_))) {
      damping_ = damping_ < negligible_damping ? 0.0 : 0.1 * damping_;
      return true;
    }
    const double removable = linear.removable_norm() / norm;
    if (!met_non_finite_ && removable * removable <= resolvable_decrease) {
      stop(Termination::converged, "no step decreases the deviations further, within rounding");
      return false;
    }
    if (options_.damping == 0.0 || damping_ > largest_damping) {
      const Termination failure = met_non_finite_           ? Termination::non_finite
                                  : options_.damping == 0.0 ? Termination::diverged
                                                            : Termination::stalled;
      stop(failure, met_non_finite_ ? "the step leads to residuals that are not finite"
                    : failure == Termination::diverged
                        ? fmt::format("the deviations grew at step {}, from {:.6g}", result_.iterations, norm)
                        : fmt::format("no damping decreases the deviations, {:.6g}, of which {:.1e} looks removable",
                                      norm, linear.removable_norm()));
      return false;
    }
    damping_ = std::max(10.0 * damping_, options_.damping);
  }
  stop(Termination::max_iterations,
       fmt::format("{} iterations are used up; a further step would remove {:.1e} of {:.6g}", result_.iterations,
                   linear.removable_norm(), weighted_.norm()));
  return false;
}

// The data alone tell the noise: a prior far wider than what the data say is no measurement, although it is a row. The
// parameters that the data determine are the rank less the leverages of the priors, the trace of the hat matrix of the
// data.
void Solver::estimate_sigma(const Eigen::MatrixXd& whitened) {
  const Eigen::Index n = residuals_.size();
  auto determined = static_cast<double>(whitened.cols());
  for (const Eigen::Index column : prior_) {
    const double row = scales_(column) / *problem_.parameters[free_[column]].prior_sigma;
    determined -= row * row * whitened.row(column).squaredNorm();
  }
  const double freedom = static_cast<double>(n) - determined;
  result_.dof = static_cast<Eigen::Index>(std::lround(freedom));
  if (result_.dof > 0) result_.sigma = weighted_.head(n).norm() / std::sqrt(freedom);
}

void Solver::describe_uncertainty(const Linearisation& linear) {
  const Eigen::Index rank = linear.rank;
  std::vector<std::string> names;
  for (const Eigen::Index k : free_) names.push_back(problem_.parameters[k].name);
  result_.unidentifiable = null_combinations(linear, names, scales_);
  result_.singular_values = linear.singular_values;
  result_.rank = rank;
  const Eigen::MatrixXd whitened =
      linear.directions.leftCols(rank) * linear.singular_values.head(rank).cwiseInverse().asDiagonal();
  estimate_sigma(whitened);
  if (rank == 0) return;
  result_.condition_number = linear.singular_values(0) / linear.singular_values(rank - 1);
  const Eigen::VectorXd plain = singular_values_of(jacobian_);
  const Eigen::Index plain_rank = std::min(rank, (plain.array() > options_.rank_tolerance * plain(0)).count());
  if (plain_rank > 0) result_.calibrability = std::pow(plain(0) / plain(plain_rank - 1), 2);

  const double variance = options_.sigma_is_known ? 1.0 : result_.sigma * result_.sigma;
  const Eigen::MatrixXd half = scales_.asDiagonal() * whitened;
  const Eigen::MatrixXd covariance = variance * half * half.transpose();
  const Eigen::VectorXd null_share = linear.directions.rightCols(scales_.size() - rank).rowwise().norm();
  for (std::size_t i = 0; i < free_.size(); ++i) {
    for (std::size_t j = 0; j < free_.size(); ++j) {
      const bool known = null_share(i) < null_entry_tolerance && null_share(j) < null_entry_tolerance;
      result_.covariance(free_[i], free_[j]) = known ? covariance(i, j) : std::numeric_limits<double>::quiet_NaN();
    }
  }
}

SolverResult Solver::run() {
  result_.covariance = Eigen::MatrixXd::Zero(start_.size(), start_.size());
  result_.residual_norms.push_back(weighted_.norm());
  result_.dof = residuals_.size();
  if (free_.empty()) {
    stop(Termination::no_free_parameters, "every parameter is fixed");
    if (result_.dof > 0) result_.sigma = weighted_.norm() / std::sqrt(static_cast<double>(result_.dof));
  } else {
    jacobian_ = jacobian_at(values_);
    if (!jacobian_.allFinite()) refuse_to_solve("the Jacobian is not finite at the start values");
    Linearisation linear = linearise_here();
    while (!finished_at(linear) && advance(linear)) {
      Eigen::MatrixXd jacobian = jacobian_at(values_);
      if (!jacobian.allFinite()) {
        stop(Termination::non_finite, "the Jacobian is not finite");
        break;
      }
      jacobian_ = std::move(jacobian);
      linear = linearise_here();
    }
    describe_uncertainty(linear);
  }
  result_.values = values_;
  result_.residuals = residuals_;
  result_.standard_errors = result_.covariance.diagonal().cwiseSqrt();
  result_.parameters = problem_.parameters;
  for (Eigen::Index k = 0; k < values_.size(); ++k) result_.parameters[k].value = values_(k);
  return std::move(result_);
}

std::size_t index_of(const SolverResult& result, const std::string& name) {
  for (std::size_t k = 0; k < result.parameters.size(); ++k) {
    if (result.parameters[k].name == name) return k;
  }
  throw std::invalid_argument(fmt::format("llmt::discovery::SolverResult: no parameter is named \"{}\"", name));
}

}  // namespace

std::string Combination::names() const {
  std::string text;
  for (const Term& term : terms) text += (text.empty() ? "" : ", ") + term.name;
  return text;
}

const Parameter& SolverResult::parameter(const std::string& name) const { return parameters[index_of(*this, name)]; }

double SolverResult::standard_error(const std::string& name) const { return standard_errors(index_of(*this, name)); }

SolverResult solve(const LeastSquaresProblem& problem, const SolverOptions& options) {
  return Solver(problem, options).run();
}

std::string to_string(Termination termination) {
  switch (termination) {
    case Termination::converged:
      return "converged";
    case Termination::max_iterations:
      return "max_iterations";
    case Termination::diverged:
      return "diverged";
    case Termination::stalled:
      return "stalled";
    case Termination::non_finite:
      return "non_finite";
    case Termination::no_free_parameters:
      return "no_free_parameters";
    case Termination::no_information:
      return "no_information";
  }
  return "unknown";
}

}  // namespace llmt::discovery
