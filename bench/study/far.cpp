// How often a calibration reaches the noise where the description is far off. Cells are arms whose lengths and angles,
// base and tool differ from the described ones.
#include <fmt/format.h>

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

struct FarChoice {
  int cells = 203;
  int poses = 60;
};

constexpr const char* far_arms[] = {"ur10e", "ur5", "tx200_like", "ur3e", "iiwa7", "panda", "wam"};

Robot far_off(Robot robot, double length_mm, double angle_deg, llmt::Random& random) {
  for (Joint& joint : robot.chain.joints) {
    joint.a_mm += length_mm * random.normal();
    joint.d_mm += length_mm * random.normal();
    joint.alpha_deg += angle_deg * random.normal();
    joint.theta_deg += angle_deg * random.normal();
  }
  for (int axis = 0; axis < 3; ++axis) {
    robot.chain.tool.xyz_mm(axis) += random.uniform(-150.0, 150.0);
    robot.chain.base.xyz_mm(axis) = random.uniform(-3000.0, 3000.0);
  }
  const double roll = random.uniform(-180.0, 180.0);
  const double pitch = random.uniform(-80.0, 80.0);
  robot.chain.base.rpy_deg = {roll, pitch, random.uniform(-180.0, 180.0)};
  return robot;
}

void study_far(const FarChoice& choice) {
  constexpr double noise_mm = 0.05;
  fmt::print("| a, d off by | alpha, theta off by | first start | in all |\n");
  fmt::print("| --- | --- | --- | --- |\n");
  for (const auto& [length_mm, angle_deg] : {std::pair{10.0, 2.0}, {20.0, 5.0}, {40.0, 10.0}, {80.0, 20.0}}) {
    int first = 0;
    int reached = 0;
    for (int number = 0; number < choice.cells; ++number) {
      llmt::Random random(1000 + static_cast<std::uint64_t>(number));
      const Robot nominal =
          read_robot(fmt::format("{}/{}.yaml", LLMT_ROBOTS_DIR, far_arms[number % std::ssize(far_arms)]));
      const Robot real = far_off(nominal, length_mm, angle_deg, random);
      const Calibration calibration =
          calibrate(nominal, simulate(real, {.poses = choice.poses,
                                             .noise_um = 1e3 * noise_mm,
                                             .seed = static_cast<std::uint64_t>(number) + 1}));
      if (calibration.noise_mm > 1.5 * noise_mm) continue;
      ++reached;
      if (!calibration.began_without_priors) ++first;
    }
    fmt::print("| {} mm | {} deg | {} | {} |\n", length_mm, angle_deg, first, reached);
  }
}

}  // namespace

void add_far(CLI::App& study) {
  CLI::App* command = study.add_subcommand("far", "Calibrations from descriptions that are far off");
  const auto choice = std::make_shared<FarChoice>();
  command->add_option("--cells", choice->cells, "Simulated arms")->capture_default_str();
  command->add_option("--poses", choice->poses, "Poses of each calibration")->capture_default_str();
  command->callback([choice] { study_far(*choice); });
}

}  // namespace bench
