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

// One of each type of the catalogue, as it stands in a description.
const std::vector<std::string>& effects_of_every_type() {
  static const std::vector<std::string> effects = {
      "joint_compliance, at: joint2, compliance_rad_per_Nm: 1e-6",
      "joint_compliance_stiffening, at: joint2, compliance_rad_per_Nm: 1e-6, stiffens_at_Nm: 30",
      "joint_compliance_measured, at: joint2, compliance_rad_per_Nm: 1e-6",
      "joint_compliance_free_masses, at: joint5, moments_rad: [1e-4, 2e-4, -1e-4, 1e-4, 0, 1e-4]",
      "link_bending, at: joint3, flexibility_per_Nm2: 2e-6",
      "link_bending_no_carry_over, at: joint3, flexibility_per_Nm2: 2e-6",
      "link_torsion, at: joint3, flexibility_per_Nm2: 4e-6",
      "elastic_base, compliance_rad_per_Nm: 1e-6",
      "elastic_base_two, compliance_first_rad_per_Nm: 1e-6, compliance_second_rad_per_Nm: 2e-6",
      "gravity_tilt, first_rad: 1e-2, second_rad: -2e-2",
      "joint_gain, at: joint2, gain: 1e-3",
      "counterbalance_spring, at: joint2, cosine_rad: 1e-3, sine_rad: 2e-4, lever_ratio: 0.3, free_length_ratio: 0.5",
      "wrist_coupling, at: joint5, ratio: 1e-3",
      "axis_wobble, at: joint2, x_cosine_rad: 1e-4, x_sine_rad: 2e-4, y_cosine_rad: -1e-4, y_sine_rad: 1e-4",
      "read_back_lag, at: joint2, share: 0.1",
      "eccentricity, at: joint2, cosine_rad: 3e-4, sine_rad: -2e-4",
      "eccentricity_twice, at: joint2, cosine_rad: 3e-4, sine_rad: -2e-4",
      "transmission_error, at: joint2, order_per_turn: 7, cosine_rad: 3e-4, sine_rad: -2e-4",
      "joint_map, at: joint2, first_rad: -2, step_rad: 1, values_rad: [1e-4, -2e-4, 0, 3e-4, 1e-4]",
      "backlash_gravity, at: joint2, half_gap_rad: 2e-4",
      "backlash_approach, at: joint2, half_gap_rad: 2e-4",
      "friction_under_load, at: joint2, compliance_rad_per_Nm: 1e-6",
      "hysteresis, at: joint2, half_width_rad: 2e-4, presliding_rad: 0.1",
      "thermal_growth, reference_C: 15, expansion_per_K: 1.1e-5",
      "link_thermal_growth, at: joint3, reference_C: 15, expansion_per_K: 1.1e-5",
      "base_thermal_drift, reference_C: 15, vx_mm_per_K: 0.01, vy_mm_per_K: 0.02, vz_mm_per_K: 0",
      "drift, from: 1, to: 60, vx_mm: 0.1, vy_mm: 0.2, vz_mm: -0.1",
      "drift_curved, from: 1, to: 60, vx_mm: 0.1, vy_mm: 0.2, vz_mm: -0.1, wx_mm: 0.1, wy_mm: 0, wz_mm: 0.2",
      "drift_settling, from: 1, to: 60, settles_in_share: 0.2, vx_mm: 0.1, vy_mm: 0.2, vz_mm: -0.1",
      "tracker_knock, after: 30, x_mm: 0.1, y_mm: 0.2, z_mm: 0, rx_rad: 1e-4, ry_rad: 0, rz_rad: 2e-4",
      "formula, at: joint2, name: own, terms: [{joint: \"cos(3 * q2)\", name: cosine}], coefficients: [2e-4]",
  };
  return effects;
}

// The UR10 with that effect alone, simulated and calibrated with the effect in the description.
void witness_effect(const std::string& folder, const std::string& effect, Results& results) {
  const std::string shipped = llmt::read_file(LLMT_ROBOTS "/ur10.yaml");
  llmt::write_file(folder + "/real.yaml", shipped + "effects:\n  - {type: " + effect + "}\n");
  const std::string name = "robots/effects/" + effect.substr(0, effect.find(',')) + "/";
  results[name + "simulate"] =
      run_and_hash(folder, robot_program + "simulate real.yaml --poses 60 --noise-um 20 -o d.csv --json", {"d.csv"});
  results[name + "calibrate"] =
      run_and_hash(folder, robot_program + "calibrate real.yaml d.csv --folds 0 -o cal.yaml --json", {"cal.yaml"});
}

// What no single effect of the catalogue says: a correction that is kept, an unknown shape, two effects, none.
void witness_answers(const std::string& folder, Results& results) {
  const auto add = [&](const std::string& name, const std::string& arguments, std::vector<std::string> files) {
    results["robots/answers/" + name] = run_and_hash(folder, robot_program + arguments, files);
  };
  const std::string flexible = llmt::read_file(LLMT_ROBOTS "/planar_two_link.yaml");
  llmt::write_file(folder + "/flexible.yaml", flexible);
  llmt::write_file(folder + "/rigid.yaml", flexible.substr(0, flexible.find("\neffects:")) + "\n");
  add("flexible_arm", "simulate flexible.yaml --poses 400 --noise-um 5 -o f.csv --json", {"f.csv"});
  add("correction_kept",
      "calibrate rigid.yaml f.csv --correct --only joint2.a,tool.x --folds 3 --contiguous -o kept.yaml --json",
      {"kept.yaml", "kept.correction.json"});
  const std::string arm = llmt::read_file(LLMT_ROBOTS "/ur5.yaml");
  llmt::write_file(folder + "/arm.yaml", arm);
  llmt::write_file(folder + "/step.yaml", arm + "effects:\n  - {type: joint_map, at: joint2, first_rad: 0.0, " +
                                              "step_rad: 0.2, values_rad: [0, 0, 1e-3, 1e-3, -5e-4]}\n");
  llmt::write_file(folder + "/two.yaml", arm + "effects:\n  - {type: joint_gain, at: joint3, gain: 1e-3}\n" +
                                             "  - {type: eccentricity, at: joint1, cosine_rad: 4e-4, sine_rad: 0}\n");
  for (const std::string truth : {"step", "two", "arm"}) {
    add(truth + "_simulate", "simulate " + truth + ".yaml --poses 90 --noise-um 20 -o t.csv --json", {"t.csv"});
    add(truth + "_discover", "discover arm.yaml t.csv --folds 2 -o found.yaml --json",
        {"found.yaml", "found.correction.json"});
  }
}

}  // namespace

void witness_robots(const std::string& folder, Results& results) {
  for (const HiddenEffects& hidden : hidden_effects()) witness_robot(folder, hidden, results);
  for (const std::string& effect : effects_of_every_type()) witness_effect(folder, effect, results);
  witness_answers(folder, results);
}

}  // namespace bytes
