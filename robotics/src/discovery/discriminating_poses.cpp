#include "llmt/robotics/discovery/discriminating_poses.hpp"

#include <fmt/format.h>

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <numeric>
#include <stdexcept>

#include "kinematics/units.hpp"
#include "linear_algebra/linear_algebra.hpp"
#include "llmt/random.hpp"
#include "llmt/robotics/simulation.hpp"

namespace llmt::robotics {
namespace {

// The two explanations: the effect that was found, and all parameters that may be fitted to imitate it.
struct ExplanationPair {
  Robot without;  // the effect that was found
  Effect found;
  std::vector<Effect> rival;
  std::array<bool, 3> measured_axes;
};

// Predictions for n poses, 3n rows: `found` of the effect that was found, `columns` of the rival that imitates it.
struct Predictions {
  Eigen::MatrixXd columns;
  Eigen::VectorXd found;
};

// Calibration leaves joint maps as they are, so they imitate nothing.
std::vector<Eigen::Index> fitted_columns(const Robot& robot) {
  std::vector<Eigen::Index> columns(geometric_parameter_count(robot.chain));
  std::iota(columns.begin(), columns.end(), 0);
  Eigen::Index next = std::ssize(columns);
  for (const Effect& effect : robot.effects) {
    for (std::size_t k = 0; k < effect.values.size(); ++k, ++next) {
      if (nature_of(effect) != Nature::map) columns.push_back(next);
    }
  }
  return columns;
}

Predictions predict(const ExplanationPair& question, const Poses& poses) {
  std::vector<Effect> effects = question.rival;
  effects.push_back(question.found);
  const Eigen::MatrixXd signatures = effect_signatures(question.without, effects, poses);
  const Eigen::MatrixXd jacobian = position_jacobian(question.without, poses);
  const std::vector<Eigen::Index> adjusted = fitted_columns(question.without);
  const Eigen::Index own = std::ssize(question.found.values);
  const Eigen::Index rivals = signatures.cols() - own;
  Predictions predictions;
  predictions.columns = side_by_side(columns_of(jacobian, adjusted), signatures.leftCols(rivals));
  const Eigen::VectorXd values = Eigen::VectorXd::Map(question.found.values.data(), own);
  predictions.found = product(signatures.rightCols(own), values);
  for (Eigen::Index row = 0; row < predictions.found.size(); ++row) {
    if (question.measured_axes[row % 3]) continue;
    predictions.columns.row(row).setZero();
    predictions.found(row) = 0.0;
  }
  return predictions;
}

// Normal equations of the rival's fit.
struct Normal {
  Eigen::MatrixXd matrix;
  Eigen::VectorXd right;

  void add(const Eigen::MatrixXd& columns, const Eigen::VectorXd& found) {
    matrix += gram(columns);
    right += transposed_product(columns, found);
  }
};

// Block by block: the derivatives of 100 000 poses at once would fill the memory.
Normal normal_equations(const ExplanationPair& question, const Poses& poses, Eigen::Index columns) {
  constexpr Eigen::Index block = 1000;
  Normal normal{Eigen::MatrixXd::Zero(columns, columns), Eigen::VectorXd::Zero(columns)};
  for (Eigen::Index first = 0; first < poses.count(); first += block) {
    std::vector<Eigen::Index> rows(std::min(block, poses.count() - first));
    std::iota(rows.begin(), rows.end(), first);
    const Predictions part = predict(question, select(poses, rows));
    normal.add(part.columns, part.found);
  }
  return normal;
}

struct Payloads {
  std::vector<double> all;
  std::vector<double> measured;

  bool is_new(double payload) const {
    return std::ranges::none_of(measured, [&](double other) { return std::abs(other - payload) < 1e-6; });
  }
};

Payloads payloads_of(const Robot& robot, const Poses& poses) {
  constexpr std::size_t most = 4;
  Payloads payloads;
  const auto column = poses.covariates.find("payload_kg");
  if (column == poses.covariates.end()) {
    payloads.measured = {robot.chain.payload.mass_kg};
  } else {
    payloads.measured.assign(column->second.begin(), column->second.end());
    std::ranges::sort(payloads.measured);
    payloads.measured.erase(std::unique(payloads.measured.begin(), payloads.measured.end()), payloads.measured.end());
  }
  const std::size_t last = payloads.measured.size() - 1;
  const std::size_t taken = std::min(most, last + 1);
  for (std::size_t k = 0; k < taken; ++k) {
    payloads.all.push_back(payloads.measured[taken > 1 ? k * last / (taken - 1) : 0]);
  }
  for (const double extra : {0.0, robot.chain.payload.mass_kg}) {
    if (std::ranges::find(payloads.all, extra) == payloads.all.end()) payloads.all.push_back(extra);
  }
  return payloads;
}

std::array<double, 2> range_of(const Joint& joint, const Eigen::VectorXd& measured) {
  const bool turns = joint.type == JointType::revolute;
  if (!joint.limits && !turns) return {measured.minCoeff(), measured.maxCoeff()};
  const std::array<double, 2> limits = joint.limits.value_or(std::array<double, 2>{-180.0, 180.0});
  const double unit = turns ? radians : 1.0;
  return {limits[0] * unit, limits[1] * unit};
}

// Each random pose with each payload.
Poses candidate_poses(const ExplanationPair& question, const Poses& measured, const std::vector<double>& payloads,
                      Random& random) {
  constexpr Eigen::Index places = 400;
  const Chain& chain = question.without.chain;
  const auto loads = std::ssize(payloads);
  std::vector<Eigen::Index> rows;
  for (Eigen::Index p = 0; p < places; ++p) {
    rows.insert(rows.end(), payloads.size(),
                static_cast<Eigen::Index>(random.below(static_cast<std::uint64_t>(measured.count()))));
  }
  Poses poses = select(measured, rows);
  Eigen::VectorXd carried(std::ssize(rows));
  for (Eigen::Index i = 0; i < carried.size(); ++i) carried(i) = payloads[i % loads];
  poses.covariates["payload_kg"] = carried;
  const Eigen::MatrixXd before = poses.joints;
  for (Eigen::Index p = 0; p < places; ++p) {
    for (Eigen::Index j = 0; j < poses.joints.cols(); ++j) {
      const auto [low, high] = range_of(chain.joints[j], measured.joints.col(j));
      poses.joints.col(j).segment(p * loads, loads).setConstant(random.uniform(low, high));
    }
  }
  poses.joints = with_mimics(chain, std::move(poses.joints));
  std::erase_if(poses.covariates, [](const auto& column) { return column.first.starts_with("tau"); });
  for (Eigen::Index j = 0; j < poses.joints.cols(); ++j) {
    for (const char* unit : {"_rad", "_mm"}) {
      const auto seen = poses.covariates.find(fmt::format("qmeas{}{}", j + 1, unit));
      if (seen != poses.covariates.end()) seen->second += poses.joints.col(j) - before.col(j);
    }
  }
  Robot all = question.without;
  all.effects.push_back(question.found);
  all.effects.insert(all.effects.end(), question.rival.begin(), question.rival.end());
  return with_needed_columns(all, std::move(poses), random.bits());
}

// The covariates of that row that the effects in question depend on; joints and payload are given elsewhere.
std::map<std::string, double> conditions(const ExplanationPair& question, const Poses& poses, Eigen::Index row) {
  std::vector<Effect> effects = question.rival;
  effects.push_back(question.found);
  std::map<std::string, double> values;
  for (const Effect& effect : effects) {
    for (const std::string& names : effect_columns(question.without.chain, effect)) {
      for (const std::string& name : alternatives(names)) {
        const auto column = poses.covariates.find(name);
        const bool follows = name == "payload_kg" || name.starts_with("tau") || name.starts_with("qmeas");
        if (column != poses.covariates.end() && !follows) values[name] = column->second(row);
      }
    }
  }
  return values;
}

// For every candidate the distance by which the rival misses it even when it is fitted to it, mm.
Eigen::VectorXd disagreements(const Normal& normal, const Predictions& candidates) {
  // Directions that the poses do not determine stay free for the rival. The threshold is 1e-5 of a column, as for
  // dependent columns in the calibration.
  constexpr double ridge = 1e-10;
  Eigen::MatrixXd matrix = normal.matrix;
  matrix.diagonal().array() += ridge;
  const Cholesky factor(matrix);
  const Eigen::VectorXd misses = candidates.found - candidates.columns * factor.solve(normal.right);
  const Eigen::MatrixXd whitened = factor.whitened(candidates.columns);
  Eigen::VectorXd result(candidates.found.size() / 3);
  for (Eigen::Index i = 0; i < result.size(); ++i) {
    const auto own = whitened.middleCols(3 * i, 3);
    const Eigen::Matrix3d spread = Eigen::Matrix3d::Identity() + own.transpose() * own;
    const Eigen::Vector3d miss = misses.segment(3 * i, 3);
    result(i) = std::sqrt(std::max(0.0, miss.dot(spread.llt().solve(miss))));
  }
  return result;
}

void require(bool holds, const std::string& what) {
  if (!holds) throw std::invalid_argument("llmt::robotics::discriminating_poses: " + what);
}

}  // namespace

Discrimination discriminating_poses(const Robot& fitted, std::size_t effect, const std::vector<Effect>& rival,
                                    const Poses& measured, double noise_mm, int count, std::uint64_t seed,
                                    const std::array<bool, 3>& measured_axes) {
  require(effect < fitted.effects.size(),
          fmt::format("effect is {}, the robot has {} effects", effect, fitted.effects.size()));
  require(measured.count() > 0, "there is no measured pose");
  require(count >= 1, fmt::format("count is {}, must be >= 1", count));
  require(std::isfinite(noise_mm) && noise_mm >= 0.0, fmt::format("noise_mm is {}, must be >= 0", noise_mm));
  require(std::ranges::count(measured_axes, true) > 0, "no axis is measured");
  ExplanationPair question{fitted, fitted.effects[effect], rival, measured_axes};
  question.without.effects.erase(question.without.effects.begin() + effect);
  const Payloads payloads = payloads_of(fitted, measured);
  Random random(seed);
  const Poses poses = candidate_poses(question, measured, payloads.all, random);
  Predictions candidates = predict(question, poses);
  Normal normal = normal_equations(question, measured, candidates.columns.cols());
  // Columns of unit length over all poses, whatever their units. Zero columns stay zero.
  const Eigen::VectorXd squares = normal.matrix.diagonal() + candidates.columns.colwise().squaredNorm().transpose();
  const Eigen::VectorXd scale =
      squares.unaryExpr([](double square) { return square > 0.0 ? 1.0 / std::sqrt(square) : 0.0; });
  scale_columns(candidates.columns, scale);
  scale_rows(normal.matrix, scale);
  scale_columns(normal.matrix, scale);
  normal.right = scale.cwiseProduct(normal.right);

  // Exact data: below this share of the effect itself the first order is not to be trusted.
  constexpr double first_order = 1e-3;
  const double visible = std::max(noise_mm, first_order * candidates.found.lpNorm<Eigen::Infinity>());
  constexpr double effort = 1.2;  // to mount another payload
  Discrimination telling;
  telling.noise_mm = noise_mm;
  while (std::ssize(telling.poses) < count) {
    const Eigen::VectorXd disagreement = disagreements(normal, candidates);
    Eigen::VectorXd worth = disagreement;
    for (Eigen::Index i = 0; i < worth.size(); ++i) {
      if (payloads.is_new(poses.covariates.at("payload_kg")(i))) worth(i) /= effort;
      if (!(disagreement(i) > visible)) worth(i) = 0.0;
    }
    Eigen::Index best = 0;
    if (!(worth.maxCoeff(&best) > 0.0)) break;
    const double payload = poses.covariates.at("payload_kg")(best);
    telling.payload_helps = telling.payload_helps || payloads.is_new(payload);
    telling.poses.push_back(
        {poses.joints.row(best).transpose(), payload, disagreement(best), conditions(question, poses, best)});
    normal.add(candidates.columns.middleRows(3 * best, 3), candidates.found.segment(3 * best, 3));
  }
  telling.none_can = telling.poses.empty();
  return telling;
}

}  // namespace llmt::robotics
