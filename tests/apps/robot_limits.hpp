// Texts of so many parts, and robots and mechanisms of them, for the limits of llmt/limits.hpp.
#pragma once

#include <fmt/format.h>

#include <cstdint>
#include <string>

#include "llmt/robotics/mechanism/mechanism_file.hpp"
#include "llmt/robotics/robot_file.hpp"
#include "llmt/robotics/urdf.hpp"

namespace limits {

inline std::string times(std::int64_t count, const std::string& text) {
  std::string all;
  all.reserve(count * text.size());
  for (std::int64_t k = 0; k < count; ++k) all += text;
  return all;
}

inline std::string numbered(std::int64_t count, const char* pattern) {
  std::string all;
  for (std::int64_t k = 0; k < count; ++k) all += fmt::format(fmt::runtime(pattern), k);
  return all;
}

inline void read_mechanism(const std::string& parameters, const std::string& joints, const std::string& equations) {
  llmt::robotics::parse_mechanism(
      fmt::format("mechanism: m\nparameters: [{}]\njoints: [{}]\nequations: [{}]\n", parameters, joints, equations),
      "m");
}

inline const std::string any_joint = "{name: q, start_deg: 0, limits_deg: [-9, 9]},";

inline void read_robot(std::int64_t joints, const std::string& effects) {
  std::string text = "name: r\nconvention: dh\njoints:\n";
  text += numbered(joints, "  - {{name: j{}, type: revolute, alpha_deg: 90, a_mm: 100, d_mm: 0, theta_deg: 0}}\n");
  llmt::robotics::parse_robot(text + "effects:\n" + effects, "r");
}

// Effects with `values` coefficients each.
inline std::string effects(std::int64_t count, std::int64_t values) {
  const std::string terms = numbered(values, "{{name: c{0}, x: q1, unit: mm, scale: 1}},");
  std::string all;
  for (std::int64_t k = 0; k < count; ++k) {
    all += fmt::format("  - {{type: formula, name: f{}, terms: [{}], coefficients: [{}]}}\n", k, terms,
                       times(values, "0,"));
  }
  return all;
}

inline const std::string one_more =
    "  - {type: formula, name: g, terms: [{name: c, x: q1, unit: mm, scale: 1}], coefficients: [0]}\n";

inline void read_urdf(const std::string& links, const std::string& more) {
  llmt::robotics::parse_urdf(
      "<robot name=\"r\"><link name=\"a\"/><link name=\"b\"/>" + links +
          "<joint name=\"j\" type=\"continuous\"><parent link=\"a\"/><child link=\"b\"/><axis xyz=\"0 0 1\"/></joint>" +
          more + "</robot>",
      "r", {.base = "a", .tip = "b"});
}

}  // namespace limits
