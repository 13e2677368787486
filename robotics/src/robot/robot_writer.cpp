#include <fmt/format.h>

#include <algorithm>

#include "llmt/robotics/robot_file.hpp"
#include "robot/record_file.hpp"
#include "yaml/yaml_writer.hpp"

namespace llmt::robotics {
namespace {

void write_frame(YamlWriter& out, const std::string& key, const std::string& name, const Frame& frame) {
  out.key(key).begin_map();
  if (!name.empty()) out.word("name", name);
  out.numbers("xyz_mm", frame.xyz_mm).numbers("rpy_deg", frame.rpy_deg).end_map();
}

void write_frames(YamlWriter& out, const std::string& key, const std::vector<NamedFrame>& frames) {
  if (frames.empty()) return;
  out.key(key).begin_list(YAML::Block);
  for (const NamedFrame& named : frames) {
    out.begin_map().word("name", named.name).numbers("xyz_mm", named.frame.xyz_mm);
    out.numbers("rpy_deg", named.frame.rpy_deg);
    if (key == "bases" && is_sphere(named.name)) out.number("radius_mm", named.radius_mm);
    out.end_map();
  }
  out.end_list();
}

void write_joint(YamlWriter& out, const Joint& joint) {
  const bool turns = joint.type == JointType::revolute;
  out.begin_map().word("name", joint.name).word("type", turns ? "revolute" : "prismatic");
  out.number("alpha_deg", joint.alpha_deg).number("a_mm", joint.a_mm).optional("b_mm", joint.b_mm, 0.0);
  out.number("d_mm", joint.d_mm).number("theta_deg", joint.theta_deg).optional("beta_deg", joint.beta_deg, 0.0);
  out.optional("sign", joint.sign, 1.0);
  if (joint.limits) out.numbers(turns ? "limits_deg" : "limits_mm", *joint.limits);
  if (joint.gear_ratio) out.number("gear_ratio", *joint.gear_ratio);
  if (joint.mimic) {
    out.key("mimic").begin_map().word("joint", joint.mimic->joint).number("multiplier", joint.mimic->multiplier);
    out.optional(turns ? "offset_deg" : "offset_mm", joint.mimic->offset, 0.0).end_map();
  }
  out.optional("mass_kg", joint.mass_kg, 0.0);
  if (!joint.com_mm.isZero(0.0)) out.numbers("com_mm", joint.com_mm);
  out.end_map();
}

void write_formula(YamlWriter& out, const Formula& formula) {
  out.word("name", formula.name).key("terms").begin_list(YAML::Flow);
  for (const FormulaTerm& term : formula.terms) {
    out.begin_map().word(term.acts_on, term.text);
    if (!term.name.empty()) out.word("name", term.name);
    if (!term.unit.empty()) out.word("unit", term.unit);
    out.optional("scale", term.scale, 0.0).end_map();
  }
  out.end_list();
}

void write_effect(YamlWriter& out, const Chain& chain, const Effect& effect) {
  const EffectType& type = effect_type(effect.type);
  const std::vector<EffectParameter> parameters = effect_parameters(chain, effect);
  out.begin_map().word("type", effect.type);
  if (!effect.at.empty()) out.word("at", effect.at);
  if (type.has_formula) write_formula(out, effect.formula);
  const bool slides = !effect.at.empty() && type.place == EffectPlace::joint &&
                      chain.joints[joint_index(chain, effect.at)].type == JointType::prismatic;
  for (std::size_t k = 0; k < type.constants.size(); ++k) {
    const EffectConstant& constant = type.constants[k];
    out.number(slides && !constant.prismatic_key.empty() ? constant.prismatic_key : constant.key, effect.constants[k]);
  }
  if (!type.parameters.empty() && type.parameters[0].list) {
    out.numbers(parameters.empty() ? type.parameters[0].key : parameters[0].key, effect.values);
  } else {
    for (std::size_t k = 0; k < parameters.size(); ++k) out.number(parameters[k].key, effect.values[k]);
  }
  out.end_map();
}

void write_identified(YamlWriter& out, const Robot& robot) {
  const std::vector<discovery::Parameter> all = parameters(robot);
  out.key("identified").begin_list(YAML::Block);
  for (const IdentifiedParameter& entry : robot.identified) {
    out.begin_map().word("parameter", entry.name).word("state", entry.state);
    if (entry.standard_error) {
      const auto named = std::ranges::find(all, entry.name, &discovery::Parameter::name);
      out.number("standard_error", *entry.standard_error).word("unit", named == all.end() ? "" : named->unit);
    }
    out.end_map();
  }
  out.end_list();
}

}  // namespace

std::string to_yaml(const Robot& robot) {
  validate(robot);
  const Chain& chain = robot.chain;
  YamlWriter out;
  out.begin_map(YAML::Block)
      .word("name", chain.name)
      .word("convention", chain.convention == Convention::dh ? "dh" : "mdh");
  out.numbers("gravity_m_s2", chain.gravity_m_s2);
  if (!chain.orientation.empty()) out.word("orientation", chain.orientation);
  if (const UrdfLinks& links = robot.urdf_links; !links.base.empty() || !links.tip.empty()) {
    out.key("urdf").begin_map();
    if (!links.base.empty()) out.word("base_link", links.base);
    if (!links.tip.empty()) out.word("tip_link", links.tip);
    out.end_map();
  }
  write_frame(out, "base", chain.session, chain.base);
  write_frame(out, "tool", chain.target, chain.tool);
  write_frames(out, "bases", chain.bases);
  write_frames(out, "tools", chain.tools);
  if (chain.payload.mass_kg != 0.0 || !chain.payload.com_mm.isZero(0.0)) {
    out.key("payload")
        .begin_map()
        .number("mass_kg", chain.payload.mass_kg)
        .numbers("com_mm", chain.payload.com_mm)
        .end_map();
  }
  out.key("joints").begin_list(YAML::Block);
  for (const Joint& joint : chain.joints) write_joint(out, joint);
  out.end_list();
  if (!robot.effects.empty()) {
    out.key("effects").begin_list(YAML::Block);
    for (const Effect& effect : robot.effects) write_effect(out, chain, effect);
    out.end_list();
  }
  if (!robot.identified.empty()) write_identified(out, robot);
  if (robot.calibration) write_record(out, chain, *robot.calibration);
  if (!robot.correction_file.empty()) out.key("correction").begin_map().word("model", robot.correction_file).end_map();
  out.end_map();
  return out.finish();
}

}  // namespace llmt::robotics
