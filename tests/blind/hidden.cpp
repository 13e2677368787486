#include "blind/hidden.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <stdexcept>

namespace blind {

std::string joint_name(int joint) { return fmt::format("joint{}", joint + 1); }

Hidden draw(const std::string& kind, const Scene& scene) {
  Hidden hidden;
  hidden.kind = kind;
  if (draw_elastic(hidden, scene) || draw_drive(hidden, scene) || draw_frame(hidden, scene) ||
      draw_unknown(hidden, scene)) {
    return hidden;
  }
  throw std::invalid_argument("no effect of kind '" + kind + "'");
}

std::vector<std::string> catalogue_kinds(const Arm& arm) {
  std::vector<std::string> kinds = {"joint_compliance",
                                    "link_bending",
                                    "elastic_base",
                                    "payload_error",
                                    "gravity_tilt",
                                    "backlash_gravity",
                                    "backlash_approach",
                                    "hysteresis",
                                    "eccentricity",
                                    "eccentricity_twice",
                                    "transmission_error_gear",
                                    "transmission_error_order",
                                    "joint_gain",
                                    "wrist_coupling",
                                    "thermal_growth",
                                    "counterbalance_spring",
                                    "read_back_lag",
                                    "tracker_knock",
                                    "drift"};
  if (!arm.planar) kinds.insert(kinds.end(), {"link_torsion", "axis_wobble"});
  return kinds;
}

std::vector<std::string> unknown_kinds() {
  return {"cable", "worn_tooth", "step", "cross", "loose_flange", "friction_load"};
}

bool in_catalogue(const std::string& kind) {
  const std::vector<std::string> unknown = unknown_kinds();
  return std::ranges::find(unknown, kind) == unknown.end() && kind != "saw" && !kind.starts_with("instrument_");
}

std::string family(const std::string& kind) {
  if (kind == "backlash_soft") return "backlash_gravity";
  return kind.starts_with("transmission_error_") ? "transmission_error" : kind;
}

bool needs_elastic_description(const std::string& kind) {
  return kind == "payload_error" || kind == "gravity_tilt" || kind == "counterbalance_spring";
}

}  // namespace blind
