#include <fmt/format.h>

#include <algorithm>

#include "blind/statics.hpp"

namespace blind {
namespace {

using Eigen::Isometry3d;
using Eigen::Vector3d;

// MuJoCo wants every moving body to have some mass; this one weighs nothing in micrometres.
constexpr double no_mass = 1e-9;

struct Hinge {
  std::string name;
  Vector3d axis;
  double stiffness = 0.0;  // N m/rad; 0: moved from outside
};

struct Mass {
  double mass;
  Vector3d com;
};

struct Body {
  std::string name;
  Isometry3d place;  // in the body before it
  std::vector<Hinge> hinges;
  std::vector<Mass> masses;
  std::string more;  // elements inside
};

std::string vector(const Vector3d& v) { return fmt::format("{:.17g} {:.17g} {:.17g}", v.x(), v.y(), v.z()); }

// Bodies form one chain, so each opens inside the one before it.
std::string open(const Body& body) {
  const Eigen::Quaterniond turn(body.place.linear());
  std::string text = fmt::format("<body name=\"{}\" pos=\"{}\" quat=\"{:.17g} {:.17g} {:.17g} {:.17g}\">\n", body.name,
                                 vector(body.place.translation()), turn.w(), turn.x(), turn.y(), turn.z());
  double mass = no_mass;
  Vector3d moment = Vector3d::Zero();
  for (const Mass& part : body.masses) {
    mass += part.mass;
    moment += part.mass * part.com;
  }
  // Inertia does not matter at rest.
  text += fmt::format("<inertial pos=\"{}\" mass=\"{:.17g}\" diaginertia=\"1e-3 1e-3 1e-3\"/>\n", vector(moment / mass),
                      mass);
  for (const Hinge& hinge : body.hinges) {
    text += fmt::format("<joint name=\"{}\" type=\"hinge\" axis=\"{}\" stiffness=\"{:.17g}\"/>\n", hinge.name,
                        vector(hinge.axis), hinge.stiffness);
  }
  return text + body.more;
}

// Appends the segments of a bar; returns where its far end's frame (parallel to the joint's) is, in the last segment.
Isometry3d add_bar(std::vector<Body>& chain, const Arm& arm, const ElasticBar& elastic, const Mass& link) {
  const Bar bar = bar_of_link(arm, elastic.joint);
  const Vector3d normal = bar.direction.unitOrthogonal();
  Isometry3d along = Isometry3d::Identity();  // x along the bar
  along.linear() << bar.direction, normal, bar.direction.cross(normal);
  along.translation() = bar.start;

  // Part of the mass is the bar; the rest (motors, gears) sits where the centre of mass comes out right.
  const double share = arm.planar ? 0.9 : 0.5;
  const Vector3d middle = bar.start + 0.5 * bar.length * bar.direction;
  const Mass lump{(1.0 - share) * link.mass, (link.com - share * middle) / (1.0 - share)};
  const double step = bar.length / elastic.segments;
  const double at = (lump.com - bar.start).dot(bar.direction);
  const auto owner = static_cast<int>(std::clamp(std::floor(at / step - 0.5), -1.0, elastic.segments - 1.0));

  const std::size_t root = chain.size() - 1;
  const auto local = [&](const Isometry3d& frame, const Vector3d& point) { return frame.inverse() * point; };
  const Mass half{share * link.mass / elastic.segments / 2.0, Vector3d::Zero()};
  chain[root].masses.push_back({half.mass, bar.start + 0.25 * step * bar.direction});
  if (owner < 0) chain[root].masses.push_back(lump);
  Isometry3d before = Isometry3d::Identity();
  for (int i = 0; i < elastic.segments; ++i) {  // hinge i stands in the middle of piece i
    Isometry3d here = along;
    here.translation() = bar.start + (i + 0.5) * step * bar.direction;
    Body body{fmt::format("bar{}_{}", elastic.joint + 1, i), before.inverse() * here, {}, {}, {}};
    const auto hinge = [&](const char* kind, const Vector3d& axis, double flexibility) {
      if (flexibility > 0.0) body.hinges.push_back({body.name + kind, axis, 1.0 / (flexibility * step)});
    };
    hinge("x", Vector3d::UnitX(), elastic.torsion);
    hinge("y", Vector3d::UnitY(), elastic.flexibility);
    hinge("z", Vector3d::UnitZ(), elastic.flexibility);
    const bool last = i + 1 == elastic.segments;
    body.masses.push_back({(last ? 1.0 : 2.0) * half.mass, {(last ? 0.25 : 0.5) * step, 0.0, 0.0}});
    if (owner == i) body.masses.push_back({lump.mass, local(here, lump.com)});
    chain.push_back(std::move(body));
    before = here;
  }
  return before.inverse();
}

}  // namespace

std::string to_mjcf(const Arm& arm, const Elasticity& elasticity) {
  const Pieces pieces(arm);
  std::vector<Body> chain = {{"base", Isometry3d::Identity(), {}, {}, {}}};
  if (elasticity.base_compliance > 0.0) {
    const double stiffness = 1.0 / elasticity.base_compliance;
    if (arm.planar) {
      chain[0].hinges.push_back({"base_z", Vector3d::UnitZ(), stiffness});
    } else {
      chain[0].hinges = {{"base_x", Vector3d::UnitX(), stiffness}, {"base_y", Vector3d::UnitY(), stiffness}};
    }
  }
  Isometry3d to_here = Isometry3d::Identity();
  for (int j = 0; j < arm.size(); ++j) {
    const std::size_t index = j;
    Body body{fmt::format("link{}", j + 1), to_here * pieces.rigid[index], {}, {}, {}};
    body.hinges.push_back({fmt::format("q{}", j + 1), Vector3d::UnitZ(), 0.0});
    for (const Play& play : elasticity.plays) {
      if (play.joint == j) body.hinges.push_back({fmt::format("p{}", j + 1), Vector3d::UnitZ(), 0.0});
    }
    if (!elasticity.joint_compliance.empty() && elasticity.joint_compliance[index] > 0.0) {
      body.hinges.push_back({fmt::format("e{}", j + 1), Vector3d::UnitZ(), 1.0 / elasticity.joint_compliance[index]});
    }
    if (elasticity.spring && elasticity.spring->joint == j) {
      chain.back().more += fmt::format("<site name=\"anchor\" pos=\"{}\"/>\n",
                                       vector(to_here * pieces.rigid[index] * elasticity.spring->anchor));
      body.more += fmt::format("<site name=\"lug\" pos=\"{}\"/>\n", vector(elasticity.spring->lug));
    }
    chain.push_back(std::move(body));
    const Mass link{pieces.mass[index], pieces.com[index]};
    const auto bar = std::ranges::find(elasticity.bars, j, &ElasticBar::joint);
    if (bar == elasticity.bars.end()) {
      chain.back().masses.push_back(link);
      to_here = Isometry3d::Identity();
    } else {
      to_here = add_bar(chain, arm, *bar, link);
    }
  }
  Body payload{"payload", to_here * pieces.rigid.back(), {}, {}, {}};
  payload.masses.push_back({1.0, pieces.payload_com + elasticity.payload_com_change});
  payload.more = "<site name=\"tool\"/>\n";
  chain.push_back(std::move(payload));

  std::string text = fmt::format(
      "<mujoco><compiler angle=\"radian\"/><size njmax=\"10\" nconmax=\"1\"/><option gravity=\"{}\"/><worldbody>\n",
      vector(pieces.gravity + elasticity.gravity_change));
  for (const Body& body : chain) text += open(body);
  for (std::size_t i = 0; i < chain.size(); ++i) text += "</body>";
  text += "\n</worldbody>\n";
  if (elasticity.spring) {
    text += fmt::format(
        "<tendon><spatial name=\"spring\" stiffness=\"{:.17g}\" springlength=\"{:.17g}\"><site site=\"anchor\"/><site "
        "site=\"lug\"/></spatial></tendon>\n",
        elasticity.spring->stiffness, elasticity.spring->length);
  }
  return text + "</mujoco>\n";
}

}  // namespace blind
