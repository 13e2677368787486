#include "llmt/robotics/robot_c_source.hpp"

#include <fmt/format.h>

#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <limits>
#include <stdexcept>

#include "c_source/effect_source.hpp"
#include "c_source/runtime.hpp"
#include "correction/correction_twist.hpp"
#include "effects/joint_error.hpp"
#include "kinematics/mimics.hpp"
#include "kinematics/units.hpp"
#include "llmt/robotics/effects.hpp"

namespace llmt::robotics {
namespace {

constexpr std::size_t longest_name = 26;

std::string with_name(std::string text, const std::string& name) {
  for (std::size_t at = text.find('@'); at != std::string::npos; at = text.find('@', at + name.size())) {
    text.replace(at, 1, name);
  }
  return text;
}

// The elements of a chain, as the class Kinematics has them.
class Elements {
 public:
  explicit Elements(const Chain& chain) {
    add_frame(chain.base);
    for (std::size_t j = 0; j < chain.joints.size(); ++j) {
      add_joint(chain, static_cast<int>(j));
      body_ = static_cast<int>(j);
    }
    add_frame(chain.tool);
    lines_ += fmt::format("  {{0, 0, -1, {}, 0.0}}\n", body_);
  }
  const std::string& lines() const { return lines_; }
  int count() const { return count_; }

 private:
  std::string lines_;
  int count_ = 0;
  int body_ = -1;  // whose frame has been reached

  void add(int axis, bool rotation, double value, int joint = -1) {
    lines_ += fmt::format("  {{{}, {}, {}, {}, {}}},\n", axis, rotation ? 1 : 0, joint, body_,
                          c_number(rotation ? value * radians : value));
    body_ = -1;
    ++count_;
  }
  void add_frame(const Frame& frame) {
    for (int axis = 0; axis < 3; ++axis) add(axis, false, frame.xyz_mm(axis));
    for (int axis = 2; axis >= 0; --axis) add(axis, true, frame.rpy_deg(axis));
  }
  void add_joint(const Chain& chain, int index) {
    const Joint& joint = chain.joints[index];
    const bool turns = joint.type == JointType::revolute;
    const auto along_and_about_z = [&] {
      add(2, true, joint.theta_deg, turns ? index : -1);
      add(2, false, joint.d_mm, turns ? -1 : index);
    };
    if (chain.convention == Convention::dh) along_and_about_z();
    if (chain.convention == Convention::mdh) add(0, true, joint.alpha_deg);
    add(0, false, joint.a_mm);
    add(1, false, joint.b_mm);
    if (chain.convention == Convention::dh) add(0, true, joint.alpha_deg);
    add(1, true, joint.beta_deg);
    if (chain.convention == Convention::mdh) along_and_about_z();
  }
};

std::string vector(const Eigen::Vector3d& v) {
  return fmt::format("{{{}, {}, {}}}", c_number(v(0)), c_number(v(1)), c_number(v(2)));
}

// One entry a joint.
template <typename Entry>
std::string table(const Chain& chain, const char* declaration, Entry entry) {
  std::string text = fmt::format("static const {} = {{", declaration);
  for (std::size_t j = 0; j < chain.joints.size(); ++j) text += (j == 0 ? "" : ", ") + entry(chain.joints[j]);
  return text + "};\n";
}

// Joints with a drive, in their order.
std::vector<Eigen::Index> drives_of(const Chain& chain) {
  std::vector<Eigen::Index> drives;
  for (std::size_t j = 0; j < chain.joints.size(); ++j) {
    if (!chain.joints[j].mimic) drives.push_back(static_cast<Eigen::Index>(j));
  }
  return drives;
}

// Tables in C of the joints that follow drives, and of the limits that this leaves to the drives.
std::string drive_tables(const Chain& chain) {
  const std::vector<Eigen::Index> drives = drives_of(chain);
  const std::vector<Follower> followers = followers_of(chain);
  Eigen::VectorXd low = Eigen::VectorXd::Constant(std::ssize(chain.joints), -std::numeric_limits<double>::infinity());
  Eigen::VectorXd high = -low;
  std::vector<std::string> all(chain.joints.size());
  for (std::size_t j = 0; j < chain.joints.size(); ++j) {
    const Joint& joint = chain.joints[j];
    const auto own = static_cast<Eigen::Index>(j);
    const auto follower = std::ranges::find(followers, own, &Follower::joint);
    const bool follows = follower != followers.end();
    const Eigen::Index leader = follows ? follower->leader : own;
    all[j] = fmt::format("{{{}, {}, {}}}", std::ranges::find(drives, leader) - drives.begin(),
                         c_number(follows ? follower->multiplier : 1.0), c_number(follows ? follower->offset : 0.0));
    if (!joint.limits) continue;
    low(own) = (*joint.limits)[0] / to_limit_unit(joint);
    high(own) = (*joint.limits)[1] / to_limit_unit(joint);
  }
  limit_leaders(followers, low, high);
  std::vector<std::string> lows;
  std::vector<std::string> highs;
  for (const Eigen::Index j : drives) {
    lows.push_back(c_number(low(j)));
    highs.push_back(c_number(high(j)));
  }
  return fmt::format(
      "static const struct @_following {{ int drive; double multiplier, offset; }} @_following[@_JOINTS] = {{{}}};\n"
      "static const int @_drives[@_DRIVES] = {{{}}};\n"
      "static const double @_low[@_DRIVES] = {{{}}};\nstatic const double @_high[@_DRIVES] = {{{}}};\n",
      fmt::join(all, ", "), fmt::join(drives, ", "), fmt::join(lows, ", "), fmt::join(highs, ", "));
}

std::string tables(const Robot& robot) {
  const Chain& chain = robot.chain;
  const Elements elements(chain);
  const auto deforms = [](const Effect& effect) { return effect_type(effect.type).elastic; };
  const int passes = std::ranges::any_of(robot.effects, deforms) ? 3 : robot.effects.empty() ? 0 : 1;
  const Eigen::Vector3d gravity = base_rotation_of(chain) * chain.gravity_m_s2;
  std::string text = fmt::format(
      "enum {{ @_JOINTS = {0}, @_DRIVES = {1}, @_ELEMENTS = {2}, @_PASSES = {3}, @_MOST = {4} }};\n",
      chain.joints.size(), drive_count(chain), elements.count(), passes, std::max<Eigen::Index>(6, drive_count(chain)));
  text += fmt::format("static const double @_reach = {};\nstatic const double @_gravity[3] = {};\n",
                      c_number(std::max(reach_of(chain), 1.0)), vector(gravity));
  text += fmt::format("static const double @_payload_centre[3] = {};\n", vector(chain.payload.com_mm));
  text += table(chain, "double @_signs[@_JOINTS]", [](const Joint& joint) { return c_number(joint.sign); });
  text += table(chain, "double @_masses[@_JOINTS]", [](const Joint& joint) { return c_number(joint.mass_kg); });
  text += drive_tables(chain);
  text += table(chain, "double @_centres[@_JOINTS][3]", [](const Joint& joint) { return vector(joint.com_mm); });
  text += table(chain, "int @_slides[@_JOINTS]",
                [](const Joint& joint) { return joint.type == JointType::prismatic ? "1" : std::string("0"); });
  std::string kinematics = c_kinematics;
  const std::size_t behind = kinematics.find("struct @_frame");
  kinematics.insert(behind,
                    "static const struct @_element @_elements[@_ELEMENTS + 1] = {\n" + elements.lines() + "};\n\n");
  return text + kinematics;
}

std::string deform(const Robot& robot, const std::vector<std::string>& conditions) {
  std::string statements;
  for (const Effect& effect : robot.effects) statements += effect_statement(robot.chain, effect, conditions);
  std::string text;
  for (const Effect& effect : robot.effects) {
    for (const std::string& function : effect_type(effect.type).in_c.functions) {
      if (text.find(function) == std::string::npos) text += function;
    }
  }
  return text +
         "\n/* What the effects add to the joint values. */\nstatic void @_deform(const double *conditions, const "
         "double "
         "*q, const struct @_load *loads, double *more) {\n  int j;\n  (void)conditions;\n  (void)q;\n  (void)loads;\n"
         "  for (j = 0; j < @_JOINTS; ++j) more[j] = 0.0;\n" +
         statements + "}\n";
}

std::string correct(const CorrectedRobot& robot) {
  std::string text = "\nstatic void @_correct(const double *q, double *point, double *turn) {\n  (void)turn;\n";
  if (!robot.correction) return text + "  (void)q;\n  (void)point;\n}\n";
  const Eigen::Matrix3d base = base_rotation_of(robot.robot.chain);
  const CorrectionTwist correction(*robot.correction, robot.robot.chain);
  text += fmt::format("  double error[{}];\n  if (@_tree_predict(q, error) != 0) return;\n",
                      outputs_of(*robot.correction).size());
  for (std::size_t k = 0; k < outputs_of(*robot.correction).size(); ++k) {
    const OutputColumn& seen = outputs_of(*robot.correction)[k];
    const std::size_t place = correction.places()[k];
    const Eigen::Index axis = place % 3;
    text += fmt::format("  error[{0}] = error[{0}] < {1} ? {1} : error[{0}] > {2} ? {2} : error[{0}];\n", k,
                        c_number(seen.low), c_number(seen.high));
    for (int row = 0; row < 3; ++row) {
      text +=
          fmt::format("  {}[{}] += {} * error[{}];\n", place < 3 ? "point" : "turn", row, c_number(base(row, axis)), k);
    }
  }
  return text + "}\n";
}

std::string header(const Robot& robot, const std::string& name) {
  std::string text = "/* A calibrated robot, written by llmt-robot.\n";
  std::size_t index = 0;
  for (const std::string& condition : c_conditions(robot)) {
    text += fmt::format("   conditions[{}]: {}\n", index++, condition);
  }
  index = 0;
  for (const Eigen::Index j : drives_of(robot.chain)) {
    text += fmt::format("   q[{}]: joint {}, {}\n", index++, j + 1,
                        robot.chain.joints[j].type == JointType::revolute ? "rad" : "mm");
  }
  const auto named = [](const std::string& of, const char* what) {
    return of.empty() ? std::string() : fmt::format(" {} {}", what, of);
  };
  // A name may hold what ends a comment.
  std::string frames = fmt::format("   Positions are of the{}, in mm, in the frame of the instrument{};\n",
                                   robot.chain.target.empty() || robot.chain.target == robot.chain.session
                                       ? " tool"
                                       : named(robot.chain.target, "target"),
                                   named(robot.chain.session, "in the session"));
  for (std::size_t at = frames.find("*/"); at != std::string::npos; at = frames.find("*/")) frames.erase(at, 1);
  return text + frames +
         with_name(R"(   rotations are nine numbers, row by row. */
#ifndef @_ROBOT_H
#define @_ROBOT_H

void @_forward(const double *conditions, const double *q, double *position, double *rotation);

/* Moves q one step towards a pose (rotation 0: a position), within the limits; returns how far the tool was from it,
   in mm, angles times the reach. Call it until that is small, at most some ten times. */
double @_step(const double *conditions, const double *position, const double *rotation, double *q);

#endif
)",
                   name);
}

}  // namespace

std::vector<std::string> c_conditions(const Robot& robot) {
  std::vector<std::string> names = {"payload_kg"};
  for (const Effect& effect : robot.effects) {
    const std::size_t joint = effect_index(robot.chain, effect);
    for (const std::string& columns : effect_columns(robot.chain, effect)) {
      const std::string column = condition_of(robot.chain, joint, columns);
      if (std::ranges::find(names, column) == names.end()) names.push_back(column);
    }
  }
  return names;
}

CSource to_c(const CorrectedRobot& robot, const std::string& name, const std::string& header_name) {
  if (!is_c_identifier(name) || name.size() > longest_name) {
    throw std::invalid_argument(
        fmt::format("llmt::robotics::to_c: name is \"{}\", must be an identifier of C of at most {} characters", name,
                    longest_name));
  }
  const std::string effects = deform(robot.robot, c_conditions(robot.robot));
  CSource result;
  result.header = header(robot.robot, name);
  if (robot.correction) {
    positions(robot, {.joints = Eigen::MatrixXd(0, std::ssize(robot.robot.chain.joints)), .covariates = {}});  // checks
    const auto source_of = [&](const auto& model) { return llmt::to_c(model, name + "_tree", header_name).source; };
    result.source = std::visit(source_of, *robot.correction);
    const std::string declared = fmt::format("#include \"{}\"\n", header_name);
    const std::size_t at = result.source.find(declared) + declared.size();
    result.source.insert(at, fmt::format("\nint {}_tree_predict(const double *inputs, double *outputs);\n", name));
  } else {
    result.source = fmt::format("#include \"{}\"\n\n#include <math.h>\n", header_name);
  }
  result.source += with_name(fmt::format("\n{}{}{}{}", tables(robot.robot), effects, correct(robot), c_solution), name);
  return result;
}

}  // namespace llmt::robotics
