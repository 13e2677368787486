#include "blind/arms.hpp"

#include <array>
#include <cmath>
#include <numbers>
#include <stdexcept>

namespace blind {
namespace {

constexpr double radians = std::numbers::pi / 180.0;

struct Row {  // degrees, mm, kg
  double alpha, a, d, theta, low, high, mass;
  std::array<double, 3> com;
};

void add(Arm& arm, const Row& row) {
  Joint joint;
  joint.alpha = row.alpha * radians;
  joint.a = row.a * 1e-3;
  joint.d = row.d * 1e-3;
  joint.theta = row.theta * radians;
  joint.low = row.low * radians;
  joint.high = row.high * radians;
  joint.mass = row.mass;
  joint.com = Eigen::Vector3d(row.com[0], row.com[1], row.com[2]) * 1e-3;
  arm.joints.push_back(joint);
}

double off(llmt::Random& random, double low, double high) { return sign(random) * random.uniform(low, high); }

Eigen::Vector3d off3(llmt::Random& random, double low, double high) {
  Eigen::Vector3d v;
  for (int i = 0; i < 3; ++i) v(i) = off(random, low, high);
  return v;
}

}  // namespace

double log_uniform(llmt::Random& random, double low, double high) {
  return low * std::pow(high / low, random.uniform());
}

double sign(llmt::Random& random) { return random.uniform() < 0.5 ? -1.0 : 1.0; }

Arm nominal_arm(const std::string& name) {
  Arm arm;
  arm.name = name;
  if (name == "planar") {  // robots/planar_two_link.yaml, rigid
    arm.planar = true;
    arm.gravity = {0.0, -9.81, 0.0};
    arm.base.xyz = {0.0, 2.0, 0.0};
    arm.tool.xyz = {1.0, 0.0, 0.0};
    add(arm, {0, 0, 0, 0, -90, 90, 22.195352097611888, {500, 0, 0}});
    add(arm, {0, 1000, 0, 0, -135, 135, 22.195352097611888, {500, 0, 0}});
  } else if (name == "tx200") {  // robots/tx200_like.yaml
    arm.tool.xyz = {0.040, 0.0, 0.090};
    arm.payload_com = {0.0, 0.0, 0.060};
    add(arm, {0, 0, 642, 0, -180, 180, 300, {100, 0, -150}});
    add(arm, {-89.9955, 249.2886, 450.9658, -90.0587, -115, 120, 190, {420, 0, -150}});
    add(arm, {0.0192, 950.007, -450, 89.9319, -140, 145, 150, {0, -100, 60}});
    add(arm, {90.0423, 0.6907, 800.94, 0.0045, -270, 270, 60, {0, 0, -350}});
    add(arm, {-90.0598, -0.3995, 0, -0.0045, -115, 115, 25, {0, 0, 0}});
    add(arm, {90, 0, 194, 0, -270, 270, 10, {0, 0, -60}});
  } else if (name == "small6") {  // a light arm with an offset wrist; every number is ours
    arm.mdh = false;
    arm.tool.xyz = {0.025, 0.010, 0.120};
    arm.payload_com = {0.0, 0.020, 0.040};
    add(arm, {90, 0, 158, 0, -180, 180, 4.1, {0, -25, 10}});
    add(arm, {0, -436, 0, 0, -180, 180, 8.9, {215, 0, 118}});
    add(arm, {0, -384, 0, 0, -165, 165, 2.9, {170, 0, 22}});
    add(arm, {90, 0, 121, 0, -180, 180, 1.4, {0, -6, 14}});
    add(arm, {-90, 0, 98, 0, -180, 180, 1.4, {0, 6, 14}});
    add(arm, {0, 0, 87, 0, -180, 180, 0.3, {0, 0, -24}});
  } else {
    throw std::invalid_argument("no arm '" + name + "': planar, tx200 or small6");
  }
  arm.payload = scale_of(name).payloads.back();
  return arm;
}

ArmScale scale_of(const std::string& name) {
  if (name == "planar") return {{2, 10}, 1e-7, 1.5e-6, 1e-7, 1.5e-6, 1e-6, 1.5e-5, 0, 0, 1e-7, 1.5e-6};
  if (name == "tx200") return {{15, 90}, 1e-7, 1e-6, 1e-6, 4e-6, 7.7e-8, 2.5e-6, 2e-7, 4e-6, 4e-9, 5e-8};
  return {{0.6, 6}, 3e-6, 3e-5, 1e-5, 1e-4, 3e-6, 5e-5, 5e-6, 1e-4, 5e-7, 1e-5};
}

Arm build(Arm& described, llmt::Random& random, bool true_masses) {
  constexpr std::array<double, 8> ratios = {100, 101, 120.5, 121, 80, 161, 93.75, 125.4};
  const bool told = random.uniform() < 0.85;
  for (Joint& joint : described.joints) joint.gear_ratio = told ? ratios[random.below(ratios.size())] : 0.0;

  Arm arm = described;
  for (Joint& joint : arm.joints) {
    // An arm whose first axis is not where the description has it to gravity is tilted; geometry takes that into the
    // base frame unseen, but a soft arm shows it. Where softness is described, tilt is an effect of its own.
    const bool plumb = true_masses && &joint == &arm.joints.front();
    const double theta = off(random, 2e-4, 2e-3);
    joint.theta += plumb && arm.planar ? 0.0 : theta;
    joint.a += off(random, 2e-4, 1e-3);
    if (!arm.planar) {
      joint.d += off(random, 2e-4, 1e-3);
      const double alpha = off(random, 2e-4, 2e-3);
      const double beta = off(random, 2e-4, 2e-3);
      joint.alpha += plumb && arm.mdh ? 0.0 : alpha;
      joint.beta += plumb && arm.mdh ? 0.0 : beta;
    }
    if (!true_masses) {
      joint.mass *= 1.0 + random.uniform(-0.06, 0.06);
      joint.com += Eigen::Vector3d(random.uniform(-0.015, 0.015), random.uniform(-0.015, 0.015),
                                   arm.planar ? 0.0 : random.uniform(-0.015, 0.015));
    }
  }
  arm.tool.xyz += off3(random, 5e-4, 3e-3);
  arm.base.xyz += off3(random, 1e-3, 5e-3);
  arm.base.rpy += off3(random, 5e-4, 3e-3);
  const double where = random.uniform();
  if (where < 0.5) {  // an instrument that was aligned with the arm, or stands anywhere
    arm.base.xyz += off3(random, 0.5, 3.0);
    arm.base.rpy.z() += random.uniform(-std::numbers::pi, std::numbers::pi);
    if (where < 0.3) {  // roughly known
      described.base.xyz = arm.base.xyz + off3(random, 5e-3, 5e-2);
      described.base.rpy = arm.base.rpy + off3(random, 1e-3, 2e-2);
    }
  }
  if (arm.planar) {
    for (Frame* frame : {&arm.base, &arm.tool, &described.base}) {
      frame->xyz.z() = 0.0;
      frame->rpy.x() = frame->rpy.y() = 0.0;
    }
  }
  return arm;
}

}  // namespace blind
