/// \file
/// Robot descriptions in YAML.
///
///     Robot robot = read_robot("arm.yaml");
///     save(robot, "copy.yaml");
#pragma once

#include <string>

#include "llmt/robotics/robot.hpp"
#include "llmt/robotics/urdf.hpp"

namespace llmt::robotics {

/// Reads a robot description. Units stand in the keys:
///
///     name: arm
///     convention: mdh                # dh | mdh, see llmt::robotics::Convention
///     gravity_m_s2: [0, 0, -9.81]    # in the base frame; optional
///     orientation: intrinsic_xyz     # of rx, ry, rz in measurement files; optional
///     urdf: {base_link: base, tip_link: tool0}          # of the URDF that the arm was taken from; optional
///     base: {xyz_mm: [0, 0, 0], rpy_deg: [0, 0, 0]}     # T_world_base, optional
///     tool: {xyz_mm: [0, 0, 90], rpy_deg: [0, 0, 0]}    # T_flange_tool, optional
///     payload: {mass_kg: 10, com_mm: [0, 0, 0]}         # in the tool frame, optional
///     joints:                        # name, type, alpha_deg, a_mm, d_mm, theta_deg are required
///       - {name: joint1, type: revolute, alpha_deg: 0, a_mm: 0, b_mm: 0, d_mm: 642, theta_deg: 0, beta_deg: 0,
///          sign: 1, limits_deg: [-180, 180], gear_ratio: 100, mass_kg: 250, com_mm: [100, 0, -100]}   # limits_mm if
///          prismatic; a joint that follows another has mimic: {joint: joint2, multiplier: -1, offset_deg: 0}
///     effects:                       # optional; parameters and constants of effect_types() under their keys
///       - {type: joint_compliance, at: joint1, compliance_rad_per_Nm: 1e-7}
///       - {type: joint_map, at: joint2, first_rad: -1, step_rad: 0.5, values_rad: [0, 1e-4, 0]}
///       - {type: formula, at: joint2, name: belt, terms: [{joint: "cos(37 * q2)"}],
///          coefficients: [1e-4]}      # see FormulaTerm
///     identified:                    # optional; written by calibration, values stand above
///       - {parameter: joint1.a, state: free, standard_error: 0.01, unit: mm}
///     calibration: {poses: 150, noise_mm: 0.03, held_out_mm: 0.05, held_out_sd_mm: 0.02, correlations: [0.1, ...],
///       made_from: {program: llmt-robot 1.0.0, date: 2026-05-31, files: [{role: measurements, name: arm.csv, sha256:
///         ...}], options: [--robust], instrument: ..., serial_number: ...}, condition_ranges: {payload_kg: [0, 10]}}
///                                    # optional, likewise; correlations: lower triangle by rows
///     correction: {model: arm.correction.json}          # optional
///
/// Throws std::runtime_error `path:line: where: what` for a file that cannot be read or is no YAML, for unknown,
/// repeated or missing keys, wrong types and numbers that are not finite, and for whatever validate(Robot) refuses.
///
/// A file whose name ends in ".urdf" is read by read_urdf(): a chain without effects. `links` are for such files;
/// throws std::invalid_argument if there are any for another one.
Robot read_robot(const std::string& path, const UrdfLinks& links = {});

/// As read_robot(), from memory; `name` stands for the path in messages.
Robot parse_robot(const std::string& text, const std::string& name);

/// The description as text. Reading it gives the same robot, every number to the last bit.
std::string to_yaml(const Robot& robot);

/// Writes to_yaml() to a file that appears whole or not at all. Throws std::runtime_error naming the path.
void save(const Robot& robot, const std::string& path);

}  // namespace llmt::robotics
