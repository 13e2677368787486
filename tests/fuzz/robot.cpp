// Robot descriptions: what is read survives writing and can be evaluated. Inputs that begin with a control character
// change a valid description; others are YAML as they stand.
#include <cmath>
#include <stdexcept>

#include "fuzz/json_mutator.hpp"
#include "llmt/robotics/robot_file.hpp"
#include "llmt/robotics/simulation.hpp"

namespace fuzz_robot {
namespace {

using namespace llmt::robotics;

const std::vector<std::string> words = {"",          "joint1", "revolute", "prismatic", "dh",    "mdh",     "formula",
                                        "joint_map", "drift",  "x",        "y",         "joint", "1/q1",    "q1",
                                        "ln(tau2)",  "q1 = 2", "temp_C",   "at",        "~",     "\xC3\xB6"};

// JSON is YAML.
fuzz::Json description() {
  return fuzz::Json::parse(R"json({
    "name": "arm", "convention": "mdh", "gravity_m_s2": [0, 0, -9.81], "orientation": "intrinsic_xyz",
    "base": {"xyz_mm": [1, 2, 3], "rpy_deg": [0, 10, 0]}, "tool": {"xyz_mm": [0, 0, 90], "rpy_deg": [0, 0, 0]},
    "payload": {"mass_kg": 10, "com_mm": [0, 0, 50]},
    "joints": [
      {"name": "joint1", "type": "revolute", "alpha_deg": 0, "a_mm": 0, "d_mm": 642, "theta_deg": 0, "sign": 1,
       "limits_deg": [-180, 180], "gear_ratio": 100, "mass_kg": 250, "com_mm": [100, 0, -100]},
      {"name": "joint2", "type": "revolute", "alpha_deg": -90, "a_mm": 250, "b_mm": 1, "d_mm": 0, "theta_deg": -90,
       "beta_deg": 0.1, "mass_kg": 100},
      {"name": "joint3", "type": "prismatic", "alpha_deg": 0, "a_mm": 950, "d_mm": 0, "theta_deg": 0,
       "limits_mm": [0, 300], "mass_kg": 40}],
    "effects": [
      {"type": "joint_compliance", "at": "joint1", "compliance_rad_per_Nm": 1e-7},
      {"type": "link_bending", "at": "joint2", "flexibility_per_Nm2": 1e-6},
      {"type": "transmission_error", "at": "joint2", "order_per_turn": 202, "cosine_rad": 2e-5, "sine_rad": -1e-5},
      {"type": "joint_map", "at": "joint1", "first_rad": -1, "step_rad": 0.5, "values_rad": [0, 1e-4, 0]},
      {"type": "hysteresis", "at": "joint2", "half_width_rad": 1e-4, "presliding_rad": 0.01},
      {"type": "thermal_growth", "reference_C": 20, "expansion_per_K": 1.1e-5},
      {"type": "payload_error", "mass_kg": 0.1, "com_x_mm": 0, "com_y_mm": 0, "com_z_mm": 1},
      {"type": "formula", "at": "joint2", "name": "belt",
       "terms": [{"joint": "cos(37 * q2)", "name": "cosine"}, {"z": "temp_C > 20 ? 1 : 0", "unit": "mm", "scale": 2}],
       "coefficients": [2e-4, 0.1]
}],
    "identified": [{"parameter": "joint1.a", "state": "free", "standard_error": 0.01, "unit": "mm"}],
    "correction": {
  "model" : "arm.correction.json"
}
})json");
}

void evaluate(const Robot& robot) {
  const auto joints = std::ssize(robot.chain.joints);
  Poses poses{.joints = Eigen::MatrixXd::Zero(3, joints), .covariates = {}};
  poses.joints.row(1).setLinSpaced(-2.0, 3.0);
  poses.joints.row(2).setConstant(0.7);
  poses = with_needed_columns(robot, poses, 1);
  const std::string refusal = position_refusal(robot, poses);
  fuzz::require(refusal.empty() == (positions(robot, poses).array().abs() <= farthest_mm).all(),
                "a position is refused if it is not finite or too far away");
  fuzz::require(position_jacobian(robot, poses).cols() == std::ssize(parameters(robot)),
                "there is a derivative by every parameter");
}

}  // namespace

FUZZ_TARGET(robot) {
  std::string text = fuzz::text_of(data, size);
  if (size > 0 && data[0] < ' ') {
    fuzz::Bytes bytes(data + 1, size - 1);
    static const fuzz::Json valid = description();
    fuzz::Json json = valid;
    fuzz::mutate(json, bytes, words);
    text = json.dump(-1, ' ', false, fuzz::Json::error_handler_t::replace);
  }
  try {
    const Robot robot = parse_robot(text, "r");
    const std::string written = to_yaml(robot);
    fuzz::require(to_yaml(parse_robot(written, "written")) == written, "a robot survives writing");
    evaluate(robot);
  } catch (const std::runtime_error& error) {
    const std::string message = error.what();
    fuzz::require(message.starts_with("r:"), fmt::format("'{}' names the file", message));
    fuzz::require(message.size() < 25000, "a message is no copy of the file");
  }
  return 0;
}

}  // namespace fuzz_robot
