// Effects of drives and bearings: gain, spring, coupling, wobble, and where the joint stood when it was measured.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "effects/effect_entries.hpp"
#include "effects/joint_error.hpp"

namespace llmt::robotics {
namespace {

double gain(const PoseContext& pose, std::size_t j, Values values, Values) { return values[0] * pose.q(j); }

// A spring pulls with k (l - l0) between a point of the link and a fixed one; psi is the angle between their levers,
// the fixed lever is the unit of length: torque -K (1 - l0/l) sin psi, l^2 = 1 + ratio^2 - 2 ratio cos psi.
double counterbalance_spring(const PoseContext& pose, std::size_t j, Values values, Values constants) {
  const double q = pose.q(j);
  const double first_order = harmonic(q, values);  // -K sin psi
  const double amplitude = std::hypot(values[0], values[1]);
  if (constants[1] == 0.0 || amplitude == 0.0) return first_order;
  const double cosine = (values[0] * std::sin(q) - values[1] * std::cos(q)) / amplitude;
  const double square = 1.0 + constants[0] * constants[0] - 2.0 * constants[0] * cosine;
  const double length = std::sqrt(std::max(square, 1e-24));  // where it vanishes, so does sin psi
  return first_order * (1.0 - constants[1] / length);
}

double wrist_coupling(const PoseContext& pose, std::size_t j, Values values, Values) {
  return values[0] * pose.q(j - 1);
}

double read_back_lag(const PoseContext& pose, std::size_t j, Values values, Values) {
  return values[0] * (pose.columns[0] - pose.q(j));
}

double not_settled(const PoseContext& pose, std::size_t, Values values, Values) { return -values[0] * pose.columns[0]; }

void apply_axis_wobble(const PoseContext& pose, std::size_t j, Values values, Values, Deformation& deformation) {
  const double q = pose.q(j);
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

std::vector<EffectParameter> two_tilts() {
  return {{.name = "x_cosine", .unit = "rad", .key = "x_cosine_rad"},
          {.name = "x_sine", .unit = "rad", .key = "x_sine_rad"},
          {.name = "y_cosine", .unit = "rad", .key = "y_cosine_rad"},
          {.name = "y_sine", .unit = "rad", .key = "y_sine_rad"}};
}

std::string gain_in_c(const CJoint& joint, Values values, Values) { return c_number(values[0]) + " * " + joint.q; }

std::string wrist_coupling_in_c(const CJoint& joint, Values values, Values) {
  return fmt::format("{} * q[{}]", c_number(values[0]), joint.index - 1);
}

std::string not_settled_in_c(const CJoint& joint, Values values, Values) {
  return fmt::format("-({}) * {}", c_number(values[0]), joint.columns[0]);
}

std::string read_back_lag_in_c(const CJoint& joint, Values values, Values) {
  return fmt::format("{} * ({} - {})", c_number(values[0]), joint.columns[0], joint.q);
}

std::string counterbalance_spring_in_c(const CJoint& joint, Values values, Values constants) {
  return fmt::format("@_spring({}, {}, {}, {}, {})", c_number(values[0]), c_number(values[1]), c_number(constants[0]),
                     c_number(constants[1]), joint.q);
}

const char* const c_spring = R"(
static double @_spring(double a, double b, double ratio, double free_length, double q) {
  const double first = a * cos(q) + b * sin(q);
  const double amplitude = sqrt(a * a + b * b);
  double square;
  if (free_length == 0.0 || amplitude == 0.0) return first;
  square = 1.0 + ratio * ratio - 2.0 * ratio * (a * sin(q) - b * cos(q)) / amplitude;
  return first * (1.0 - free_length / sqrt(square > 1e-24 ? square : 1e-24));
}
)";

// An axis that is upright at all poses has no weight to balance: a spring there would be an eccentricity by another
// name.
bool is_tilted(const TrialContext& context, std::size_t joint) {
  constexpr double level = 1e-3;  // rad: less is the error of a stand
  const Kinematics kinematics(context.chain);
  const Eigen::Vector3d gravity = context.chain.gravity_m_s2.normalized();
  for (Eigen::Index i = 0; i < context.joints.rows(); ++i) {
    const Skeleton arm = kinematics.skeleton(context.joints.row(i).transpose());
    const Eigen::Vector3d down = arm.base_rotation * gravity;
    if (arm.joint_axis[joint].cross(down).norm() > level) return true;
  }
  return false;
}

// The bearing is at one end of the offset along the axis or at the other. The length is rounded, so that it is the same
// in every round of a search.
std::vector<std::vector<double>> far_end_of_offset(const TrialContext& context, std::size_t index) {
  constexpr double length_mm = 10.0;
  const double offset = length_mm * std::round(context.chain.joints[index].d_mm / length_mm);
  if (offset == 0.0) return {};
  return {{offset}};
}

}  // namespace

std::vector<EffectType> drive_effects() {
  const std::string wobble_in_c = "it tilts the axis of a joint";
  return {
      {.name = "joint_gain",
       .family = "joint_gain",
       .formula = "dq_j = e q_j",
       .source = "Judd & Knasinski 1990",
       .parameters = {{.name = "gain", .unit = "1", .key = "gain"}},
       .apply = joint_error(gain),
       .nature = Nature::slow,
       .in_c = {.expression = gain_in_c}},
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
       .nature = Nature::slow,
       .linear = false,
       .prismatic = false,
       .refusal = [](const Chain&, std::size_t, Values constants) -> std::string {
         return constants[0] >= 0.0 && constants[1] >= 0.0 ? "" : "lever_ratio and free_length_ratio must be >= 0";
       },
       .trial = {.is_worth_it = is_tilted},
       .in_c = {.expression = counterbalance_spring_in_c, .functions = {c_spring}}},
      {.name = "wrist_coupling",
       .family = "wrist_coupling",
       .formula = "dq_j = k q_{j-1}: the joint before drags this one along",
       .source = "Khalil & Dombre 2002, coupled wrists",
       .parameters = {{.name = "ratio", .unit = "1", .key = "ratio"}},
       .apply = joint_error(wrist_coupling),
       .nature = Nature::slow,
       .prismatic = false,
       .refusal = [](const Chain& chain, std::size_t j, Values) -> std::string {
         if (j == 0) return "the first joint has no joint before it";
         return is_prismatic(chain, j - 1) ? "the joint before is prismatic" : "";
       },
       .in_c = {.expression = wrist_coupling_in_c}},
      {.name = "axis_wobble",
       .family = "axis_wobble",
       .formula =
           "th = (a cos q_j + b sin q_j) x_j + (c cos q_j + d sin q_j) y_j about the joint's origin, x_j, y_j on the "
           "side that stands still; the joint's axis and everything beyond turn",
       .source = "bearing run-out; Judd & Knasinski 1990",
       .parameters = two_tilts(),
       .apply = apply_axis_wobble,
       .senses = Senses::arm,
       .nature = Nature::slow,
       .prismatic = false,
       .in_c = {.refusal = wobble_in_c}},
      {.name = "axis_wobble_at",
       .family = "axis_wobble",
       .formula = "as axis_wobble, about the point of the axis at a distance from the joint's origin",
       .source = "bearing run-out; Judd & Knasinski 1990",
       .parameters = two_tilts(),
       .constants = {{.name = "pivot", .key = "pivot_mm", .usual = 0.0}},
       .apply = apply_axis_wobble_at,
       .senses = Senses::arm,
       .nature = Nature::slow,
       .prismatic = false,
       .trial = {.constants = far_end_of_offset},
       .in_c = {.refusal = wobble_in_c}},
      {.name = "not_settled",
       .family = "not_settled",
       .formula = "dq_j = -k x, x the joint's last move: the pose was measured while the joint was still on its way",
       .source = "step response of a servo",
       .parameters = {{.name = "share", .unit = "1", .key = "share"}},
       .columns = {"move{}_rad|move{}_mm"},
       .apply = joint_error(not_settled),
       .in_c = {.expression = not_settled_in_c}},
      {.name = "read_back_lag",
       .family = "read_back_lag",
       .formula = "dq_j = k (qmeas_j - q_j): the joint stands where it was read back, not where it was sent",
       .source = "servo following error",
       .parameters = {{.name = "share", .unit = "1", .key = "share"}},
       .columns = {"qmeas{}_rad|qmeas{}_mm"},
       .apply = joint_error(read_back_lag),
       .in_c = {.expression = read_back_lag_in_c}},
  };
}

}  // namespace llmt::robotics
