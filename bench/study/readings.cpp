// What kinds of readings bring to a calibration: three targets in a pose or a measured orientation against one target,
// and two sessions together against one. Cells are arms with errors of their geometry; the error is that of the whole
// tool frame over fresh poses, base and one tool known: of its origin and of a point 100 mm beside it.
#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <memory>
#include <string>
#include <vector>

#include "llmt/random.hpp"
#include "llmt/robotics/calibration.hpp"
#include "llmt/robotics/robot_file.hpp"
#include "llmt/robotics/simulation.hpp"
#include "study/study.hpp"

namespace bench {
namespace {

using namespace llmt::robotics;

struct ReadingsChoice {
  int cells = 50;
  int poses = 40;
  double noise_um = 50.0;
  double noise_mrad = 0.1;
};

constexpr const char* arms[] = {"tx200_like", "ur10", "iiwa7", "panda"};

Robot described(int number) {
  Robot robot = read_robot(fmt::format("{}/{}.yaml", LLMT_ROBOTS_DIR, arms[number % std::ssize(arms)]));
  robot.effects.clear();
  robot.chain.tool.xyz_mm = {60.0, 20.0, 80.0};
  return robot;
}

Robot built(Robot robot, llmt::Random& random) {
  for (Joint& joint : robot.chain.joints) {
    joint.a_mm += 0.5 * random.normal();
    joint.d_mm += 0.5 * random.normal();
    joint.alpha_deg += 0.05 * random.normal();
    joint.theta_deg += 0.05 * random.normal();
    joint.beta_deg += 0.05 * random.normal();
  }
  robot.chain.bases = {{"b", {.xyz_mm = {1500.0, -800.0, 200.0}, .rpy_deg = {5.0, -12.0, 160.0}}}};
  robot.chain.tools = {{"t2", {.xyz_mm = {-70.0, 80.0, 100.0}}},
                       {"t3", {.xyz_mm = {10.0, -90.0, 160.0}}},
                       {"b", {.xyz_mm = {40.0, 60.0, 130.0}}}};
  return robot;
}

Measurements read_off(const Robot& real, const Poses& poses, const std::vector<Observation>& views, double noise_mm,
                      llmt::Random& random) {
  std::vector<Eigen::Index> rows;
  std::vector<Observation> observations;
  for (Eigen::Index i = 0; i < poses.count(); ++i) {
    for (Observation view : views) {
      view.stand = i;
      rows.push_back(i);
      observations.push_back(view);
    }
  }
  Measurements measured;
  measured.poses = select(poses, rows);
  measured.poses.observations = observations;
  measured.positions_mm = positions(real, measured.poses);
  for (double& value : measured.positions_mm.reshaped()) value += noise_mm * random.normal();
  return measured;
}

Measurements with_turns(Measurements measured, const Robot& real, double noise_mrad, llmt::Random& random) {
  measured.orientation.kind = Orientation::Kind::quaternion;
  measured.orientation.values.resize(measured.count(), 4);
  const std::vector<Pose> tools = tool_poses(real, measured.poses);
  for (Eigen::Index i = 0; i < measured.count(); ++i) {
    const Eigen::Vector3d turn(random.normal(), random.normal(), random.normal());
    const Eigen::Quaterniond q(Eigen::AngleAxisd(1e-3 * noise_mrad * turn.norm(), turn.normalized()) *
                               tools[i].rotation);
    measured.orientation.values.row(i) << q.w(), q.x(), q.y(), q.z();
  }
  return with_orientations(measured, real.chain);
}

Measurements together(Measurements first, const Measurements& second) {
  const Eigen::Index n = first.count();
  first.poses.joints.conservativeResize(n + second.count(), Eigen::NoChange);
  first.poses.joints.bottomRows(second.count()) = second.poses.joints;
  first.positions_mm.conservativeResize(n + second.count(), Eigen::NoChange);
  first.positions_mm.bottomRows(second.count()) = second.positions_mm;
  for (Observation seen : second.poses.observations) {
    seen.stand += n;
    first.poses.observations.push_back(seen);
  }
  return first;
}

// Base and tool of the first session are fitted once more to exact readings, so that what is left is the arm's: of the
// measured point, or of a point beside it, which the orientation moves.
double error_mm(const Robot& real, const Robot& found, const Poses& use, const Eigen::Vector3d& point_mm) {
  const auto seen_at = [&](Robot robot) {
    robot.chain.bases.clear();
    robot.chain.tools.clear();
    robot.chain.tool.xyz_mm += point_mm;
    return robot;
  };
  Measurements exact;
  exact.poses = use;
  exact.positions_mm = positions(seen_at(real), use);
  const Robot placed = with_placed_frames(seen_at(found), exact, {});
  return distances(positions(placed, use), exact).mean();
}

double median(std::vector<double> values) {
  std::ranges::nth_element(values, values.begin() + std::ssize(values) / 2);
  return values[values.size() / 2];
}

void study_readings(const ReadingsChoice& choice) {
  const char* const names[] = {"three targets", "one target and orientation", "one target, two sessions"};
  std::vector<std::vector<double>> ratios(std::size(names));
  std::vector<double> alone;
  for (int number = 0; number < choice.cells; ++number) {
    llmt::Random random(static_cast<std::uint64_t>(number) + 1);
    const Robot nominal = described(number);
    const Robot real = built(nominal, random);
    const auto poses_of = [&](std::uint64_t seed, int count) {
      return simulate(nominal,
                      {.poses = count, .noise_um = 0.0, .seed = seed + 10 * static_cast<std::uint64_t>(number)})
          .poses;
    };
    const Poses poses = poses_of(1, choice.poses);
    const double noise_mm = 1e-3 * choice.noise_um;
    const Measurements one = read_off(real, poses, {{}}, noise_mm, random);
    const Measurements three = read_off(real, poses, {{}, {.tool = "t2"}, {.tool = "t3"}}, noise_mm, random);
    const Measurements turned = with_turns(one, real, choice.noise_mrad, random);
    const Measurements second =
        read_off(real, poses_of(2, choice.poses), {{.base = "b", .tool = "b"}}, noise_mm, random);
    const Poses use = poses_of(3, 300);
    const auto error = [&](const Measurements& seen) {
      return error_mm(real, calibrate(nominal, seen).robot, use, {100.0, 100.0, 0.0});
    };
    alone.push_back(error(one));
    ratios[0].push_back(alone.back() / error(three));
    ratios[1].push_back(alone.back() / error(turned));
    ratios[2].push_back(alone.back() / error(together(one, second)));
  }
  fmt::print("{} cells, {} poses, noise {} um and {} mrad; error at a point 141 mm beside the target, median\n\n",
             choice.cells, choice.poses, choice.noise_um, choice.noise_mrad);
  fmt::print("one target: {:.4f} mm\n", median(alone));
  for (std::size_t k = 0; k < ratios.size(); ++k) {
    fmt::print("{}: {:.2f} times smaller\n", names[k], median(ratios[k]));
  }
}

}  // namespace

void add_readings(CLI::App& study) {
  CLI::App* command = study.add_subcommand("readings", "What several targets, orientations and sessions bring");
  const auto choice = std::make_shared<ReadingsChoice>();
  command->add_option("--cells", choice->cells, "Simulated arms")->capture_default_str();
  command->add_option("--poses", choice->poses, "Poses of each calibration")->capture_default_str();
  command->add_option("--noise-um", choice->noise_um, "Of a coordinate")->capture_default_str();
  command->add_option("--noise-mrad", choice->noise_mrad, "Of an orientation about one axis")->capture_default_str();
  command->callback([choice] { study_readings(*choice); });
}

}  // namespace bench
