// Effects of gears, encoders and bearings: each changes what one joint does.
#include <algorithm>
#include <cmath>
#include <numbers>

#include "effects/effect_entries.hpp"

namespace llmt::robotics {
namespace {

using Values = std::span<const double>;

// An effect that is an error of the joint value: rad, mm for a prismatic joint.
template <typename Error>
auto joint_error(Error error) {
  return [error](const PoseContext& pose, std::size_t j, Values values, Values constants, Deformation& deformation) {
    deformation.joint(j) += error(pose, j, values, constants);
  };
}

double joint_value(const PoseContext& pose, std::size_t j) { return pose.q(j); }

double sign(double value) { return value > 0.0 ? 1.0 : value < 0.0 ? -1.0 : 0.0; }

double harmonic(double angle, Values values) { return values[0] * std::cos(angle) + values[1] * std::sin(angle); }

double gain(const PoseContext& pose, std::size_t j, Values values, Values) { return values[0] * joint_value(pose, j); }

// A mark at angle q on a unit circle, seen from a point that lies (b, -a) off the circle's centre, all in radii.
double eccentricity(const PoseContext& pose, std::size_t j, Values values, Values) {
  const double cosine = std::cos(joint_value(pose, j));
  const double sine = std::sin(joint_value(pose, j));
  return std::atan2(values[0] * cosine + values[1] * sine, 1.0 + values[0] * sine - values[1] * cosine);
}

double eccentricity_twice(const PoseContext& pose, std::size_t j, Values values, Values) {
  return harmonic(2.0 * joint_value(pose, j), values);
}

double transmission_error(const PoseContext& pose, std::size_t j, Values values, Values constants) {
  return harmonic(constants[0] * joint_value(pose, j), values);
}

double joint_map(const PoseContext& pose, std::size_t j, Values values, Values constants) {
  const double last = static_cast<double>(values.size() - 1);
  const double at = std::clamp((joint_value(pose, j) - constants[0]) / constants[1], 0.0, last);
  const auto knot = std::min(static_cast<std::size_t>(at), values.size() - 1);
  const double beyond = at - static_cast<double>(knot);
  return beyond > 0.0 ? (1.0 - beyond) * values[knot] + beyond * values[knot + 1] : values[knot];
}

// A spring pulls with k (l - l0) between a point of the link and a fixed one; psi is the angle between their levers,
// the fixed lever is the unit of length: torque -K (1 - l0/l) sin psi, l^2 = 1 + ratio^2 - 2 ratio cos psi.
double counterbalance_spring(const PoseContext& pose, std::size_t j, Values values, Values constants) {
  const double q = joint_value(pose, j);
  const double first_order = harmonic(q, values);  // -K sin psi
  const double amplitude = std::hypot(values[0], values[1]);
  if (constants[1] == 0.0 || amplitude == 0.0) return first_order;
  const double cosine = (values[0] * std::sin(q) - values[1] * std::cos(q)) / amplitude;
  const double square = 1.0 + constants[0] * constants[0] - 2.0 * constants[0] * cosine;
  const double length = std::sqrt(std::max(square, 1e-24));  // where it vanishes, so does sin psi
  return first_order * (1.0 - constants[1] / length);
}

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
  const double unit = is_prismatic(pose.chain, j) ? 1.0 / metres : 1.0;
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

double wrist_coupling(const PoseContext& pose, std::size_t j, Values values, Values) {
  return values[0] * joint_value(pose, j - 1);
}

double read_back_lag(const PoseContext& pose, std::size_t j, Values values, Values) {
  return values[0] * (pose.columns[0] - joint_value(pose, j));
}

double not_settled(const PoseContext& pose, std::size_t, Values values, Values) { return -values[0] * pose.columns[0]; }

void apply_axis_wobble(const PoseContext& pose, std::size_t j, Values values, Values, Deformation& deformation) {
  const double q = joint_value(pose, j);
  const Eigen::Matrix3d& frame = pose.skeleton.joint_frame[j];
  twist_before(deformation, j).rotation_rad +=
      harmonic(q, values.first(2)) * frame.col(0) + harmonic(q, values.last(2)) * frame.col(1);
}

void apply_axis_wobble_at(const PoseContext& pose, std::size_t j, Values values, Values constants,
                          Deformation& deformation) {
  Deformation::Twist& twist = twist_before(deformation, j);
  const Eigen::Vector3d before = twist.rotation_rad;
  apply_axis_wobble(pose, j, values, constants, deformation);
  twist.translation_mm -= (twist.rotation_rad - before).cross(constants[0] * pose.skeleton.joint_frame[j].col(2));
}

std::string must_be_positive(const char* name, double value) {
  return value > 0.0 ? "" : std::string(name) + " is " + std::to_string(value) + ", must be > 0";
}

std::vector<EffectParameter> cosine_and_sine() {
  return {{.name = "cosine", .unit = "rad", .key = "cosine_rad"}, {.name = "sine", .unit = "rad", .key = "sine_rad"}};
}

EffectParameter angle(const std::string& name) {
  return {.name = name, .unit = "rad", .key = name + "_rad", .prismatic_unit = "mm", .prismatic_key = name + "_mm"};
}

std::vector<EffectType> periodic_effects() {
  return {
      {.name = "eccentricity",
       .family = "eccentricity",
       .formula =
           "dq_j = atan2(a cos q_j + b sin q_j, 1 + a sin q_j - b cos q_j): a circle seen from off its centre by "
           "sqrt(a^2 + b^2) radii; to first order a cos q_j + b sin q_j",
       .source = "Judd & Knasinski 1990; Caenen & Angue 1990",
       .parameters = cosine_and_sine(),
       .apply = joint_error(eccentricity),
       .linear = false,
       .prismatic = false},
      {.name = "eccentricity_twice",
       .family = "eccentricity_twice",
       .formula = "dq_j = a cos 2 q_j + b sin 2 q_j: an elliptic ring, a tilted disc",
       .source = "Judd & Knasinski 1990",
       .parameters = cosine_and_sine(),
       .apply = joint_error(eccentricity_twice),
       .prismatic = false},
      {.name = "transmission_error",
       .family = "transmission_error",
       .formula = "dq_j = a cos n q_j + b sin n q_j, n periods per turn; strain-wave gear: n = 2 gear ratio",
       .source = "Tuttle 1992; Slamani & Bonev 2013",
       .parameters = cosine_and_sine(),
       .constants = {{.name = "order_per_turn", .key = "order_per_turn", .usual = 100.0}},
       .apply = joint_error(transmission_error),
       .prismatic = false,
       .refusal = [](const Chain&, std::size_t,
                     Values constants) { return must_be_positive("order_per_turn", constants[0]); }},
      {.name = "joint_map",
       .family = "joint_map",
       .formula =
           "dq_j = values at equally spaced joint values first, first + step, ..., linear between, constant beyond",
       .source = "a table of errors, no physics",
       .parameters = {{.name = "value",
                       .unit = "rad",
                       .key = "values_rad",
                       .list = true,
                       .prismatic_unit = "mm",
                       .prismatic_key = "values_mm"}},
       .constants = {{.name = "first", .key = "first_rad", .usual = -std::numbers::pi, .prismatic_key = "first_mm"},
                     {.name = "step", .key = "step_rad", .usual = 0.1 * std::numbers::pi, .prismatic_key = "step_mm"}},
       .apply = joint_error(joint_map),
       .refusal = [](const Chain&, std::size_t, Values constants) { return must_be_positive("step", constants[1]); }},
  };
}

std::vector<EffectType> friction_effects() {
  return {
      {.name = "backlash_gravity",
       .family = "backlash_gravity",
       .formula = "dq_j = h sign(tau_j): the gap h on either side is taken up by the gravity torque; 0 "
                  "where that is less than a thousandth of the moment",
       .source = "Caenen & Angue 1990; Slamani & Bonev 2012",
       .parameters = {angle("half_gap")},
       .apply = joint_error(backlash_gravity),
       .senses = Senses::torques},
      {.name = "backlash_gravity_soft",
       .family = "backlash_gravity",
       .formula = "dq_j = h tanh(tau_j / s): the flanks of the teeth take up the load little by little",
       .source = "soft transition of a dead zone; Slamani & Bonev 2012",
       .parameters = {angle("half_gap")},
       .constants = {{.name = "softness", .key = "softness_Nm", .usual = 1.0, .prismatic_key = "softness_N"}},
       .apply = joint_error(backlash_gravity_soft),
       .senses = Senses::torques,
       .refusal = [](const Chain&, std::size_t,
                     Values constants) { return must_be_positive("softness", constants[0]); }},
      {.name = "backlash_approach",
       .family = "backlash_approach",
       .formula = "dq_j = -h s_j, s_j = +1 or -1: the direction in which the joint last moved",
       .source = "Slamani & Bonev 2012",
       .parameters = {angle("half_gap")},
       .columns = {"dir{}"},
       .apply = joint_error(backlash_approach)},
      {.name = "friction_under_load",
       .family = "friction_under_load",
       .formula =
           "dq_j = -k |tau_j| s_j, s_j = +1 or -1: the direction in which the joint last moved; Coulomb's friction "
           "of what carries the torque winds up the drive",
       .source = "Bittencourt & Gunnarsson 2012, load and temperature effects of static friction",
       .parameters = {{.name = "compliance",
                       .unit = "rad/(N m)",
                       .key = "compliance_rad_per_Nm",
                       .prismatic_unit = "m/N",
                       .prismatic_key = "compliance_m_per_N"}},
       .columns = {"dir{}"},
       .apply = joint_error(friction_under_load),
       .senses = Senses::torques},
      {.name = "hysteresis",
       .family = "hysteresis",
       .formula = "dq_j = -h sign(x) (1 - 2 exp(-|x| / delta)), x the joint's last move: Dahl's model, exponent 1, one "
                  "reversal after a long move the other way",
       .source = "Dahl 1968, a solid friction model",
       .parameters = {angle("half_width")},
       .constants = {{.name = "presliding", .key = "presliding_rad", .usual = 0.01, .prismatic_key = "presliding_mm"}},
       .columns = {"move{}_rad|move{}_mm"},
       .apply = joint_error(hysteresis),
       .refusal = [](const Chain&, std::size_t,
                     Values constants) { return must_be_positive("presliding", constants[0]); }},
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
       .refusal = [](const Chain&, std::size_t,
                     Values constants) { return must_be_positive("presliding", constants[0]); }},
  };
}

std::vector<EffectParameter> two_tilts() {
  return {{.name = "x_cosine", .unit = "rad", .key = "x_cosine_rad"},
          {.name = "x_sine", .unit = "rad", .key = "x_sine_rad"},
          {.name = "y_cosine", .unit = "rad", .key = "y_cosine_rad"},
          {.name = "y_sine", .unit = "rad", .key = "y_sine_rad"}};
}

std::vector<EffectType> drive_effects() {
  return {
      {.name = "joint_gain",
       .family = "joint_gain",
       .formula = "dq_j = e q_j",
       .source = "Judd & Knasinski 1990",
       .parameters = {{.name = "gain", .unit = "1", .key = "gain"}},
       .apply = joint_error(gain)},
      {.name = "counterbalance_spring",
       .family = "counterbalance_spring",
       .formula =
           "dq_j = (a cos q_j + b sin q_j)(1 - lambda / l), l^2 = 1 + rho^2 - 2 rho cos psi, -K sin psi = a cos q_j "
           "+ b sin q_j: a spring between a fixed point and one of the link, rho = lever on the link and lambda = "
           "free length, both over the fixed lever; free length 0: a cos q_j + b sin q_j",
       .source = "statics of a spring at two levers",
       .parameters = cosine_and_sine(),
       .constants = {{.name = "lever_ratio", .key = "lever_ratio", .usual = 0.0},
                     {.name = "free_length_ratio", .key = "free_length_ratio", .usual = 0.0}},
       .apply = joint_error(counterbalance_spring),
       .linear = false,
       .prismatic = false,
       .refusal = [](const Chain&, std::size_t, Values constants) -> std::string {
         return constants[0] >= 0.0 && constants[1] >= 0.0 ? "" : "lever_ratio and free_length_ratio must be >= 0";
       }},
      {.name = "wrist_coupling",
       .family = "wrist_coupling",
       .formula = "dq_j = k q_{j-1}: the joint before drags this one along",
       .source = "Khalil & Dombre 2002, coupled wrists",
       .parameters = {{.name = "ratio", .unit = "1", .key = "ratio"}},
       .apply = joint_error(wrist_coupling),
       .prismatic = false,
       .refusal = [](const Chain& chain, std::size_t j, Values) -> std::string {
         if (j == 0) return "the first joint has no joint before it";
         return is_prismatic(chain, j - 1) ? "the joint before is prismatic" : "";
       }},
      {.name = "axis_wobble",
       .family = "axis_wobble",
       .formula =
           "th = (a cos q_j + b sin q_j) x_j + (c cos q_j + d sin q_j) y_j about the joint's origin, x_j, y_j on the "
           "side that stands still; the joint's axis and everything beyond turn",
       .source = "bearing run-out; Judd & Knasinski 1990",
       .parameters = two_tilts(),
       .apply = apply_axis_wobble,
       .senses = Senses::arm,
       .prismatic = false},
      {.name = "axis_wobble_at",
       .family = "axis_wobble",
       .formula = "as axis_wobble, about the point of the axis at a distance from the joint's origin",
       .source = "bearing run-out; Judd & Knasinski 1990",
       .parameters = two_tilts(),
       .constants = {{.name = "pivot", .key = "pivot_mm", .usual = 0.0}},
       .apply = apply_axis_wobble_at,
       .senses = Senses::arm,
       .prismatic = false},
      {.name = "not_settled",
       .family = "not_settled",
       .formula = "dq_j = -k x, x the joint's last move: the pose was measured while the joint was still on its way",
       .source = "step response of a servo",
       .parameters = {{.name = "share", .unit = "1", .key = "share"}},
       .columns = {"move{}_rad|move{}_mm"},
       .apply = joint_error(not_settled)},
      {.name = "read_back_lag",
       .family = "read_back_lag",
       .formula = "dq_j = k (qmeas_j - q_j): the joint stands where it was read back, not where it was sent",
       .source = "servo following error",
       .parameters = {{.name = "share", .unit = "1", .key = "share"}},
       .columns = {"qmeas{}_rad|qmeas{}_mm"},
       .apply = joint_error(read_back_lag)},
  };
}

}  // namespace

std::vector<EffectType> joint_effects() {
  std::vector<EffectType> all = drive_effects();
  for (EffectType& type : periodic_effects()) all.push_back(std::move(type));
  for (EffectType& type : friction_effects()) all.push_back(std::move(type));
  return all;
}

}  // namespace llmt::robotics
