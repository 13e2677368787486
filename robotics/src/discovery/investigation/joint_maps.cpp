#include "discovery/investigation/joint_maps.hpp"

#include <algorithm>
#include <cmath>

#include "calibration/free_parameters.hpp"
#include "calibration/joint_map_shift.hpp"
#include "discovery/investigation/jacobian_range.hpp"
#include "discovery/investigation/leave_one_out.hpp"
#include "effects/effect_entries.hpp"
#include "kinematics/units.hpp"
#include "linear_algebra/linear_algebra.hpp"
#include "llmt/statistics.hpp"

namespace llmt::robotics {
namespace {

struct Knots : EvenKnots {
  std::size_t joint = 0;
  Eigen::Index begin = 0;  // among all unknowns
};

std::vector<Knots> choose_knots(const Chain& chain, const Poses& poses) {
  // Knots every two degrees resolve the errors of strain-wave gears. There are four poses or more for every knot.
  constexpr double finest = 2.0 * radians;
  std::vector<Knots> all;
  Eigen::Index begin = 0;
  for (std::size_t j = 0; j < chain.joints.size(); ++j) {
    if (chain.joints[j].type != JointType::revolute) continue;
    const Eigen::VectorXd q = poses.joints.col(j);
    const double range = q.maxCoeff() - q.minCoeff();
    if (range < 0.05) continue;
    const auto most = std::max<Eigen::Index>(6, poses.count() / 4);
    const auto count = std::clamp(static_cast<Eigen::Index>(std::ceil(range / finest)) + 1, Eigen::Index{6}, most);
    all.push_back({{q.minCoeff(), range / static_cast<double>(count - 1), count}, j, begin});
    begin += count;
  }
  return all;
}

Eigen::MatrixXd second_differences(Eigen::Index count) {
  Eigen::MatrixXd penalty = Eigen::MatrixXd::Zero(count, count);
  for (Eigen::Index k = 1; k + 1 < count; ++k) {
    Eigen::RowVectorXd row = Eigen::RowVectorXd::Zero(count);
    row(k - 1) = 1.0;
    row(k) = -2.0;
    row(k + 1) = 1.0;
    penalty.middleRows(k - 1, 3) += row.segment(k - 1, 3).transpose() * row;
  }
  return penalty;
}

// Chooses the sizes of the penalties by the marginal likelihood: a penalty is the inverse covariance of a prior.
class Smoother {
 public:
  Smoother(Eigen::MatrixXd gram, Eigen::VectorXd moments, double squares, double freedom, std::vector<Knots> knots)
      : gram_(std::move(gram)),
        moments_(std::move(moments)),
        squares_(squares),
        freedom_(freedom),
        knots_(std::move(knots)) {
    information_ = gram_.trace() / static_cast<double>(gram_.cols());
    for (const Knots& own : knots_) penalties_.push_back(second_differences(own.count));
  }

  Eigen::MatrixXd penalty(const std::vector<double>& log_smoothness) const {
    // Geometry nearly absorbs the level and the slope of each map; a weak penalty determines them.
    constexpr double loose = 1e-5;
    Eigen::MatrixXd all = Eigen::MatrixXd::Zero(gram_.rows(), gram_.cols());
    for (std::size_t b = 0; b < knots_.size(); ++b) {
      auto block = all.block(knots_[b].begin, knots_[b].begin, knots_[b].count, knots_[b].count);
      block = std::pow(10.0, log_smoothness[b]) * information_ * penalties_[b];
      block.diagonal().array() += loose * information_;
    }
    return all;
  }

  // -2 ln marginal likelihood, constants left out.
  double cost(const std::vector<double>& log_smoothness) const {
    double log_prior = 0.0;
    Eigen::MatrixXd all = penalty(log_smoothness);
    for (const Knots& own : knots_) {
      log_prior += Cholesky(all.block(own.begin, own.begin, own.count, own.count)).log_determinant();
    }
    all += gram_;
    const Cholesky factor(all);
    if (!factor.exists()) return std::numeric_limits<double>::infinity();
    const double left = squares_ - moments_.dot(factor.solve(moments_));
    return factor.log_determinant() - log_prior + freedom_ * std::log(std::max(left, 1e-12 * squares_));
  }

  // One smoothness for all, then each on its own.
  std::vector<double> choose() const {
    constexpr double roughest = -3.0;
    constexpr double smoothest = 6.0;
    std::vector<double> best(knots_.size(), smoothest);
    double smallest = cost(best);
    for (double common = smoothest - 1.5; common >= roughest; common -= 1.5) {
      const std::vector<double> trial(knots_.size(), common);
      const double own = cost(trial);
      if (own < smallest) {
        smallest = own;
        best = trial;
      }
    }
    for (const double step : {1.5, 0.75}) {
      for (std::size_t b = 0; b < best.size(); ++b) {
        for (const double direction : {step, -step}) {
          while (true) {
            std::vector<double> trial = best;
            trial[b] = std::clamp(trial[b] + direction, roughest, smoothest + 2.0);
            if (trial[b] == best[b]) break;
            const double own = cost(trial);
            if (own >= smallest) break;
            smallest = own;
            best = trial;
          }
        }
      }
    }
    return best;
  }

 private:
  Eigen::MatrixXd gram_;
  Eigen::VectorXd moments_;
  double squares_;
  double freedom_;
  std::vector<Knots> knots_;
  double information_ = 1.0;
  std::vector<Eigen::MatrixXd> penalties_;
};

// The residuals and the hats at the measured coordinates, projected on the orthogonal complement of the range of
// geometry and effects. Only parameters that the calibration freed count. On an arm that bends, the others move the
// tool by a thousandth through the loads, and no refit would give back a part that is projected out along them.
struct ProjectedMaps {
  Eigen::MatrixXd baseline;   // n x rank, orthonormal: the range of the Jacobian by these
  Eigen::VectorXd residuals;  // n
  Eigen::MatrixXd hats;       // n x unknowns
};

// Hat functions of the joint angles, pushed through the joints' levers: derivatives of the measured coordinates.
Eigen::MatrixXd pushed_hats(const Robot& robot, const Poses& poses, const std::vector<Knots>& knots,
                            const std::vector<Eigen::Index>& rows) {
  Eigen::MatrixXd hats = Eigen::MatrixXd::Zero(std::ssize(rows), knots.back().begin + knots.back().count);
  const Eigen::MatrixXd motions = joint_motions(robot, poses);
  for (Eigen::Index k = 0; k < hats.rows();) {
    const Eigen::Index pose = rows[k] / 3;
    const auto levers = motions.middleRows(3 * pose, 3);
    for (; k < hats.rows() && rows[k] / 3 == pose; ++k) {
      const Eigen::Index axis = rows[k] % 3;
      for (const Knots& own : knots) {
        const Eigen::Index joint = own.joint;
        const auto [below, above] = own.place(poses.joints(pose, joint));
        hats(k, own.begin + below) += (1.0 - above) * levers(axis, joint);
        hats(k, own.begin + below + 1) += above * levers(axis, joint);
      }
    }
  }
  return hats;
}

ProjectedMaps project(const Robot& robot, const Measurements& measurements, const std::vector<Knots>& knots) {
  const std::vector<Eigen::Index> rows = measured_rows(measurements);
  const auto n = std::ssize(rows);
  ProjectedMaps projected;
  Eigen::MatrixXd jacobian = rows_of(position_jacobian(robot, measurements.poses, freed_parameters(robot)), rows);
  const Eigen::MatrixXd model = positions(robot, measurements.poses);
  projected.residuals.resize(n);
  for (Eigen::Index k = 0; k < n; ++k) {
    projected.residuals(k) = measurements.positions_mm(rows[k] / 3, rows[k] % 3) - model(rows[k] / 3, rows[k] % 3);
  }
  normalize_columns(jacobian);
  projected.baseline = orthonormal_range(jacobian);
  remove_range(projected.baseline, projected.residuals);
  projected.hats = pushed_hats(robot, measurements.poses, knots, rows);
  remove_range(projected.baseline, projected.hats);
  return projected;
}

}  // namespace

Eigen::VectorXd beyond_maps(const Robot& robot, const Measurements& measurements, const JointMaps& maps,
                            const Eigen::MatrixXd& displacements) {
  Eigen::VectorXd shares = Eigen::VectorXd::Ones(displacements.cols());
  const std::vector<Knots> knots = choose_knots(robot.chain, measurements.poses);
  if (knots.size() != maps.smoothness.size() || displacements.cols() == 0) return shares;
  const std::vector<Eigen::Index> rows = measured_rows(measurements);
  std::vector<Eigen::Index> geometry = freed_parameters(robot);
  std::erase_if(geometry, [&](Eigen::Index k) { return k >= geometric_parameter_count(robot.chain); });
  const Eigen::MatrixXd basis = range_of(rows_of(position_jacobian(robot, measurements.poses, geometry), rows));
  Eigen::MatrixXd hats = pushed_hats(robot, measurements.poses, knots, rows);
  remove_range(basis, hats);
  Eigen::MatrixXd gram = Eigen::MatrixXd::Zero(hats.cols(), hats.cols());
  gram.selfadjointView<Eigen::Lower>().rankUpdate(hats.transpose());
  gram.triangularView<Eigen::StrictlyUpper>() = gram.transpose();
  const Smoother smoother(gram, Eigen::VectorXd::Zero(gram.cols()), 0.0, 0.0, knots);
  const Cholesky factor(gram + smoother.penalty(maps.smoothness));
  Eigen::MatrixXd left = displacements;
  subtract_product(hats, factor.solve(transposed_product(hats, displacements)), left);
  for (Eigen::Index k = 0; k < shares.size(); ++k) {
    const double all = displacements.col(k).squaredNorm();
    if (all > 0.0) shares(k) = left.col(k).squaredNorm() / all;
  }
  return shares;
}

std::optional<JointMaps> fit_joint_maps(const Robot& robot, const Measurements& measurements) {
  const std::vector<Knots> knots = choose_knots(robot.chain, measurements.poses);
  if (knots.empty()) return std::nullopt;
  const auto [baseline, residuals, hats] = project(robot, measurements, knots);
  const Eigen::Index n = hats.rows();
  const Eigen::Index unknowns = hats.cols();
  const Eigen::Index d = n / measurements.count();
  Eigen::MatrixXd gram = Eigen::MatrixXd::Zero(unknowns, unknowns);
  gram.selfadjointView<Eigen::Lower>().rankUpdate(hats.transpose());
  gram.triangularView<Eigen::StrictlyUpper>() = gram.transpose();
  const Eigen::VectorXd moments = transposed_product(hats, residuals);
  const Smoother smoother(gram, moments, residuals.squaredNorm(), static_cast<double>(n - baseline.cols()), knots);
  JointMaps maps;
  maps.smoothness = smoother.choose();
  const Cholesky factor(gram + smoother.penalty(maps.smoothness));
  const Eigen::VectorXd values = factor.solve(moments);
  for (const Knots& own : knots) {
    const Eigen::VectorXd part = values.segment(own.begin, own.count);
    maps.effects.push_back(
        joint_map_effect(robot.chain.joints[own.joint], own.first, own.step, {part.begin(), part.end()}));
  }
  const Eigen::MatrixXd geometry = baseline.transpose();
  maps.before = leave_one_out_distances(geometry, residuals, d);
  Eigen::MatrixXd used(geometry.rows() + unknowns, n);
  used.topRows(geometry.rows()) = geometry;
  used.bottomRows(unknowns) = factor.whitened(hats);
  maps.after = leave_one_out_distances(used, residuals - hats * values, d);
  const PairedDifference gain = paired_difference(maps.before, maps.after);
  maps.gain_in_errors = gain.standard_error > 0.0 ? gain.mean / gain.standard_error : 0.0;
  return maps;
}

}  // namespace llmt::robotics
