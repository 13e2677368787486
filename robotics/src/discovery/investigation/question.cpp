#include "discovery/investigation/question.hpp"

#include <algorithm>

#include "calibration/free_parameters.hpp"
#include "calibration/noise_model.hpp"
#include "calibration/still_joints.hpp"
#include "discovery/investigation/pose_split.hpp"
#include "hypotheses/catalogue_effects.hpp"
#include "hypotheses/error_patterns.hpp"
#include "hypotheses/scans.hpp"
#include "linear_algebra/linear_algebra.hpp"

namespace llmt::robotics {
namespace {

Eigen::VectorXd stacked_residuals(const Robot& robot, const Measurements& measurements) {
  const Eigen::MatrixXd model = positions(robot, measurements.poses);
  Eigen::VectorXd residuals = Eigen::VectorXd::Zero(3 * measurements.count());
  for (Eigen::Index i = 0; i < measurements.count(); ++i) {
    for (Eigen::Index axis = 0; axis < 3; ++axis) {
      if (measurements.measured[axis]) residuals(3 * i + axis) = measurements.positions_mm(i, axis) - model(i, axis);
    }
  }
  return residuals;
}

std::vector<Eigen::Index> freed_geometry(const Robot& robot) {
  std::vector<Eigen::Index> columns;
  const std::vector<discovery::Parameter> all = parameters(robot);
  for (Eigen::Index k = 0; k < geometric_parameter_count(robot.chain); ++k) {
    const auto identified = std::ranges::find(robot.identified, all[k].name, &IdentifiedParameter::name);
    if (identified != robot.identified.end() && identified->state.starts_with("free")) columns.push_back(k);
  }
  return columns;
}

// Geometric parameters that span all that geometry can do to the rigid arm. Some combinations move nothing on a rigid
// arm, such as a shift of a joint along its axis. On an arm that bends they move loads, and thereby the tool by a
// thousandth: counted as geometry they would absorb a part of every elastic effect.
std::vector<Eigen::Index> independent_geometry(const Robot& robot, const Poses& poses,
                                               const std::vector<Eigen::Index>& rows) {
  // Touched points alone also fit an arm of no size. Only the parameters that the calibration freed keep the scale.
  if (!unseen_by_touch(robot).empty()) return freed_geometry(robot);
  Robot rigid = robot;
  rigid.effects.clear();
  Eigen::MatrixXd jacobian = rows_of(position_jacobian(rigid, poses), rows);
  // A column that is tiny next to the others is rounding, often with the pattern of a column that moves the tool.
  // Scaled up it would take that column's place.
  constexpr double nothing = 1e-7;
  const double least = nothing * column_norms(jacobian).maxCoeff();
  for (auto column : jacobian.colwise()) {
    if (column.norm() > least) {
      column.normalize();
    } else {
      column.setZero();
    }
  }
  return independent_columns(jacobian);
}

// An effect that an earlier round added, as a hypothesis with its signature at the present estimates.
Hypothesis found_before(const Hypothesis& earlier, const Effect& effect, const Eigen::MatrixXd& signature) {
  Hypothesis hypothesis = earlier;
  hypothesis.effect = effect;
  hypothesis.candidate.signature = signature;
  return hypothesis;
}

// Start values of the fit. The estimate of a value that hardly moves the tool can be arbitrarily large, so estimates
// are clamped to their plausible limits. Values without limits start at 0, where those stay that the poses do not
// determine.
std::vector<double> within_limits(const discovery::EffectCandidate& candidate, const Eigen::VectorXd& values) {
  Eigen::VectorXd bounded = Eigen::VectorXd::Zero(values.size());
  if (candidate.lower.size() == values.size()) bounded = values.cwiseMax(candidate.lower).cwiseMin(candidate.upper);
  return {bounded.begin(), bounded.end()};
}

// The search takes all readings to be equally exact, so less exact readings are scaled down.
void weigh(const Measurements& measurements, const Eigen::VectorXd& residuals, const CalibrationOptions& options,
           EffectQuestion& question) {
  const Eigen::VectorXd weights = NoiseModel(measurements, options).relative_weights(residuals);
  if (weights.size() == 0) return;
  question.evidence.residuals.array() *= weights.array();
  scale_rows(question.evidence.jacobian, weights);
  for (Hypothesis& hypothesis : question.hypotheses) {
    scale_rows(hypothesis.candidate.signature, weights);
  }
}

}  // namespace

EffectQuestion question(const Robot& robot, const std::vector<Hypothesis>& found, const Measurements& measurements,
                        const DiscoveryOptions& options) {
  const std::size_t own = robot.effects.size() - found.size();
  EffectQuestion result;
  const Eigen::VectorXd residuals = stacked_residuals(robot, measurements);
  // A signature that only the motion of a joint that hardly moves tells from another one would need a huge value.
  const Poses poses = with_still_joints_held(robot.chain, measurements.poses);
  const Scene scene = make_scene(robot, poses, residuals, measurements.measured);
  result.hypotheses = catalogue_hypotheses(scene, options.catalogue, result.untestable);
  if (options.scans) {
    for (Hypothesis& scanned : scanned_effects(scene, options.catalogue))
      result.hypotheses.push_back(std::move(scanned));
  }
  add_signatures(scene, result.hypotheses);
  const std::vector<Eigen::Index> rows = measured_rows(measurements);
  const Eigen::Index geometric = geometric_parameter_count(robot.chain);
  // Columns of the fitted geometry, then of all effects.
  std::vector<Eigen::Index> columns = independent_geometry(robot, poses, rows);
  const auto fitted = std::ssize(columns);
  const auto all = static_cast<Eigen::Index>(parameters(robot).size());
  for (Eigen::Index k = geometric; k < all; ++k) columns.push_back(k);
  const Eigen::MatrixXd jacobian = position_jacobian(robot, poses, columns);
  Eigen::VectorXd explained = residuals;
  Eigen::Index column = fitted;
  Eigen::Index baseline = fitted;
  for (std::size_t e = 0; e < robot.effects.size(); ++e) {
    const Effect& effect = robot.effects[e];
    const Eigen::Index k = std::ssize(effect.values);
    if (e >= own) {
      const Eigen::MatrixXd signature = jacobian.middleCols(column, k);
      const Eigen::VectorXd values = Eigen::VectorXd::Map(effect.values.data(), k);
      explained += product(signature, values);
      result.hypotheses.push_back(found_before(found[e - own], effect, signature));
    } else {
      baseline += k;
    }
    column += k;
  }
  if (options.patterns) {
    for (Hypothesis& pattern : pattern_hypotheses(scene)) result.hypotheses.push_back(std::move(pattern));
  }
  result.evidence.residuals = entries_of(explained, rows);
  result.evidence.jacobian = rows_of(jacobian.leftCols(baseline), rows);
  result.evidence.components = std::ranges::count(measurements.measured, true);
  result.evidence.repeats = repeats_of(measurements.poses);
  // Deflections are at most a hundredth of the levers, and the error of first order is a fraction of that, here
  // squared.
  constexpr double first_order = 1e-5;
  result.evidence.resolution = first_order;
  for (Hypothesis& hypothesis : result.hypotheses) {
    hypothesis.candidate.signature = rows_of(hypothesis.candidate.signature, rows);
  }
  weigh(measurements, entries_of(residuals, rows), options.calibration, result);
  return result;
}

void exclude_effects(const std::map<std::string, Effect>& effects, EffectQuestion& question) {
  std::erase_if(question.hypotheses,
                [&](const Hypothesis& one) { return one.effect && effects.contains(effect_label(*one.effect)); });
}

std::vector<discovery::EffectCandidate> candidates_of(const EffectQuestion& question) {
  std::vector<discovery::EffectCandidate> candidates;
  for (const Hypothesis& hypothesis : question.hypotheses) candidates.push_back(hypothesis.candidate);
  return candidates;
}

void forget_signatures(EffectQuestion& question) {
  question.evidence = {};
  for (Hypothesis& hypothesis : question.hypotheses) hypothesis.candidate.signature.resize(0, 0);
}

std::vector<Hypothesis> effects_of(const EffectQuestion& question, const discovery::Verdict& verdict) {
  std::vector<Hypothesis> found;
  for (const discovery::Finding& finding : verdict.findings) {
    for (const discovery::FindingTerm& term : finding.terms) {
      const Hypothesis& hypothesis = question.hypotheses[term.candidate];
      if (!hypothesis.effect) continue;
      found.push_back(hypothesis);
      found.back().candidate.signature.resize(0, 0);
      found.back().effect->values = within_limits(hypothesis.candidate, term.values);
    }
  }
  return found;
}

}  // namespace llmt::robotics
