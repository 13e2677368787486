#include "llmt/robotics/robot_file.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <set>
#include <stdexcept>

#include "effects/effect_entries.hpp"
#include "effects/formula_term.hpp"
#include "kinematics/checks.hpp"
#include "llmt/files.hpp"
#include "llmt/limits.hpp"
#include "robot/checks.hpp"
#include "robot/record_file.hpp"
#include "yaml/yaml_reader.hpp"

namespace llmt::robotics {
namespace {

// Mistakes that the checks of a chain or an effect find belong to the file.
template <typename Check>
void check_in_file(const YamlMap& map, Check check) {
  try {
    check();
  } catch (const FieldError& error) {
    map.refuse(error.field, error.what());
  } catch (const std::invalid_argument& error) {
    map.refuse(error.what());
  }
}

Frame read_frame(YamlMap map, std::string& name) {
  if (map.has("name")) name = map.text("name");
  Frame frame{.xyz_mm = map.vector_or("xyz_mm", Eigen::Vector3d::Zero()),
              .rpy_deg = map.vector_or("rpy_deg", Eigen::Vector3d::Zero())};
  map.finish({"name", "xyz_mm", "rpy_deg"});
  return frame;
}

std::vector<NamedFrame> read_frames(YamlMap& map, const std::string& key) {
  constexpr std::size_t most = 1000;
  std::vector<NamedFrame> frames;
  if (!map.has(key)) return frames;
  for (YamlMap entry : map.maps(key, most)) {
    NamedFrame& frame = frames.emplace_back();
    frame.name = entry.text("name");
    frame.frame.xyz_mm = entry.vector_or("xyz_mm", Eigen::Vector3d::Zero());
    frame.frame.rpy_deg = entry.vector_or("rpy_deg", Eigen::Vector3d::Zero());
    std::vector<std::string> keys = {"name", "xyz_mm", "rpy_deg"};
    if (key == "bases" && is_sphere(frame.name)) {
      frame.radius_mm = entry.number("radius_mm");
      keys.emplace_back("radius_mm");
    }
    entry.finish(keys);
  }
  return frames;
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
  map.refuse("type", fmt::format("\"type\" is \"{}\", must be revolute or prismatic", type));
}

Mimic read_mimic(YamlMap map, JointType type) {
  const std::string offset = type == JointType::revolute ? "offset_deg" : "offset_mm";
  const Mimic mimic{
      .joint = map.text("joint"), .multiplier = map.number_or("multiplier", 1.0), .offset = map.number_or(offset, 0.0)};
  map.finish({"joint", "multiplier", offset});
  return mimic;
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
  if (map.has("mimic")) joint.mimic = read_mimic(map.map("mimic"), joint.type);
  map.finish({"name", "type", "alpha_deg", "a_mm", "d_mm", "theta_deg", "beta_deg", "b_mm", "sign", "limits_deg",
              "limits_mm", "gear_ratio", "mass_kg", "com_mm", "mimic"});
  return joint;
}

const EffectType& read_effect_type(YamlMap& map) {
  const std::string name = map.text("type");
  std::string known;
  for (const EffectType& type : effect_types()) {
    if (type.name == name) return type;
    known += (known.empty() ? "" : ", ") + type.name;
  }
  map.refuse("type", fmt::format("\"type\" is \"{}\", which is no effect; known: {}", name, known));
}

// Each term is checked by itself, so that a mistake is found at its line.
void read_formula(YamlMap& map, const Chain& chain, Effect& effect) {
  effect.formula.name = map.text("name");
  for (YamlMap term : map.maps("terms", most(Limit::robot_effect_values))) {
    effect.formula.terms.push_back(read_formula_term(term));
    term.finish({"name", "joint", "x", "y", "z", "unit", "scale"});
    const std::string reason = term_refusal(chain, effect, effect.formula.terms.back());
    if (!reason.empty()) term.refuse(effect.formula.terms.back().acts_on, reason);
  }
}

Effect read_effect(YamlMap map, const Chain& chain) {
  const EffectType& type = read_effect_type(map);
  Effect effect{.type = type.name, .at = {}, .values = {}};
  std::vector<std::string> known = {"type"};
  bool slides = false;
  if (type.has_formula) {
    effect.at = map.text_or("at", "");
    read_formula(map, chain, effect);
    known.insert(known.end(), {"name", "terms", "at"});
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
      effect.values = map.all_numbers(key_of(parameter), most(Limit::robot_effect_values));
    } else {
      effect.values.push_back(map.number(key_of(parameter)));
    }
  }
  map.finish(known);
  return effect;
}

std::vector<Effect> read_effects(YamlMap& map, const Chain& chain) {
  std::vector<Effect> effects;
  std::set<std::string> seen;
  std::size_t values = 0;
  for (const YamlMap& entry : map.maps("effects", most(Limit::robot_effects))) {
    const Effect& effect = effects.emplace_back(read_effect(entry, chain));
    check_in_file(entry, [&] { validate(chain, effect); });
    if (!seen.insert(effect_label(effect)).second) {
      entry.refuse(fmt::format("effect {} is there twice", effect_label(effect)));
    }
    values += effect.values.size();
    if (values > most(Limit::robot_effect_values)) {
      entry.refuse(fmt::format("the effects have {} values up to here, at most {} are possible", values,
                               most(Limit::robot_effect_values)));
    }
  }
  return effects;
}

std::vector<IdentifiedParameter> read_identified(YamlMap& map, const Robot& robot) {
  std::map<std::string, std::string> unit_of;
  for (const discovery::Parameter& parameter : parameters(robot)) unit_of[parameter.name] = parameter.unit;
  std::vector<IdentifiedParameter> all;
  std::set<std::string> seen;
  for (YamlMap& entry : map.maps("identified", unit_of.size())) {
    IdentifiedParameter& read = all.emplace_back();
    read.name = entry.text("parameter");
    read.state = entry.text("state");
    if (entry.has("standard_error")) read.standard_error = entry.number("standard_error");
    const std::string unit = entry.text_or("unit", "");
    entry.finish({"parameter", "state", "standard_error", "unit"});
    const auto known = unit_of.find(read.name);
    if (known == unit_of.end()) {
      entry.refuse("parameter", fmt::format("\"parameter\" is \"{}\", which the robot does not have", read.name));
    }
    if (!unit.empty() && unit != known->second) {
      entry.refuse("unit", fmt::format("\"unit\" of {} is \"{}\", must be {}", read.name, unit, known->second));
    }
    if (!seen.insert(read.name).second) entry.refuse(fmt::format("\"{}\" is there twice", read.name));
  }
  return all;
}

Convention read_convention(YamlMap& map) {
  const std::string convention = map.text("convention");
  if (convention == "dh") return Convention::dh;
  if (convention == "mdh") return Convention::mdh;
  map.refuse("convention", fmt::format("\"convention\" is \"{}\", must be dh or mdh", convention));
}

// Joints first: each is checked as it comes, and what is wrong with the rest of the chain is found at its own line.
Chain read_chain(YamlMap& map) {
  Chain chain;
  chain.name = map.text("name");
  chain.convention = read_convention(map);
  for (const YamlMap& joint : map.maps("joints", most(Limit::robot_joints))) {
    chain.joints.push_back(read_joint(joint));
    Chain so_far = chain;
    for (Joint& each : so_far.joints) each.mimic.reset();  // it may mimic a joint that comes later
    check_in_file(joint, [&] { validate(so_far); });
  }
  chain.gravity_m_s2 = map.vector_or("gravity_m_s2", chain.gravity_m_s2);
  chain.orientation = map.text_or("orientation", "");
  if (map.has("base")) chain.base = read_frame(map.map("base"), chain.session);
  if (map.has("tool")) chain.tool = read_frame(map.map("tool"), chain.target);
  chain.bases = read_frames(map, "bases");
  chain.tools = read_frames(map, "tools");
  if (map.has("payload")) chain.payload = read_payload(map.map("payload"));
  check_in_file(map, [&] { validate(chain); });
  return chain;
}

}  // namespace

Robot parse_robot(const std::string& text, const std::string& name) {
  YamlMap map(parse_yaml(text, name), name, "");
  if (map.has("mechanism")) map.refuse("mechanism", "this is a mechanism and no arm: llmt-robot mechanism reads it");
  Robot robot;
  robot.chain = read_chain(map);
  if (map.has("effects")) robot.effects = read_effects(map, robot.chain);
  if (map.has("identified")) robot.identified = read_identified(map, robot);
  if (map.has("calibration")) robot.calibration = read_record(map.map("calibration"), robot);
  if (map.has("correction")) {
    YamlMap correction = map.map("correction");
    robot.correction_file = correction.text("model");
    correction.finish({"model"});
  }
  if (map.has("urdf")) {
    YamlMap urdf = map.map("urdf");
    robot.urdf_links = {.base = urdf.text_or("base_link", ""), .tip = urdf.text_or("tip_link", "")};
    urdf.finish({"base_link", "tip_link"});
  }
  map.finish({"name", "convention", "gravity_m_s2", "orientation", "urdf", "base", "tool", "bases", "tools", "payload",
              "joints", "effects", "identified", "calibration", "correction"});
  return robot;
}

Robot read_robot(const std::string& path, const UrdfLinks& links) {
  if (is_urdf(path)) {
    Robot robot;
    robot.chain = read_urdf(path, links);
    robot.urdf_links = links;
    return robot;
  }
  if (!links.base.empty() || !links.tip.empty()) {
    throw std::invalid_argument(fmt::format("llmt::robotics::read_robot: links are given, and {} is no URDF", path));
  }
  return parse_robot(read_file(path, description_limit), path);
}

void save(const Robot& robot, const std::string& path) { write_file(path, to_yaml(robot)); }

}  // namespace llmt::robotics
