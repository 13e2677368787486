// The shipped robots: each with hidden effects is measured, calibrated and searched by the program llmt-robot.
#include "bytes/cases.hpp"
#include "bytes/program_runs.hpp"
#include "llmt/files.hpp"

namespace bytes {
namespace {

const std::string robot_program = "'" LLMT_ROBOT_PROGRAM "' ";

struct HiddenEffects {
  std::string robot;
  std::string effects;  // lines of the description; empty: those that the shipped one has
  int poses;
};

const std::vector<HiddenEffects>& hidden_effects() {
  static const std::vector<HiddenEffects> robots = {
      {"planar_two_link", "", 60},
      {"tx200_like", "  - {type: joint_compliance, at: joint2, compliance_rad_per_Nm: 1.5e-7}\n", 80},
      {"ur10", "  - {type: eccentricity, at: joint3, cosine_rad: 4e-4, sine_rad: -3e-4}\n", 80},
      {"ur5", "  - {type: transmission_error, at: joint2, order_per_turn: 3, cosine_rad: 3e-4, sine_rad: 2e-4}\n", 80},
      {"wam", "  - {type: joint_gain, at: joint4, gain: 2e-3}\n", 80},
  };
  return robots;
}

void witness_robot(const std::string& folder, const HiddenEffects& hidden, Results& results) {
  std::string description = llmt::read_file(LLMT_ROBOTS "/" + hidden.robot + ".yaml");
  const std::size_t shipped_effects = description.find("\neffects:");
  std::string rigid = description.substr(0, shipped_effects) + "\n";
  llmt::write_file(folder + "/rigid.yaml", rigid);
  llmt::write_file(folder + "/real.yaml", hidden.effects.empty() ? description : rigid + "effects:\n" + hidden.effects);
  const auto run = [&](const std::string& arguments, const std::vector<std::string>& files) {
    return run_and_hash(folder, robot_program + arguments, files);
  };
  const std::string name = "robots/" + hidden.robot + "/";
  results[name + "simulate"] =
      run("simulate real.yaml --poses " + std::to_string(hidden.poses) + " --noise-um 20 --seed 3 -o d.csv --json",
          {"d.csv"});
  results[name + "calibrate"] = run("calibrate rigid.yaml d.csv --folds 3 -o cal.yaml --json", {"cal.yaml"});
  add_for_threads(results, name + "calibrate_correct", [&](int threads) {
    return run("calibrate rigid.yaml d.csv --folds 3 --correct --min-leaf 8 -o cor.yaml --json --threads " +
                   std::to_string(threads),
               {"cor.yaml", "cor.correction.json"});
  });
  results[name + "discover"] = run("discover rigid.yaml d.csv -o found.yaml --json", {"found.yaml"});
}

}  // namespace

void witness_robots(const std::string& folder, Results& results) {
  for (const HiddenEffects& hidden : hidden_effects()) witness_robot(folder, hidden, results);
}

}  // namespace bytes
