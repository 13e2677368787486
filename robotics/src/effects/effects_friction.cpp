// Effects of play and friction in the drive of a joint.
#include <fmt/format.h>

#include <cmath>

#include "effects/effect_entries.hpp"
#include "effects/joint_error.hpp"

namespace llmt::robotics {
namespace {

double backlash_gravity(const PoseContext& pose, std::size_t j, Values values, Values) {
  // About a vertical axis gravity has no torque except rounding errors and the part that the deflection of the arm
  // causes. Friction holds the joint there.
  constexpr double held = 1e-3;
  const double torque = gravity_load(pose, j);
  const Load& load = pose.load[j];
  const bool slides = is_prismatic(pose.chain, j);
  const double whole = slides ? load.force_N.norm() : load.moment_Nm.norm();
  return std::abs(torque) > held * whole ? values[0] * sign(torque) : 0.0;
}

double backlash_gravity_soft(const PoseContext& pose, std::size_t j, Values values, Values constants) {
  return values[0] * std::tanh(gravity_load(pose, j) / constants[0]);
}

double backlash_approach(const PoseContext& pose, std::size_t, Values values, Values) {
  return -values[0] * sign(pose.columns[0]);
}

double friction_under_load(const PoseContext& pose, std::size_t j, Values values, Values) {
  const double unit = compliance_unit(is_prismatic(pose.chain, j));
  return -values[0] * unit * std::abs(gravity_load(pose, j)) * sign(pose.columns[0]);
}

// -1 to 1: how far the drive is wound up at the end of a move.
double wound_up(double move, double presliding) {
  return sign(move) * (1.0 - 2.0 * std::exp(-std::abs(move) / presliding));
}

double hysteresis(const PoseContext& pose, std::size_t, Values values, Values constants) {
  return -values[0] * wound_up(pose.columns[0], constants[0]);
}

double hysteresis_approach(const PoseContext& pose, std::size_t, Values values, Values constants) {
  const double wound = wound_up(pose.columns[0], constants[0]);
  return -values[0] * wound - values[1] * (sign(pose.columns[1]) - wound);
}

const char* const c_pressed = R"(
static double @_pressed(const struct @_load *load, int slides) {
  const double *whole = slides ? load->force : load->moment;
  return fabs(load->about_axis) > 1e-3 * sqrt(@_dot(whole, whole)) ? @_sign(load->about_axis) : 0.0;
}
)";

std::string backlash_gravity_in_c(const CJoint& joint, Values values, Values) {
  return fmt::format("{} * @_pressed(&loads[{}], @_slides[{}])", c_number(values[0]), joint.index, joint.index);
}

std::string backlash_gravity_soft_in_c(const CJoint& joint, Values values, Values constants) {
  return fmt::format("{} * tanh({} / {})", c_number(values[0]), joint.torque, c_number(constants[0]));
}

std::string backlash_approach_in_c(const CJoint& joint, Values values, Values) {
  return fmt::format("-({}) * @_sign({})", c_number(values[0]), joint.columns[0]);
}

std::string friction_under_load_in_c(const CJoint& joint, Values values, Values) {
  return fmt::format("-({}) * fabs({}) * @_sign({})", c_number(values[0] * compliance_unit(joint.is_prismatic)),
                     joint.torque, joint.columns[0]);
}

std::string wound_up_in_c(const CJoint& joint, Values constants) {
  return fmt::format("(@_sign({0}) * (1.0 - 2.0 * exp(-fabs({0}) / {1})))", joint.columns[0], c_number(constants[0]));
}

std::string hysteresis_in_c(const CJoint& joint, Values values, Values constants) {
  return fmt::format("-({}) * {}", c_number(values[0]), wound_up_in_c(joint, constants));
}

std::string hysteresis_approach_in_c(const CJoint& joint, Values values, Values constants) {
  const std::string wound = wound_up_in_c(joint, constants);
  return fmt::format("-({}) * {} - ({}) * (@_sign({}) - {})", c_number(values[0]), wound, c_number(values[1]),
                     joint.columns[1], wound);
}

std::vector<std::vector<double>> softness_to_try(const TrialContext& context, std::size_t index) {
  return shares_of_largest_torque(context, index, {0.015, 0.035});
}

std::vector<std::vector<double>> presliding_to_try(const TrialContext&, std::size_t) {
  return {{0.005}, {0.015}, {0.04}, {0.1}, {0.3}};
}

// A known approach belongs to the move: without it the width of the hysteresis would be too small.
bool has_no_approach(const TrialContext& context, std::size_t index) {
  return !context.covariates.contains(with_joint_number("dir{}", index));
}

std::string presliding_refusal(const Chain&, std::size_t, Values constants) {
  return must_be_positive("presliding", constants[0]);
}

}  // namespace

std::vector<EffectType> friction_effects() {
  return {
      {.name = "backlash_gravity",
       .family = "backlash_gravity",
       .formula = "dq_j = h sign(tau_j): the gap h on either side is taken up by the gravity torque; 0 "
                  "where that is less than a thousandth of the moment",
       .source = "Caenen & Angue 1990; Slamani & Bonev 2012",
       .parameters = {angle("half_gap")},
       .apply = joint_error(backlash_gravity),
       .senses = Senses::torques,
       .nature = Nature::weight,
       .in_c = {.expression = backlash_gravity_in_c, .functions = {c_sign, c_pressed}}},
      {.name = "backlash_gravity_soft",
       .family = "backlash_gravity",
       .formula = "dq_j = h tanh(tau_j / s): the flanks of the teeth take up the load little by little",
       .source = "soft transition of a dead zone; Slamani & Bonev 2012",
       .parameters = {angle("half_gap")},
       .constants = {{.name = "softness", .key = "softness_Nm", .usual = 1.0, .prismatic_key = "softness_N"}},
       .apply = joint_error(backlash_gravity_soft),
       .senses = Senses::torques,
       .nature = Nature::weight,
       .refusal = [](const Chain&, std::size_t,
                     Values constants) { return must_be_positive("softness", constants[0]); },
       .trial = {.constants = softness_to_try},
       .in_c = {.expression = backlash_gravity_soft_in_c}},
      {.name = "backlash_approach",
       .family = "backlash_approach",
       .formula = "dq_j = -h s_j, s_j = +1 or -1: the direction in which the joint last moved",
       .source = "Slamani & Bonev 2012",
       .parameters = {angle("half_gap")},
       .columns = {"dir{}"},
       .apply = joint_error(backlash_approach),
       .in_c = {.expression = backlash_approach_in_c, .functions = {c_sign}}},
      {.name = "friction_under_load",
       .family = "friction_under_load",
       .formula =
           "dq_j = -k |tau_j| s_j, s_j = +1 or -1: the direction in which the joint last moved; Coulomb's friction "
           "of what carries the torque winds up the drive",
       .source = "Bittencourt & Gunnarsson 2012, load and temperature effects of static friction",
       .parameters = {joint_compliance_parameter()},
       .columns = {"dir{}"},
       .apply = joint_error(friction_under_load),
       .senses = Senses::torques,
       .in_c = {.expression = friction_under_load_in_c, .functions = {c_sign}}},
      {.name = "hysteresis",
       .family = "hysteresis",
       .formula = "dq_j = -h sign(x) (1 - 2 exp(-|x| / delta)), x the joint's last move: Dahl's model, exponent 1, one "
                  "reversal after a long move the other way",
       .source = "Dahl 1968, a solid friction model",
       .parameters = {angle("half_width")},
       .constants = {{.name = "presliding", .key = "presliding_rad", .usual = 0.01, .prismatic_key = "presliding_mm"}},
       .columns = {"move{}_rad|move{}_mm"},
       .apply = joint_error(hysteresis),
       .refusal = presliding_refusal,
       .trial = {.constants = presliding_to_try, .is_worth_it = has_no_approach, .fits_constant = true},
       .in_c = {.expression = hysteresis_in_c, .functions = {c_sign}}},
      {.name = "hysteresis_approach",
       .family = "hysteresis",
       .formula =
           "dq_j = -h w - g (s_j - w), w = sign(x)(1 - 2 exp(-|x| / delta)) as in hysteresis, s_j = +1 or -1 the "
           "direction of the approach at the end of the move, which turns the drive back by g of h",
       .source = "Dahl 1968; the approach is a second, short move",
       .parameters = {angle("half_width"), angle("turned_back")},
       .constants = {{.name = "presliding", .key = "presliding_rad", .usual = 0.01, .prismatic_key = "presliding_mm"}},
       .columns = {"move{}_rad|move{}_mm", "dir{}"},
       .apply = joint_error(hysteresis_approach),
       .refusal = presliding_refusal,
       .trial = {.constants = presliding_to_try, .fits_constant = true},
       .in_c = {.expression = hysteresis_approach_in_c, .functions = {c_sign}}},
  };
}

}  // namespace llmt::robotics
