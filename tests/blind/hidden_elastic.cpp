// What weight does to an arm, by MuJoCo.
#include <algorithm>
#include <cmath>
#include <numbers>

#include "blind/hidden.hpp"

namespace blind {
namespace {

using Eigen::Vector3d;

Vector3d direction(llmt::Random& random, bool planar) {
  Vector3d v(random.normal(), random.normal(), planar ? 0.0 : random.normal());
  return v.normalized();
}

double largest_torque(const Scene& s, int joint) {
  double largest = 0.0;
  for (Eigen::Index i = 0; i < s.measured.count(); ++i) {
    const Eigen::VectorXd q = s.measured.q.row(i).transpose();
    largest = std::max(largest, std::abs(gravity_torque(s.pieces, q, s.measured.payload(i))(joint)));
  }
  return largest;
}

void joint_compliance(Hidden& h, const Scene& s) {
  const int wanted = s.arm.planar ? s.pick(1, 2) : s.pick(1, 3);
  std::vector<int> joints = {s.arm.planar ? s.pick(0, 1) : s.pick(1, 2)};
  while (static_cast<int>(joints.size()) < wanted) {
    const int next = s.arm.planar ? s.pick(0, 1) : s.pick(1, s.joints() - 1);
    if (std::ranges::find(joints, next) == joints.end()) joints.push_back(next);
  }
  std::ranges::sort(joints);
  std::vector<double> compliance(s.joints(), 0.0);
  for (const int j : joints) {
    const bool wrist = j >= 3;
    const double c = log_uniform(s.random, wrist ? s.scale.wrist_low : s.scale.main_low,
                                 wrist ? s.scale.wrist_high : s.scale.main_high);
    compliance[j] = c;
    h.locations.push_back(joint_name(j));
    h.parameters.push_back({"compliance", joint_name(j), c, "rad/Nm"});
  }
  h.elastic = [compliance](Elasticity& e) {
    e.joint_compliance.resize(compliance.size(), 0.0);
    for (std::size_t j = 0; j < compliance.size(); ++j) e.joint_compliance[j] += compliance[j];
  };
}

void bars(Hidden& h, const Scene& s, bool torsion) {
  std::vector<int> links;
  const int first = s.arm.planar ? 0 : 1;
  const double which = s.random.uniform();
  if (which < 0.65) links.push_back(first);
  if (which > 0.35) links.push_back(first + 1);
  std::vector<ElasticBar> all;
  for (const int link : links) {
    ElasticBar bar;
    bar.joint = link;
    bar.segments = s.pick(12, 24);
    double& value = torsion ? bar.torsion : bar.flexibility;
    value = torsion ? log_uniform(s.random, s.scale.torsion_low, s.scale.torsion_high)
                    : log_uniform(s.random, s.scale.bar_low, s.scale.bar_high);
    all.push_back(bar);
    h.locations.push_back(joint_name(link));
    h.parameters.push_back({torsion ? "torsion" : "flexibility", joint_name(link), value, "1/Nm2"});
  }
  h.elastic = [all](Elasticity& e) {
    for (const ElasticBar& bar : all) {
      const auto same = std::ranges::find(e.bars, bar.joint, &ElasticBar::joint);
      if (same == e.bars.end()) {
        e.bars.push_back(bar);
      } else {
        same->flexibility += bar.flexibility;
        same->torsion += bar.torsion;
      }
    }
  };
}

void payload_error(Hidden& h, const Scene& s) {
  const double which = s.random.uniform();
  const double mass = which < 0.7 ? sign(s.random) * s.random.uniform(0.1, 0.3) * s.arm.payload : 0.0;
  Vector3d com = Vector3d::Zero();
  if (which > 0.35) com = s.random.uniform(0.02, 0.08) * direction(s.random, s.arm.planar);
  h.parameters.push_back({"mass", "", mass, "kg"});
  for (int i = 0; i < 3; ++i) h.parameters.push_back({std::string("com_") + "xyz"[i], "", com(i) * 1e3, "mm"});
  h.elastic = [mass, com](Elasticity& e) {
    e.extra_payload += mass;
    e.payload_com_change += com;
  };
}

void gravity_tilt(Hidden& h, const Scene& s) {
  const double angle = log_uniform(s.random, 2e-3, 1e-2);
  const double around = s.arm.planar ? 0.0 : s.random.uniform(-std::numbers::pi, std::numbers::pi);
  const Vector3d axis =
      s.arm.planar ? Vector3d(0, 0, sign(s.random)) : Vector3d(std::cos(around), std::sin(around), 0.0);
  const Vector3d change = Eigen::AngleAxisd(angle, axis) * s.arm.gravity - s.arm.gravity;
  const Vector3d rotation = angle * axis;
  for (int i = 0; i < 3; ++i) h.parameters.push_back({std::string("tilt_") + "xyz"[i], "", rotation(i), "rad"});
  h.elastic = [change](Elasticity& e) { e.gravity_change += change; };
}

void play(Hidden& h, const Scene& s, bool by_approach) {
  Play p;
  p.joint = by_approach ? s.pick(0, s.arm.planar ? 1 : 4) : s.arm.planar ? s.pick(0, 1) : s.pick(1, 4);
  p.half_width = log_uniform(s.random, 2e-5, 3e-4);
  const double torque = largest_torque(s, p.joint);
  if (by_approach) p.friction = 1.5 * torque + 1.0;
  // A stop gives by at most some percent of the play, or it would be a compliance of its own.
  if (!by_approach && s.random.uniform() < 0.5) p.stop_compliance = 0.04 * p.half_width / std::max(torque, 1e-3);
  h.locations = {joint_name(p.joint)};
  h.parameters.push_back({"half_width", joint_name(p.joint), p.half_width, "rad"});
  h.elastic = [p](Elasticity& e) { e.plays.push_back(p); };
}

void counterbalance_spring(Hidden& h, const Scene& s) {
  Spring spring;
  spring.joint = 1;
  const double size = s.arm.name == "small6" ? 0.4 : 1.0;
  const double r = size * s.random.uniform(0.25, 0.40), lever = size * s.random.uniform(0.10, 0.20);
  const double a = s.random.uniform(-std::numbers::pi, std::numbers::pi);
  const double b = s.random.uniform(-std::numbers::pi, std::numbers::pi);
  spring.anchor = Vector3d(r * std::cos(a), r * std::sin(a), 0.0);
  spring.lug = Vector3d(lever * std::cos(b), lever * std::sin(b), 0.0);
  spring.length = s.random.uniform(0.0, 0.8) * (r - lever);
  const double left = log_uniform(s.random, 5e-5, 5e-4);
  spring.stiffness = left / (s.described.joint_compliance[1] * r * lever);
  h.locations = {joint_name(1)};
  h.parameters = {{"stiffness", joint_name(1), spring.stiffness, "N/m"}, {"left", joint_name(1), left, "rad"}};
  h.elastic = [spring](Elasticity& e) { e.spring = spring; };
}

}  // namespace

bool draw_elastic(Hidden& h, const Scene& s) {
  if (h.kind == "joint_compliance") {
    joint_compliance(h, s);
  } else if (h.kind == "link_bending" || h.kind == "link_torsion") {
    bars(h, s, h.kind == "link_torsion");
  } else if (h.kind == "elastic_base") {
    const double c = log_uniform(s.random, s.scale.base_low, s.scale.base_high);
    h.parameters = {{"compliance", "", c, "rad/Nm"}};
    h.elastic = [c](Elasticity& e) { e.base_compliance = c; };
  } else if (h.kind == "payload_error") {
    payload_error(h, s);
  } else if (h.kind == "gravity_tilt") {
    gravity_tilt(h, s);
  } else if (h.kind == "backlash_gravity" || h.kind == "backlash_approach") {
    play(h, s, h.kind == "backlash_approach");
  } else if (h.kind == "counterbalance_spring") {
    counterbalance_spring(h, s);
  } else {
    return false;
  }
  return true;
}

}  // namespace blind
