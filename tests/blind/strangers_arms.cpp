#include <cmath>
#include <numbers>
#include <stdexcept>

#include "blind/arms.hpp"
#include "blind/strangers.hpp"

namespace blind {
namespace {

constexpr double to_radians = std::numbers::pi / 180.0;

struct Link {  // degrees, mm, kg
  double alpha, a, d, theta, low, high, mass, com_x, com_y, com_z;
};

void add_links(Arm& arm, const std::vector<Link>& links) {
  for (const Link& link : links) {
    Joint joint;
    joint.alpha = link.alpha * to_radians;
    joint.a = link.a * 1e-3;
    joint.d = link.d * 1e-3;
    joint.theta = link.theta * to_radians;
    joint.low = link.low * to_radians;
    joint.high = link.high * to_radians;
    joint.mass = link.mass;
    joint.com = Eigen::Vector3d(link.com_x, link.com_y, link.com_z) * 1e-3;
    arm.joints.push_back(joint);
  }
}

double either(llmt::Random& random, double low, double high) { return sign(random) * random.uniform(low, high); }

Eigen::Vector3d either3(llmt::Random& random, double low, double high) {
  Eigen::Vector3d v;
  for (int i = 0; i < 3; ++i) v(i) = either(random, low, high);
  return v;
}

}  // namespace

std::vector<std::string> stranger_arm_names() { return {"scara2", "mini6", "big6", "cobot6", "arm7"}; }

Arm stranger_arm(const std::string& name) {
  Arm arm;
  arm.name = name;
  if (name == "scara2") {  // a bench arm of two aluminium links that moves in a vertical plane
    arm.planar = true;
    arm.gravity = {0.0, -9.81, 0.0};
    arm.tool.xyz = {0.35, 0.0, 0.0};
    add_links(arm, {{0, 0, 0, 0, -70, 160, 6.2, 180, 0, 0}, {0, 450, 0, 0, -140, 140, 3.4, 140, 0, 0}});
  } else if (name == "mini6") {  // lengths and masses of a UR3 (Universal Robots, DH parameters for calculations)
    arm.mdh = false;
    arm.tool.xyz = {0.015, -0.020, 0.095};
    arm.payload_com = {0.010, 0.0, 0.030};
    add_links(arm, {{90, 0, 151.9, 0, -170, 170, 2.0, 0, -20, 0},
                    {0, -243.65, 0, 0, -170, 0, 3.42, 130, 0, 116},
                    {0, -213.25, 0, 0, -140, 140, 1.26, 50, 0, 24},
                    {90, 0, 112.35, 0, -170, 170, 0.8, 0, 0, 10},
                    {-90, 0, 85.35, 0, -170, 170, 0.8, 0, 0, 10},
                    {0, 0, 81.9, 0, -170, 170, 0.35, 0, 0, -20}});
  } else if (name == "big6") {  // lengths of a KUKA KR 270 R2700, masses of the order of Klimchik et al. 2012
    arm.tool.xyz = {0.080, 0.0, 0.210};
    arm.payload_com = {0.050, 0.0, 0.120};
    add_links(arm, {{0, 0, 675, 0, -170, 170, 420, 150, 20, -180},
                    {-90, 350, 0, -90, -50, 95, 330, 540, 40, -160},
                    {0, 1150, 0, 0, -120, 60, 290, 120, 260, 30},
                    {-90, -41, 1200, 0, -180, 180, 55, 0, 0, -220},
                    {90, 0, 0, 0, -115, 115, 38, 0, 0, 0},
                    {-90, 0, 215, 0, -180, 180, 14, 0, 0, -70}});
  } else if (name == "cobot6") {  // lengths and masses of a UR10e (Universal Robots, as above)
    arm.mdh = false;
    arm.tool.xyz = {0.0, 0.035, 0.140};
    arm.payload_com = {0.0, 0.0, 0.050};
    add_links(arm, {{90, 0, 180.7, 0, -180, 180, 7.369, 21, 0, 27},
                    {0, -612.7, 0, 0, -160, -10, 13.051, 380, 0, 158},
                    {0, -571.55, 0, 0, -150, 150, 3.989, 240, 0, 68},
                    {90, 0, 174.15, 0, -180, 180, 2.1, 0, 7, 18},
                    {-90, 0, 119.85, 0, -180, 180, 1.98, 0, 7, 18},
                    {0, 0, 116.55, 0, -180, 180, 0.615, 0, 0, -26}});
  } else if (name == "arm7") {  // lengths of a KUKA LBR iiwa 14, masses of its published models, rounded
    arm.tool.xyz = {0.030, 0.020, 0.110};
    arm.payload_com = {0.0, 0.0, 0.060};
    add_links(arm, {{0, 0, 360, 0, -165, 165, 5.76, 0, -30, -40},
                    {-90, 0, 0, 0, -115, 115, 6.35, 0, -59, 42},
                    {90, 0, 420, 0, -165, 165, 3.5, 0, 30, -90},
                    {90, 0, 0, 0, -115, 115, 3.5, 0, 67, 34},
                    {-90, 0, 400, 0, -165, 165, 3.5, 0, 21, -140},
                    {-90, 0, 0, 0, -115, 115, 1.8, 0, 1, 0},
                    {90, 0, 126, 0, -170, 170, 1.2, 0, 0, -30}});
  } else {
    throw std::invalid_argument("no arm '" + name + "'");
  }
  arm.payload = stranger_scale(name).payloads.back();
  return arm;
}

// Strain-wave gears: torsional stiffness K1 by Harmonic Drive's CSF/CSG catalogue, N m/rad: size 8 0.9e3, 11 2.7e3,
// 14 4.7e3, 17 1e4, 20 1.6e4, 25 3.1e4, 32 6.7e4, 40 1.3e5; transmission error 1 to 1.5 arc minutes below size 20,
// hysteresis loss 1 to 3 arc minutes. Cycloidal gears: Nabtesco RV, 49 (RV-20E) to 980 (RV-320E) N m per arc minute,
// lost motion 1 arc minute. Links: tubes of 50 to 90 mm with 2 to 4 mm of aluminium. Stands: a tenth of a millimetre
// to some millimetres per 100 N at a metre. Encoders: magnetic rings to 0.05 deg, optical ones to 10 arc seconds.
StrangerScale stranger_scale(const std::string& name) {
  if (name == "scara2")
    return {{0.5, 3}, 3e-5, 2.5e-4, 3e-5, 2.5e-4, 1e-5, 2e-4, 2e-6, 6e-5, 1e-4, 8e-4, 6e-5, 5e-4, 6e-5, 9e-4};
  if (name == "mini6")
    return {{0.3, 2.5}, 6e-5, 3.7e-4, 2.1e-4, 1.1e-3, 2e-5, 3e-4, 5e-6, 8e-5, 1e-4, 8e-4, 8e-5, 5e-4, 8e-5, 9e-4};
  if (name == "big6")
    return {{0, 180}, 2e-7, 1.5e-6, 1e-6, 8e-6, 2e-8, 6e-7, 1e-8, 3e-7, 2e-5, 1.6e-4, 1.5e-5, 1.2e-4, 1.5e-5, 2e-4};
  if (name == "cobot6")
    return {{0, 8}, 7e-6, 3.2e-5, 3.2e-5, 1.2e-4, 4e-6, 6e-5, 8e-7, 2.5e-5, 5e-5, 4.5e-4, 5e-5, 3e-4, 3e-5, 5e-4};
  return {{0, 10}, 1e-5, 6e-5, 6e-5, 3.7e-4, 5e-6, 8e-5, 1e-6, 3e-5, 5e-5, 4.5e-4, 5e-5, 3e-4, 3e-5, 5e-4};
}

Arm build_stranger(Arm& described, llmt::Random& random) {
  Arm arm = described;
  const double size = arm.planar ? 0.5 : arm.joints[1].mass > 100.0 ? 2.0 : 0.7;
  for (Joint& joint : arm.joints) {
    joint.theta += either(random, 1e-4, 3e-3);
    joint.a += size * either(random, 1e-4, 8e-4);
    joint.mass *= 1.0 + random.uniform(-0.08, 0.08);
    joint.com += 0.012 * size * Eigen::Vector3d(random.uniform(-1, 1), random.uniform(-1, 1), 0.0);
    if (arm.planar) continue;
    joint.d += size * either(random, 1e-4, 8e-4);
    joint.alpha += either(random, 1e-4, 1.5e-3);
    joint.beta += either(random, 1e-4, 1.5e-3);
    joint.com.z() += 0.012 * size * random.uniform(-1, 1);
  }
  arm.tool.xyz += either3(random, 1e-3, 6e-3);
  const double away = random.uniform(1.8, 4.0);
  const double around = random.uniform(-std::numbers::pi, std::numbers::pi);
  arm.base.xyz = {away * std::cos(around), away * std::sin(around), random.uniform(-0.8, 0.2)};
  arm.base.rpy = {either(random, 1e-4, 4e-3), either(random, 1e-4, 4e-3),
                  random.uniform(-std::numbers::pi, std::numbers::pi)};
  if (arm.planar) {
    for (Frame* frame : {&arm.base, &arm.tool}) {
      frame->xyz.z() = 0.0;
      frame->rpy.x() = frame->rpy.y() = 0.0;
    }
  }
  return arm;
}

}  // namespace blind
