// Errors of the inputs drawn again.
#include <fmt/format.h>

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <utility>

#include "discovery/answer/errors_of_inputs.hpp"
#include "discovery/answer/term_fit.hpp"
#include "discovery/terms/term_model.hpp"
#include "llmt/random.hpp"

namespace llmt::discovery {
namespace {

constexpr int pairs_of_draws = 4;

Eigen::VectorXd stacked(const TermData& data, const Eigen::MatrixXd& of_rows) {
  const Eigen::MatrixXd of_samples = means(of_rows, data.samples);
  const Eigen::Index d = data.measured.cols();
  Eigen::VectorXd all(data.measured.size());
  for (Eigen::Index o = 0; o < d; ++o) {
    all(Eigen::seqN(o, of_samples.rows(), d)) = of_samples.col(o).cwiseProduct(weights_of(data, o)) / data.sigma(o);
  }
  return all;
}

// At an end of its range a constant is held there: what would move it on is left to no other number.
bool is_fitted(const TermModel& model, const PlacedTerm& placed) {
  const ModelTerm& term = model.terms()[placed.term];
  if (term.constants.empty() || !term.constants.front().smooth) return false;
  constexpr double nudge = 1e-9;
  for (const double factor : {1.0 - nudge, 1.0 + nudge}) {
    Eigen::VectorXd moved = placed.constants;
    moved(0) *= factor;
    if (within_range(term, moved)(0) != moved(0)) return false;
  }
  return true;
}

// Places of what is fitted of a term among its coefficients and constants.
std::vector<Eigen::Index> fitted_places(const TermModel& model, const PlacedTerm& placed) {
  std::vector<Eigen::Index> places;
  for (Eigen::Index k = 0; k < placed.coefficients.size(); ++k) {
    if (!placed.is_held(k)) places.push_back(k);
  }
  if (is_fitted(model, placed)) places.push_back(placed.coefficients.size());
  return places;
}

// Derivatives of the stacked prediction by coefficients and smooth constants of the terms.
Eigen::MatrixXd term_jacobian(const TermModel& model, const TermData& data, const TermFit& fit) {
  const Eigen::MatrixXd simulated = model.simulated(fit.parameters);
  std::vector<Eigen::VectorXd> columns;
  for (const PlacedTerm& placed : fit.placed) {
    const Eigen::MatrixXd signature = stacked_signature(model, data, placed, simulated);
    for (Eigen::Index k = 0; k < signature.cols(); ++k) {
      if (!placed.is_held(k)) columns.emplace_back(signature.col(k));
    }
    if (!is_fitted(model, placed)) continue;
    const double step = 1e-3 * spacing(model.terms()[placed.term].constants.front().tried, placed.constants(0));
    PlacedTerm moved = placed;
    moved.constants(0) += step;
    Eigen::VectorXd change = stacked_signature(model, data, moved, simulated) * placed.coefficients;
    moved.constants(0) -= 2.0 * step;
    change -= stacked_signature(model, data, moved, simulated) * placed.coefficients;
    columns.emplace_back(change / (2.0 * step));
  }
  Eigen::MatrixXd all(data.measured.size(), std::ssize(columns));
  for (std::size_t k = 0; k < columns.size(); ++k) all.col(k) = columns[k];
  return all;
}

Eigen::MatrixXd jacobian(const TermModel& model, const TermData& data, const TermFit& fit) {
  const Eigen::MatrixXd own = baseline_jacobian(model, data, fit.parameters, fit.placed);
  const Eigen::MatrixXd terms = term_jacobian(model, data, fit);
  Eigen::MatrixXd all(own.rows(), own.cols() + terms.cols());
  all << own, terms;
  return all;
}

}  // namespace

// The model at inputs with errors once more.
struct InputNoise::Draw {
  explicit Draw(Recording moved) : recording(std::move(moved)) {}

  Recording recording;
  Simulation simulation;
  std::unique_ptr<TermModel> model;
  Eigen::MatrixXd change;    // n x d of the simulation
  Eigen::MatrixXd filtered;  // n x d, `change` through the filter of the log
};

InputNoise::InputNoise(const TermModel& model, const Eigen::MatrixXd& simulated)
    : model_(&model), surrogate_(model.recording().surrogate(simulated)) {
  const Recording& recording = model.recording();
  const Inputs& inputs = recording.inputs();
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> axes(recording.covariance());
  const Eigen::MatrixXd root =
      axes.eigenvectors() * axes.eigenvalues().cwiseMax(0.0).cwiseSqrt().asDiagonal() * axes.eigenvectors().transpose();
  const Eigen::MatrixXd described = surrogate_->predict(inputs.values);
  Random random(1);
  for (int pair = 0; pair < pairs_of_draws; ++pair) {
    Eigen::MatrixXd errors(inputs.values.rows(), inputs.values.cols());
    for (double& value : errors.reshaped()) value = random.normal();
    if (recording.is_filtered()) errors = recording.filter()(errors) / recording.filter().weights().norm();
    errors = errors * root;
    for (const double sign : {1.0, -1.0}) {
      Eigen::MatrixXd moved = inputs.values + sign * errors;
      // Terms such as roots are not defined beyond the inputs.
      for (Eigen::Index j = 0; j < inputs.values.cols(); ++j) {
        const double low = inputs.values.col(j).minCoeff();
        const double high = inputs.values.col(j).maxCoeff();
        moved.col(j) = moved.col(j).cwiseMax(low).cwiseMin(high);
      }
      auto draw = std::make_shared<Draw>(recording.with_values(std::move(moved)));
      draw->change = surrogate_->predict(draw->recording.inputs().values) - described;
      draw->filtered = recording.as_measured(draw->change);
      draw->simulation.parameters = model.parameters();
      draw->simulation.predict = [base = model_, own = draw.get()](const Eigen::MatrixXd&,
                                                                   const Eigen::VectorXd& values) -> Eigen::MatrixXd {
        return base->simulated(values) + own->change;
      };
      draw->model = std::make_unique<TermModel>(draw->simulation, draw->recording, model.outputs(), model.terms());
      draw->model->share(model.shared(), draws_.size() + 1);
      draws_.push_back(std::move(draw));
    }
  }
}

Eigen::VectorXd InputNoise::moment_correction(const TermData& data, const PlacedTerm& placed,
                                              const Eigen::MatrixXd& simulated) const {
  const ModelTerm& term = model_->terms()[placed.term];
  Eigen::VectorXd sum = Eigen::VectorXd::Zero(std::ssize(term.coefficients));
  // (K T)'(K y) = T'(K K y) for a filter K that is the same forwards and backwards, so the term is computed at the rows
  // of the samples alone.
  const bool at_samples = data.samples.is_filtered() && term.inner_state.empty() && !ColumnCache::holds(term);
  for (const std::shared_ptr<const Draw>& draw : draws_) {
    if (at_samples) {
      const Eigen::MatrixXd moved = draw->model->columns_at(placed, simulated + draw->change, data.samples.rows());
      Eigen::VectorXd filtered = draw->filtered.col(placed.output);
      if (data.weights) filtered.array() *= data.weights->col(placed.output).array().square();
      const Eigen::VectorXd twice = means(filtered, data.samples);
      if (moved.allFinite()) sum += moved.transpose() * twice / std::pow(data.sigma(placed.output), 2.0);
      continue;
    }
    const Eigen::MatrixXd moved = stacked_signature(*draw->model, data, placed, simulated + draw->change);
    sum += moved.transpose() * stacked(data, draw->change);
  }
  return sum / static_cast<double>(draws_.size());
}

InputNoise::AddedByErrors InputNoise::added(const TermData& data, const std::vector<PlacedTerm>& placed,
                                            const Eigen::MatrixXd& simulated) const {
  const auto change_by = [&](const TermModel& model, const Eigen::MatrixXd& there) {
    Eigen::VectorXd sum = Eigen::VectorXd::Zero(data.measured.size());
    for (const PlacedTerm& own : placed) sum += stacked_signature(model, data, own, there) * own.coefficients;
    return sum;
  };
  const Eigen::VectorXd as_given = change_by(*model_, simulated);
  AddedByErrors sum;
  for (const std::shared_ptr<const Draw>& draw : draws_) {
    const Eigen::VectorXd moved = change_by(*draw->model, simulated + draw->change) - as_given;
    sum.change += moved.squaredNorm();
    sum.left += moved.squaredNorm() + 2.0 * moved.dot(stacked(data, draw->change));
  }
  const auto draws = static_cast<double>(draws_.size());
  return {sum.change / draws, sum.left / draws};
}

namespace {

// Covariance of estimates, in units of the variance of the samples: the sandwich inverse S inverse', S the sum of the
// squares of the samples' `scores` (Carroll et al. 2006). Errors of an input count where the model is
// steep in it, so samples do not scatter alike. The few that determine a coefficient pull it towards themselves; their
// scores are divided by 1 - h, h the diagonal of the hat matrix (HC3 of MacKinnon and White 1985).
Eigen::MatrixXd sandwich(const Eigen::LDLT<Eigen::MatrixXd>& inverse, const Eigen::MatrixXd& jacobian,
                         const Eigen::MatrixXd& scores, Eigen::Index outputs, double variance) {
  constexpr double most = 0.9;
  const Eigen::MatrixXd solved = (jacobian.transpose() * jacobian).ldlt().solve(jacobian.transpose());
  const Eigen::VectorXd leverage = jacobian.cwiseProduct(solved.transpose()).rowwise().sum();
  Eigen::MatrixXd of_samples = Eigen::MatrixXd::Zero(scores.rows() / outputs, scores.cols());
  for (Eigen::Index i = 0; i < scores.rows(); ++i) {
    of_samples.row(i / outputs) += scores.row(i) / (1.0 - std::min(most, leverage(i)));
  }
  of_samples.rowwise() -= of_samples.colwise().mean().eval();
  const Eigen::MatrixXd squares = of_samples.transpose() * of_samples / variance;
  return inverse.solve(inverse.solve(squares).transpose());
}

}  // namespace

std::vector<std::string> InputNoise::correct(const TermData& data, TermFit& fit) const {
  constexpr int steps = 2;
  std::vector<std::string> beyond;
  std::vector<Eigen::Index> free;
  for (Eigen::Index k = 0; k < std::ssize(model_->parameters()); ++k) {
    if (model_->parameters()[k].free) free.push_back(k);
  }
  TermFit moved = fit;
  std::vector<std::vector<Eigen::Index>> places(fit.placed.size());  // of the last step
  Eigen::VectorXd factors;
  for (int step = 0; step < steps; ++step) {
    const Eigen::MatrixXd own = jacobian(*model_, data, moved);
    if (own.cols() == 0) return beyond;
    const Eigen::VectorXd predicted = stacked(data, model_->predict(moved.parameters, moved.placed));
    const Eigen::MatrixXd gram = own.transpose() * own;
    Eigen::MatrixXd errors = Eigen::MatrixXd::Zero(own.cols(), own.cols());
    const Eigen::VectorXd residuals = scaled_residuals(*model_, data, moved.parameters, moved.placed);
    Eigen::MatrixXd scores = own.array().colwise() * residuals.array();
    for (const std::shared_ptr<const Draw>& draw : draws_) {
      const Eigen::MatrixXd other = jacobian(*draw->model, data, moved);
      const Eigen::VectorXd change = stacked(data, draw->model->predict(moved.parameters, moved.placed)) - predicted;
      errors += (other - own).transpose() * (other - own) / static_cast<double>(draws_.size());
      scores.array() += (other.array().colwise() * change.array()) / static_cast<double>(draws_.size());
    }
    constexpr double most = 0.5;
    const bool is_hopeless = (errors.diagonal().array() > most * gram.diagonal().array()).any();
    const Eigen::LDLT<Eigen::MatrixXd> inverse(gram - errors);
    if (is_hopeless || !inverse.isPositive() || inverse.info() != Eigen::Success) {
      Eigen::Index next = std::ssize(free);
      for (const PlacedTerm& placed : fit.placed) {
        const auto size = std::ssize(fitted_places(*model_, placed));
        const bool is_own =
            (errors.diagonal().segment(next, size).array() > most * gram.diagonal().segment(next, size).array()).any();
        if (is_own || !is_hopeless) beyond.push_back(model_->label(placed));
        next += size;
      }
      return beyond;
    }
    const Eigen::VectorXd change = inverse.solve(scores.colwise().sum().transpose());
    const auto dof = static_cast<double>(std::max<Eigen::Index>(1, own.rows() - own.cols()));
    const Eigen::MatrixXd spread = sandwich(inverse, own, scores, data.measured.cols(), residuals.squaredNorm() / dof);
    factors = (spread.diagonal().array() /
               gram.ldlt().solve(Eigen::MatrixXd::Identity(gram.rows(), gram.cols())).diagonal().array())
                  .sqrt();
    for (std::size_t k = 0; k < free.size(); ++k) moved.parameters(free[k]) += change(static_cast<Eigen::Index>(k));
    Eigen::Index next = std::ssize(free);
    for (std::size_t t = 0; t < places.size(); ++t) {
      PlacedTerm& placed = moved.placed[t];
      places[t] = fitted_places(*model_, placed);
      for (const Eigen::Index k : places[t]) {
        (k < placed.coefficients.size() ? placed.coefficients(k) : placed.constants(0)) += change(next++);
      }
      placed.constants = within_range(model_->terms()[placed.term], placed.constants);
    }
  }
  if (!factors.allFinite()) return beyond;
  for (std::size_t k = 0; k < free.size(); ++k)
    moved.parameter_errors(free[k]) *= factors(static_cast<Eigen::Index>(k));
  Eigen::Index next = std::ssize(free);
  for (std::size_t t = 0; t < moved.placed.size(); ++t) {
    for (const Eigen::Index k : places[t]) moved.errors[t](k) *= factors(next++);
  }
  fit = std::move(moved);
  return beyond;
}

Eigen::MatrixXd InputNoise::variances(const TermFit& fit) const {
  const Eigen::MatrixXd as_given = model_->predict(fit.parameters, fit.placed);
  Eigen::MatrixXd sum = Eigen::MatrixXd::Zero(as_given.rows(), as_given.cols());
  for (const std::shared_ptr<const Draw>& draw : draws_)
    sum += model_->recording().as_measured(draw->model->predict(fit.parameters, fit.placed) - as_given).cwiseAbs2();
  return sum / static_cast<double>(draws_.size());
}

Eigen::MatrixXd InputNoise::variances(const Samples& samples) const {
  Eigen::MatrixXd sum = Eigen::MatrixXd::Zero(samples.size(), draws_.front()->change.cols());
  for (const std::shared_ptr<const Draw>& draw : draws_) sum += means(draw->change, samples).cwiseAbs2();
  return sum / static_cast<double>(draws_.size());
}

}  // namespace llmt::discovery
