#include "effects/joint_error.hpp"

#include <fmt/format.h>

namespace llmt::robotics {

std::string must_be_positive(const char* name, double value) {
  return value > 0.0 ? "" : std::string(name) + " is " + std::to_string(value) + ", must be > 0";
}

std::vector<EffectParameter> cosine_and_sine() {
  return {{.name = "cosine", .unit = "rad", .key = "cosine_rad"}, {.name = "sine", .unit = "rad", .key = "sine_rad"}};
}

EffectParameter angle(const std::string& name) {
  return {.name = name, .unit = "rad", .key = name + "_rad", .prismatic_unit = "mm", .prismatic_key = name + "_mm"};
}

EffectParameter joint_compliance_parameter() {
  return {.name = "compliance",
          .unit = "rad/(N m)",
          .key = "compliance_rad_per_Nm",
          .prismatic_unit = "m/N",
          .prismatic_key = "compliance_m_per_N"};
}

double largest_torque(const TrialContext& context, std::size_t joint) {
  constexpr double rounding = 1e-9;
  const double largest = context.loads.col(static_cast<Eigen::Index>(joint)).cwiseAbs().maxCoeff();
  return largest > rounding * context.loads.cwiseAbs().maxCoeff() ? largest : 0.0;
}

std::vector<std::vector<double>> shares_of_largest_torque(const TrialContext& context, std::size_t joint,
                                                          const std::vector<double>& shares) {
  const double largest = largest_torque(context, joint);
  if (!(largest > 0.0)) return {};
  std::vector<std::vector<double>> all;
  for (const double share : shares) all.push_back({std::stod(fmt::format("{:.1e}", share * largest))});
  return all;
}

std::string c_number(double value) {
  if (std::isinf(value)) return value > 0.0 ? "HUGE_VAL" : "-HUGE_VAL";
  std::string text = fmt::format("{}", value);
  if (text.find_first_of(".e") == std::string::npos) text += ".0";
  return text;
}

std::string c_harmonic(Values values, const std::string& angle) {
  return fmt::format("({} * cos({}) + {} * sin({}))", c_number(values[0]), angle, c_number(values[1]), angle);
}

const char* const c_sign = R"(
static double @_sign(double x) {
  return x > 0.0 ? 1.0 : x < 0.0 ? -1.0 : 0.0;
}
)";

}  // namespace llmt::robotics
