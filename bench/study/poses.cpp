// Chosen poses against random ones of equal number: position error of real calibrations of simulated arms, over the
// poses of use. A cell is an arm with errors of its geometry (0.5 mm, 0.05 deg), a target somewhere on its flange and
// an instrument somewhere; poses are chosen by the description, which has none of these errors. Ratios are medians over
// the cells, of random to chosen.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <string>

#include "llmt/random.hpp"
#include "llmt/robotics/pose_selection.hpp"
#include "llmt/robotics/robot_file.hpp"
#include "llmt/robotics/simulation.hpp"
#include "study/study.hpp"

namespace bench {
namespace {

using namespace llmt::robotics;

struct PosesChoice {
  int cells = 200;
  double noise_um = 50.0;
  std::vector<Eigen::Index> counts = {20, 30, 40};
  std::vector<std::string> regions = {"joints", "limits", "box"};
  std::vector<std::string> criteria = {"position", "O1", "O2", "O3", "O4", "O5"};
};

constexpr const char* arms[] = {"tx200_like", "ur10", "iiwa7", "panda"};
constexpr const char* criterion_names[] = {"position", "O1", "O2", "O3", "O4", "O5"};

struct Cell {
  Robot nominal;
  Robot real;
  std::optional<ToolBox> box;
};

// Half of every joint's range, around its middle, and no more than 90 degrees.
void narrow(Robot& robot) {
  for (Joint& joint : robot.chain.joints) {
    const auto [low, high] = joint.limits.value_or(std::array<double, 2>{-180.0, 180.0});
    const double half = std::min(45.0, 0.25 * (high - low));
    joint.limits = {0.5 * (low + high) - half, 0.5 * (low + high) + half};
  }
}

Cell make_cell(int number, const std::string& region) {
  llmt::Random random(static_cast<std::uint64_t>(number) + 1);
  Cell cell;
  const std::string name = arms[number % std::ssize(arms)];
  cell.nominal = read_robot(std::string(LLMT_ROBOTS_DIR "/") + name + ".yaml");
  cell.nominal.effects.clear();
  Chain& chain = cell.nominal.chain;
  chain.tool.xyz_mm = {random.uniform(40.0, 120.0), random.uniform(-60.0, 60.0), random.uniform(20.0, 150.0)};
  if (region == "limits") narrow(cell.nominal);
  if (region == "box") {
    const double reach_mm = reach_of(chain);
    const Eigen::Vector3d centre(0.5 * reach_mm, 0.0, 0.35 * reach_mm);
    const Eigen::Vector3d half = Eigen::Vector3d::Constant(0.15 * reach_mm);
    cell.box = ToolBox{centre - half, centre + half};
  }
  cell.real = cell.nominal;
  Chain& real = cell.real.chain;
  for (Joint& joint : real.joints) {
    joint.a_mm += 0.5 * random.normal();
    joint.d_mm += 0.5 * random.normal();
    joint.alpha_deg += 0.05 * random.normal();
    joint.theta_deg += 0.05 * random.normal();
    joint.beta_deg += 0.05 * random.normal();
  }
  for (int axis = 0; axis < 3; ++axis) {
    real.tool.xyz_mm(axis) += 3.0 * random.normal();
    real.base.xyz_mm(axis) = random.uniform(-2000.0, 2000.0);
    real.base.rpy_deg(axis) = random.uniform(-80.0, 80.0);
  }
  return cell;
}

// Mean distance between the calibrated and the real arm over the poses of use.
double error_after(const Cell& cell, const Poses& poses, const Poses& use, double noise_um, std::uint64_t seed) {
  const Measurements measured = simulate(cell.real, poses, {.noise_um = noise_um, .seed = seed});
  const Calibration calibration = calibrate(cell.nominal, measured);
  return (positions(calibration.robot, use) - positions(cell.real, use)).rowwise().norm().mean();
}

double quantile(std::vector<double> values, double share) {
  std::ranges::sort(values);
  const double place = share * static_cast<double>(values.size() - 1);
  const auto below = static_cast<std::size_t>(place);
  const std::size_t above = std::min(below + 1, values.size() - 1);
  return values[below] + (place - static_cast<double>(below)) * (values[above] - values[below]);
}

void compare(const PosesChoice& choice, const std::string& region, Eigen::Index count, int criterion) {
  std::vector<double> ratios;
  std::vector<double> predicted;
  std::vector<double> best;
  std::vector<double> chosen_mm;
  std::vector<double> random_mm;
  for (int number = 0; number < choice.cells; ++number) {
    const Cell cell = make_cell(number, region);
    const auto seed = static_cast<std::uint64_t>(number) + 1000;
    PoseSelectionOptions options;
    options.count = count;
    options.box = cell.box;
    options.noise_mm = 1e-3 * choice.noise_um;
    options.seed = seed;
    options.criterion = static_cast<PoseCriterion>(criterion);
    PosePlan plan;
    const Poses drawn = random_poses(cell.nominal, 500 + count, cell.box, seed + 1000);
    plan.use.joints = drawn.joints.topRows(500);
    const PoseSelection selection = select_poses(cell.nominal, plan, options);
    const Poses random{.joints = drawn.joints.bottomRows(count), .covariates = {}};
    // Others than those that the choice was made for.
    const Poses use = random_poses(cell.nominal, 500, cell.box, seed + 2000);
    double with_chosen = 0.0;
    double with_random = 0.0;
    constexpr int draws = 3;
    for (int draw = 0; draw < draws; ++draw) {
      const std::uint64_t noise = seed * 10 + static_cast<std::uint64_t>(draw);
      with_chosen += error_after(cell, selection.poses, use, choice.noise_um, noise) / draws;
      with_random += error_after(cell, random, use, choice.noise_um, noise) / draws;
    }
    ratios.push_back(with_random / with_chosen);
    predicted.push_back(selection.random.position_mm / selection.chosen.position_mm);
    best.push_back(selection.random.position_mm / selection.bound_mm);
    chosen_mm.push_back(with_chosen);
    random_mm.push_back(with_random);
  }
  // Of a median of n: 1.2533 standard deviations over sqrt(n), the standard deviation from the quartiles.
  const double spread = (quantile(ratios, 0.75) - quantile(ratios, 0.25)) / 1.349;
  fmt::print("{:8} {:5}  {:9} {:9.4f} {:9.4f} {:8.3f} {:6.3f} {:7.3f} {:7.3f} {:10.3f} {:7.3f}\n", region, count,
             criterion_names[criterion], quantile(random_mm, 0.5), quantile(chosen_mm, 0.5), quantile(ratios, 0.5),
             1.2533 * spread / std::sqrt(static_cast<double>(ratios.size())), quantile(ratios, 0.25),
             quantile(ratios, 0.75), quantile(predicted, 0.5), quantile(best, 0.5));
  std::fflush(stdout);
}

}  // namespace

void add_poses(CLI::App& study) {
  const auto choice = std::make_shared<PosesChoice>();
  CLI::App* command = study.add_subcommand("poses", "Calibration with chosen poses against random ones");
  command->add_option("--cells", choice->cells, "simulated cells")->capture_default_str();
  command->add_option("--noise-um", choice->noise_um, "of a measured coordinate")->capture_default_str();
  command->add_option("--counts", choice->counts, "numbers of poses")->delimiter(',')->capture_default_str();
  command->add_option("--regions", choice->regions, "joints, limits, box")->delimiter(',')->capture_default_str();
  command->add_option("--criteria", choice->criteria, "what is made best")->delimiter(',')->capture_default_str();
  command->callback([choice] {
    fmt::print("region   poses  criterion random,mm chosen,mm    ratio     +-    25 %    75 %  predicted  ideal\n");
    for (const std::string& region : choice->regions) {
      for (const Eigen::Index count : choice->counts) {
        for (int criterion = 0; criterion < std::ssize(criterion_names); ++criterion) {
          if (std::ranges::count(choice->criteria, criterion_names[criterion]) == 0) continue;
          compare(*choice, region, count, criterion);
        }
      }
    }
  });
}

}  // namespace bench
