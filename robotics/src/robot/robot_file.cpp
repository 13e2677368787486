#include "llmt/robotics/robot_file.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <stdexcept>

#include "effects/formula_term.hpp"
#include "llmt/files.hpp"
#include "yaml/yaml_reader.hpp"

namespace llmt::robotics {
namespace {

Frame read_frame(YamlMap map) {
  Frame frame{.xyz_mm = map.vector_or("xyz_mm", Eigen::Vector3d::Zero()),
              .rpy_deg = map.vector_or("rpy_deg", Eigen::Vector3d::Zero())};
  map.finish({"xyz_mm", "rpy_deg"});
  return frame;
}

Payload read_payload(YamlMap map) {
  Payload payload{.mass_kg = map.number("mass_kg"), .com_mm = map.vector_or("com_mm", Eigen::Vector3d::Zero())};
  map.finish({"mass_kg", "com_mm"});
  return payload;
}

JointType read_joint_type(YamlMap& map) {
  const std::string type = map.text("type");
  if (type == "revolute") return JointType::revolute;
  if (type == "prismatic") return JointType::prismatic;
  map.refuse(fmt::format("\"type\" is \"{}\", must be revolute or prismatic", type));
}

Joint read_joint(YamlMap map) {
  Joint joint;
  joint.name = map.text("name");
  joint.type = read_joint_type(map);
  joint.alpha_deg = map.number("alpha_deg");
  joint.a_mm = map.number("a_mm");
  joint.d_mm = map.number("d_mm");
  joint.theta_deg = map.number("theta_deg");
  joint.beta_deg = map.number_or("beta_deg", 0.0);
  joint.b_mm = map.number_or("b_mm", 0.0);
  joint.sign = map.number_or("sign", 1.0);
  joint.mass_kg = map.number_or("mass_kg", 0.0);
  joint.com_mm = map.vector_or("com_mm", Eigen::Vector3d::Zero());
  if (map.has("gear_ratio")) joint.gear_ratio = map.number("gear_ratio");
  const std::string limits = joint.type == JointType::revolute ? "limits_deg" : "limits_mm";
  if (map.has(limits)) {
    const std::vector<double> values = map.numbers(limits, 2);
    joint.limits = {values[0], values[1]};
  }
  map.finish({"name", "type", "alpha_deg", "a_mm", "d_mm", "theta_deg", "beta_deg", "b_mm", "sign", "limits_deg",
              "limits_mm", "gear_ratio", "mass_kg", "com_mm"});
  return joint;
}

const EffectType& read_effect_type(YamlMap& map) {
  const std::string name = map.text("type");
  std::string known;
  for (const EffectType& type : effect_types()) {
    if (type.name == name) return type;
    known += (known.empty() ? "" : ", ") + type.name;
  }
  map.refuse(fmt::format("\"type\" is \"{}\", which is no effect; known: {}", name, known));
}

void read_formula(YamlMap& map, Formula& formula) {
  formula.name = map.text("name");
  for (YamlMap term : map.maps("terms")) {
    formula.terms.push_back(read_formula_term(term));
    term.finish({"name", "joint", "x", "y", "z", "unit", "scale"});
  }
}

Effect read_effect(YamlMap map, const Chain& chain) {
  const EffectType& type = read_effect_type(map);
  Effect effect{.type = type.name, .at = {}, .values = {}};
  std::vector<std::string> known = {"type"};
  bool slides = false;
  if (type.name == "formula") {
    read_formula(map, effect.formula);
    known.insert(known.end(), {"name", "terms", "at"});
    effect.at = map.text_or("at", "");
  } else if (type.place != EffectPlace::robot) {
    effect.at = map.text("at");
    known.emplace_back("at");
    const auto joint = std::ranges::find(chain.joints, effect.at, &Joint::name);
    slides = type.place == EffectPlace::joint && joint != chain.joints.end() && joint->type == JointType::prismatic;
  }
  const auto key_of = [&](const auto& entry) {
    known.push_back(slides && !entry.prismatic_key.empty() ? entry.prismatic_key : entry.key);
    return known.back();
  };
  for (const EffectConstant& constant : type.constants) effect.constants.push_back(map.number(key_of(constant)));
  for (const EffectParameter& parameter : type.parameters) {
    if (parameter.list) {
      effect.values = map.all_numbers(key_of(parameter));
    } else {
      effect.values.push_back(map.number(key_of(parameter)));
    }
  }
  map.finish(known);
  return effect;
}

IdentifiedParameter read_identified(YamlMap map, const std::vector<discovery::Parameter>& all) {
  IdentifiedParameter entry{.name = map.text("parameter"), .standard_error = {}, .state = map.text("state")};
  if (map.has("standard_error")) entry.standard_error = map.number("standard_error");
  const std::string unit = map.text_or("unit", "");
  map.finish({"parameter", "state", "standard_error", "unit"});
  for (const discovery::Parameter& parameter : all) {
    if (parameter.name != entry.name) continue;
    if (!unit.empty() && unit != parameter.unit) {
      map.refuse(fmt::format("\"unit\" of {} is \"{}\", must be {}", entry.name, unit, parameter.unit));
    }
    return entry;
  }
  map.refuse(fmt::format("\"parameter\" is \"{}\", which the robot does not have", entry.name));
}

Convention read_convention(YamlMap& map) {
  const std::string convention = map.text("convention");
  if (convention == "dh") return Convention::dh;
  if (convention == "mdh") return Convention::mdh;
  map.refuse(fmt::format("\"convention\" is \"{}\", must be dh or mdh", convention));
}

Chain read_chain(YamlMap& map) {
  Chain chain;
  chain.name = map.text("name");
  chain.convention = read_convention(map);
  chain.gravity_m_s2 = map.vector_or("gravity_m_s2", chain.gravity_m_s2);
  chain.orientation = map.text_or("orientation", "");
  if (map.has("base")) chain.base = read_frame(map.map("base"));
  if (map.has("tool")) chain.tool = read_frame(map.map("tool"));
  if (map.has("payload")) chain.payload = read_payload(map.map("payload"));
  for (const YamlMap& joint : map.maps("joints")) chain.joints.push_back(read_joint(joint));
  return chain;
}

// Mistakes that validate() finds belong to the file.
template <typename Check>
void check_in_file(const YamlMap& map, Check check) {
  try {
    check();
  } catch (const std::invalid_argument& error) {
    map.refuse(error.what());
  }
}

}  // namespace

Robot parse_robot(const std::string& text, const std::string& name) {
  YamlMap map(parse_yaml(text, name), name, "");
  Robot robot;
  robot.chain = read_chain(map);
  check_in_file(map, [&] { validate(robot); });
  if (map.has("effects")) {
    for (const YamlMap& effect : map.maps("effects")) {
      robot.effects.push_back(read_effect(effect, robot.chain));
      check_in_file(effect, [&] { validate(robot); });
    }
  }
  if (map.has("identified")) {
    const std::vector<discovery::Parameter> all = parameters(robot);
    for (const YamlMap& entry : map.maps("identified")) robot.identified.push_back(read_identified(entry, all));
  }
  if (map.has("correction")) {
    YamlMap correction = map.map("correction");
    robot.correction_file = correction.text("model");
    correction.finish({"model"});
  }
  map.finish({"name", "convention", "gravity_m_s2", "orientation", "base", "tool", "payload", "joints", "effects",
              "identified", "correction"});
  return robot;
}

Robot read_robot(const std::string& path) { return parse_robot(read_file(path, description_limit), path); }

void save(const Robot& robot, const std::string& path) { write_file(path, to_yaml(robot)); }

}  // namespace llmt::robotics
