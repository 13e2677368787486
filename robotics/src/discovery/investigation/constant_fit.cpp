#include "discovery/investigation/constant_fit.hpp"

#include <algorithm>
#include <cmath>

#include "discovery/investigation/pose_split.hpp"
#include "discovery/investigation/unsound_effects.hpp"
#include "linear_algebra/linear_algebra.hpp"

namespace llmt::robotics {
namespace {

bool is_wave(const Effect& effect) { return nature_of(effect) == Nature::wave; }

// A wave's number of periods is open if a scan found it, and if it is no whole number.
bool is_open(const Hypothesis& one) {
  const Effect& effect = *one.effect;
  if (!is_wave(effect)) return effect_type(effect.type).trial.fits_constant;
  return one.candidate.prior_cost > 0.0 && effect.constants[0] != std::round(effect.constants[0]);
}

// The final fit: derivatives by the free parameters and by the open constants.
struct Augmented {
  std::vector<Eigen::Index> free;  // parameters
  Eigen::MatrixXd columns;         // free parameters, then constants; normalised
  Eigen::VectorXd norms;
  Eigen::VectorXd errors;  // measured - model
};

Augmented augmented(const Calibration& fitted, const Measurements& kept, const std::vector<std::size_t>& open) {
  Augmented fit;
  for (std::size_t k = 0; k < fitted.robot.identified.size(); ++k) {
    if (fitted.robot.identified[k].state == "free") fit.free.push_back(static_cast<Eigen::Index>(k));
  }
  const std::vector<Eigen::Index> rows = measured_rows(kept);
  fit.errors = stacked(kept.positions_mm, rows) - stacked(positions(fitted.robot, kept.poses), rows);
  fit.columns.resize(fit.errors.size(), std::ssize(fit.free) + std::ssize(open));
  fit.columns.leftCols(std::ssize(fit.free)) = rows_of(position_jacobian(fitted.robot, kept.poses, fit.free), rows);
  for (std::size_t e = 0; e < open.size(); ++e) {
    constexpr double share = 1e-4;
    Robot moved = fitted.robot;
    double& constant = moved.effects[open[e]].constants[0];
    const double at = constant;
    const double step = share * at;
    constant = at + step;
    const Eigen::VectorXd above = stacked(positions(moved, kept.poses), rows);
    constant = at - step;
    fit.columns.col(std::ssize(fit.free) + static_cast<Eigen::Index>(e)) =
        (above - stacked(positions(moved, kept.poses), rows)) / (2.0 * step);
  }
  fit.norms = column_norms(fit.columns).cwiseMax(1e-300);
  scale_columns(fit.columns, fit.norms.cwiseInverse());
  return fit;
}

// A step of all free parameters and of the open constants. `largest` becomes the largest relative step of a constant.
Robot stepped(const Robot& robot, const Augmented& fit, const std::vector<std::size_t>& open, double& largest) {
  const Eigen::Index free = std::ssize(fit.free);
  const Eigen::VectorXd all = least_squares(fit.columns, fit.errors).cwiseQuotient(fit.norms);
  Robot moved = robot;
  Eigen::VectorXd errors = fit.errors;
  for (std::size_t e = 0; e < open.size(); ++e) {
    double& constant = moved.effects[open[e]].constants[0];
    // A wave that is off by a period over the range of its joint is another one; other constants keep their sign.
    const double widest = is_wave(moved.effects[open[e]]) ? 0.2 : 0.5 * constant;
    const Eigen::Index column = free + static_cast<Eigen::Index>(e);
    const double step = std::clamp(all(column), -widest, widest);
    errors -= step * fit.norms(column) * fit.columns.col(column);
    largest = std::max(largest, std::abs(step) / constant);
    constant += step;
  }
  const Eigen::VectorXd steps = least_squares(fit.columns.leftCols(free), errors).cwiseQuotient(fit.norms.head(free));
  const std::vector<discovery::Parameter> known = parameters(robot);
  Eigen::VectorXd values(std::ssize(known));
  for (std::size_t k = 0; k < known.size(); ++k) values(static_cast<Eigen::Index>(k)) = known[k].value;
  for (Eigen::Index k = 0; k < free; ++k) values(fit.free[static_cast<std::size_t>(k)]) += steps(k);
  return with_values(std::move(moved), values);
}

// Numbers among the robot's effects: those whose constant is open.
std::vector<std::size_t> open_effects(const Investigation& investigation) {
  std::vector<std::size_t> open;
  for (const Hypothesis& one : investigation.found) {
    if (!is_open(one)) continue;
    const std::vector<Effect>& effects = investigation.fitted.robot.effects;
    const auto place = std::ranges::find(effects, effect_label(*one.effect), effect_label);
    if (place != effects.end()) open.push_back(static_cast<std::size_t>(place - effects.begin()));
  }
  return open;
}

// Gives all hypotheses that know the effect by its label the new constant.
void rename(Investigation& investigation, const std::vector<Effect>& before, const std::vector<std::size_t>& open,
            std::vector<Hypothesis>* also) {
  const auto renew = [&](std::vector<Hypothesis>& hypotheses) {
    for (Hypothesis& one : hypotheses) {
      if (!one.effect) continue;
      const std::string label = effect_label(*one.effect);
      for (const std::size_t e : open) {
        if (label == effect_label(before[e])) one.effect->constants = investigation.fitted.robot.effects[e].constants;
      }
    }
  };
  renew(investigation.found);
  renew(investigation.asked.hypotheses);
  if (also != nullptr) renew(*also);
}

}  // namespace

std::map<std::string, double> fit_constants(Investigation& investigation, const DiscoveryOptions& options,
                                            std::vector<Hypothesis>* also) {
  const std::vector<std::size_t> open = open_effects(investigation);
  if (open.empty()) return {};
  report_progress(*investigation.work, "fitting constants");
  const Measurements kept = investigation.kept();
  const std::vector<Effect> before = investigation.fitted.robot.effects;
  Calibration moved = investigation.fitted;
  double error = total_distance(moved.robot, kept);
  bool is_better = false;
  constexpr int passes = 8;
  for (int pass = 0; pass < passes; ++pass) {
    const Augmented fit = augmented(moved, kept, open);
    double largest = 0.0;
    Robot next = stepped(moved.robot, fit, open, largest);
    const double next_error = total_distance(next, kept);
    if (!(next_error < error)) break;
    moved.robot = std::move(next);
    error = next_error;
    is_better = true;
    constexpr double settled = 1e-3;
    if (largest < settled) break;
  }
  if (is_better) {
    CalibrationOptions calibration = options.calibration;
    calibration.start_as_given = true;
    Calibration next = calibrate(moved.robot, kept, calibration);
    next.registered = investigation.fitted.registered;
    if (total_distance(next.robot, kept) < total_distance(investigation.fitted.robot, kept)) {
      investigation.fitted = std::move(next);
    }
  }
  rename(investigation, before, open, also);

  const Augmented fit = augmented(investigation.fitted, kept, open);
  const double dof = static_cast<double>(fit.errors.size() - fit.columns.cols());
  const double variance = fit.errors.squaredNorm() / std::max(1.0, dof);
  const Eigen::MatrixXd inverse = pseudo_inverse(gram(fit.columns));
  const Eigen::VectorXd all = (variance * inverse.diagonal()).cwiseMax(0.0).cwiseSqrt().cwiseQuotient(fit.norms);
  Calibration& fitted = investigation.fitted;
  std::map<std::string, double> errors;
  for (std::size_t e = 0; e < open.size(); ++e) {
    const Effect& effect = fitted.robot.effects[open[e]];
    errors[effect_label(effect)] = all(std::ssize(fit.free) + static_cast<Eigen::Index>(e));
    for (const EffectParameter& parameter : effect_parameters(fitted.robot.chain, effect)) {
      const std::string name = effect_parameter_name(effect, parameter);
      for (std::size_t k = 0; k < fit.free.size(); ++k) {
        IdentifiedParameter& own = fitted.robot.identified[static_cast<std::size_t>(fit.free[k])];
        if (own.name != name || !own.standard_error) continue;
        own.standard_error = std::max(*own.standard_error, all(static_cast<Eigen::Index>(k)));
        fitted.result.standard_errors(fit.free[k]) = *own.standard_error;
      }
    }
  }
  return errors;
}

}  // namespace llmt::robotics
