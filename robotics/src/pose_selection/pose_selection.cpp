#include "llmt/robotics/pose_selection.hpp"

#include <fmt/format.h>

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <numeric>
#include <stdexcept>

#include "calibration/singular_values.hpp"
#include "pose_selection/design_bound.hpp"
#include "pose_selection/driving_order.hpp"
#include "pose_selection/exchange.hpp"
#include "pose_selection/pose_model.hpp"
#include "pose_selection/pose_region.hpp"

namespace llmt::robotics {
namespace {

constexpr Eigen::Index most_poses = 1000;
constexpr Eigen::Index random_candidates = 1500;
constexpr Eigen::Index poses_of_use = 1000;

void require(bool holds, const std::string& what) {
  if (!holds) throw std::invalid_argument("llmt::robotics::select_poses: " + what);
}

void check(const Robot& robot, const PosePlan& plan, const PoseSelectionOptions& options) {
  validate(robot);
  const auto joints = std::ssize(robot.chain.joints);
  for (const auto& [poses, name] :
       {std::pair{&plan.candidates, "candidates"}, {&plan.measured, "measured"}, {&plan.use, "use"}}) {
    require(poses->count() == 0 || poses->joints.cols() == joints,
            fmt::format("{} have {} joints, the robot has {}", name, poses->joints.cols(), joints));
    require(poses->joints.allFinite(), fmt::format("{} have joint values that are not finite", name));
  }
  require(options.count >= 1 && options.count <= most_poses,
          fmt::format("count is {}, must be between 1 and {}", options.count, most_poses));
  require(options.spacing_deg >= 0.0 && options.spacing_deg < 180.0,
          fmt::format("spacing_deg is {}, must be at least 0 and less than 180", options.spacing_deg));
  require(options.noise_mm > 0.0 && std::isfinite(options.noise_mm),
          fmt::format("noise_mm is {}, must be > 0", options.noise_mm));
}

Poses of_joints(Eigen::MatrixXd joints) { return {.joints = std::move(joints), .covariates = {}}; }

Eigen::MatrixXd as_rows(const std::vector<Eigen::VectorXd>& poses, Eigen::Index joints) {
  Eigen::MatrixXd rows(std::ssize(poses), joints);
  for (std::size_t i = 0; i < poses.size(); ++i) rows.row(i) = poses[i].transpose();
  return rows;
}

Eigen::MatrixXd stacked(const Eigen::MatrixXd& above, const Eigen::MatrixXd& below) {
  Eigen::MatrixXd all(above.rows() + below.rows(), below.cols());
  all << above, below;
  return all;
}

// Everything that does not change while poses are chosen.
struct Task {
  const Robot& robot;
  const PoseSelectionOptions& options;
  PoseModel model;
  DesignProblem problem;
  Eigen::MatrixXd measured_deg;   // joint values
  Eigen::MatrixXd measured_rows;  // derivatives over noise

  Eigen::MatrixXd rows(const Poses& poses) const { return model.derivatives(poses) / options.noise_mm; }
  Spacing spacing(const Poses& poses) const {
    std::vector<bool> turns;
    for (const Joint& joint : robot.chain.joints) turns.push_back(joint.type == JointType::revolute);
    return {options.spacing_deg, joint_degrees(robot.chain, poses.joints), turns, measured_deg};
  }
};

Task make_task(const Robot& robot, const PosePlan& plan, const Poses& pool, const Poses& use,
               const PoseSelectionOptions& options) {
  std::vector<const Poses*> others = {&use};
  if (plan.measured.count() > 0) others.push_back(&plan.measured);
  Task task{robot, options, PoseModel(robot, pool, others, options.calibration), {}, {}, {}};
  require(!task.model.parameters().empty(), "no parameter is free");
  const Eigen::MatrixXd used = task.model.derivatives(use);
  task.problem.criterion = options.criterion;
  task.problem.use = used.transpose() * used / static_cast<double>(use.count());
  task.problem.given = task.model.priors().asDiagonal();
  task.measured_rows.resize(0, used.cols());
  task.measured_deg.resize(0, std::ssize(robot.chain.joints));
  if (plan.measured.count() > 0) {
    task.measured_rows = task.rows(plan.measured);
    task.measured_deg = joint_degrees(robot.chain, plan.measured.joints);
    task.problem.given += task.measured_rows.transpose() * task.measured_rows;
  }
  // A parameter without a prior is not known at all before the first pose: next to nothing is, so that M has an
  // inverse.
  constexpr double next_to_nothing = 1e-9;
  const Eigen::MatrixXd rows = task.rows(pool);
  task.problem.given.diagonal() +=
      next_to_nothing * rows.colwise().squaredNorm().transpose() / static_cast<double>(pool.count());
  const Eigen::Index parameters = used.cols();
  const Eigen::Index needed = (parameters + 2) / 3;
  const Eigen::Index there = options.count + plan.measured.count();
  require(
      there >= needed,
      fmt::format("count is {}: {} parameters need at least {} poses of three coordinates each; take {} or more, so "
                  "that there are twice as many coordinates as parameters",
                  options.count, parameters, needed, 2 * needed));
  return task;
}

PredictedCalibration predict(const Task& task, const Eigen::MatrixXd& rows) {
  const Eigen::MatrixXd all = stacked(task.measured_rows, rows);
  PredictedCalibration predicted;
  const Eigen::MatrixXd sum = task.problem.given + rows.transpose() * rows;
  const Eigen::MatrixXd covariance = sum.llt().solve(Eigen::MatrixXd::Identity(sum.rows(), sum.cols()));
  predicted.position_mm = std::sqrt(covariance.cwiseProduct(task.problem.use).sum());
  for (std::size_t k = 0; k < task.model.parameters().size(); ++k) {
    const discovery::Parameter& parameter = task.model.parameters()[k];
    const auto at = static_cast<Eigen::Index>(k);
    predicted.parameters.push_back({parameter.name, parameter.unit, parameter.scale * std::sqrt(covariance(at, at))});
  }
  predicted.observability = observability(singular_values(all), all.rows() / 3);
  return predicted;
}

// The chosen poses and neighbours of theirs.
Poses around(const PoseRegion& region, const Eigen::MatrixXd& chosen, double step_deg, Random& random) {
  std::vector<Eigen::VectorXd> near;
  for (const auto pose : chosen.rowwise()) region.add_neighbours(pose.transpose(), step_deg, random, near);
  return of_joints(stacked(chosen, as_rows(near, chosen.cols())));
}

constexpr double steps_deg[] = {40.0, 20.0, 10.0, 5.0, 2.5, 1.25};

// Shares of the time of a selection.
constexpr double share_of_choice = 0.2;
constexpr double share_of_a_step = 0.1;

Poses refined(const Task& task, const PoseRegion& region, Poses chosen, Random& random, Work& work) {
  work.begin("moving poses");
  for (const double step : steps_deg) {
    const Poses pool = around(region, chosen.joints, step, random);
    std::vector<Eigen::Index> start(chosen.count());
    std::iota(start.begin(), start.end(), 0);
    chosen = select(
        pool, choose_by_exchange(task.problem, task.rows(pool), task.spacing(pool), start, chosen.count(), &work));
    work.did(share_of_a_step);
  }
  return chosen;
}

// The poses that would improve a design most, and by how much, as far as a search from the best of the pool finds.
struct Improvers {
  Poses poses;
  double sensitivity = 0.0;
};

Improvers improvers(const Task& task, const IdealDesign& ideal, const PoseRegion* region, const Poses& pool,
                    const Eigen::MatrixXd& rows, Random& random) {
  constexpr Eigen::Index most = 30;
  Eigen::VectorXd values = sensitivities(ideal, rows);
  Improvers result{select(pool, largest(values, most)), values.maxCoeff()};
  if (region == nullptr) return result;
  for (const double step : steps_deg) {
    const Poses near = around(*region, result.poses.joints, step, random);
    values = sensitivities(ideal, task.rows(near));
    result = {select(near, largest(values, most)), std::max(result.sensitivity, values.maxCoeff())};
  }
  return result;
}

// Each design gives a bound. The poses that it lacks join the next.
double position_bound(const Task& task, const PoseRegion* region, const Poses& chosen, const Poses& pool,
                      Random& random, Work& work) {
  work.begin("looking for the best possible");
  constexpr int rounds = 4;
  constexpr double near_enough = 0.99;
  Poses support = pool;
  if (region != nullptr) support.joints = stacked(around(*region, chosen.joints, 5.0, random).joints, pool.joints);
  double bound = 0.0;
  for (int round = 0; round < rounds; ++round) {
    work.check();
    const Eigen::MatrixXd rows = task.rows(support);
    const IdealDesign ideal = ideal_design(task.problem, rows, task.options.count);
    const Improvers missing = improvers(task, ideal, region, support, rows, random);
    bound = std::max(bound, variance_bound(ideal, task.options.count, missing.sensitivity));
    if (region == nullptr || bound > near_enough * ideal.variance) break;
    support.joints = stacked(around(*region, missing.poses.joints, 2.5, random).joints, support.joints);
  }
  return std::sqrt(bound);
}

PredictedCalibration median_of_random(const Task& task, const Eigen::MatrixXd& rows, Random& random) {
  constexpr int draws = 25;
  std::vector<PredictedCalibration> drawn;
  for (int draw = 0; draw < draws; ++draw) {
    std::vector<Eigen::Index> order = random.permutation(rows.rows() / 3);
    order.resize(task.options.count);
    drawn.push_back(predict(task, rows_of_poses(rows, order)));
  }
  std::ranges::sort(drawn, {}, &PredictedCalibration::position_mm);
  return drawn[draws / 2];
}

}  // namespace

Poses random_poses(const Robot& robot, Eigen::Index count, const std::optional<ToolBox>& box, std::uint64_t seed) {
  validate(robot);
  require(count >= 0, fmt::format("count is {}, must be >= 0", count));
  Random random(seed);
  return of_joints(PoseRegion(robot.chain, box).random(count, random));
}

PoseSelection select_poses(const Robot& robot, const PosePlan& plan, const PoseSelectionOptions& options) {
  check(robot, plan, options);
  Work work(options.progress);
  Random random(options.seed);
  const bool is_given = plan.candidates.count() > 0;
  std::optional<PoseRegion> region;
  if (!is_given || options.box) region.emplace(robot.chain, options.box);
  Poses pool = plan.candidates;
  if (!is_given) pool = of_joints(region->random(std::max(random_candidates, 4 * options.count), random));
  if (is_given && region) {
    std::vector<Eigen::Index> inside;
    for (Eigen::Index i = 0; i < pool.count(); ++i) {
      if (region->contains(pool.joints.row(i).transpose())) inside.push_back(i);
    }
    pool = select(pool, inside);
  }
  require(pool.count() >= options.count, fmt::format("there are {} candidates{}, {} are to be chosen", pool.count(),
                                                     options.box ? " within limits and box" : "", options.count));
  Poses use = plan.use;
  if (use.count() == 0) use = is_given ? pool : of_joints(region->random(poses_of_use, random));
  const Task task = make_task(robot, plan, pool, use, options);
  const Eigen::MatrixXd rows = task.rows(pool);
  work.begin("choosing poses");
  const std::vector<Eigen::Index> chosen =
      choose_by_exchange(task.problem, rows, task.spacing(pool), {}, options.count, &work);
  work.did(share_of_choice);
  if (std::ssize(chosen) < options.count) {
    throw std::runtime_error(fmt::format(
        "llmt::robotics::select_poses: only {} poses differ by {} degrees in some joint, {} are to be chosen",
        std::ssize(chosen), options.spacing_deg, options.count));
  }
  PoseSelection selection;
  selection.poses = select(pool, chosen);
  const PoseRegion* free_region = is_given ? nullptr : &*region;
  if (free_region != nullptr) selection.poses = refined(task, *free_region, selection.poses, random, work);
  selection.bound_mm = position_bound(task, free_region, selection.poses, pool, random, work);
  const DrivingOrder order = driving_order(joint_degrees(robot.chain, selection.poses.joints));
  selection.poses = select(selection.poses, order.poses);
  selection.travel_deg = order.travel_deg;
  selection.chosen = predict(task, task.rows(selection.poses));
  selection.random = median_of_random(task, rows, random);
  selection.fixed = task.model.fixed();
  selection.left_out = task.model.left_out();
  work.finish();
  return selection;
}

}  // namespace llmt::robotics
