// Axes that wobble, links that grow, instruments that move. No MuJoCo.
#include <cmath>
#include <numbers>

#include "blind/hidden.hpp"

namespace blind {
namespace {

using Eigen::Vector3d;

Vector3d direction(const Scene& s) {
  return Vector3d(s.random.normal(), s.random.normal(), s.arm.planar ? 0.0 : s.random.normal()).normalized();
}

// The axis runs along an elliptic cone, once a turn. A round cone that turns with the joint would be geometry.
void axis_wobble(Hidden& h, const Scene& s) {
  const int joint = s.pick(0, 4);
  const double angle = log_uniform(s.random, 2e-5, 1.5e-4);
  const double second = s.random.uniform(-1.0, 0.8) * angle;
  const double turned = s.random.uniform(-std::numbers::pi, std::numbers::pi);
  const double ahead = s.random.uniform(-std::numbers::pi, std::numbers::pi);
  h.locations = {joint_name(joint)};
  h.parameters = {{"long_half_axis", joint_name(joint), angle, "rad"},
                  {"short_half_axis", joint_name(joint), second, "rad"}};
  h.change = [=](const Session& session, std::vector<Change>& changes) {
    for (Eigen::Index i = 0; i < session.count(); ++i) {
      const double at = session.q(i, joint) + ahead;
      const Vector3d lean(angle * std::cos(at), second * std::sin(at), 0.0);
      changes[i].tilt[joint] += Eigen::AngleAxisd(turned, Vector3d::UnitZ()) * lean;
    }
  };
}

void thermal_growth(Hidden& h, const Scene& s) {
  std::vector<double> growth;
  for (int j = 0; j <= s.joints(); ++j) growth.push_back(s.random.uniform(10e-6, 14e-6));
  for (int j = 0; j < s.joints(); ++j) {
    h.parameters.push_back({"growth", joint_name(j), growth[j + 1], "1/K"});
  }
  h.change = [growth](const Session& session, std::vector<Change>& changes) {
    for (Eigen::Index i = 0; i < session.count(); ++i) {
      for (std::size_t j = 0; j < growth.size(); ++j) {
        changes[i].stretch[j] += growth[j] * (session.temperature(i) - 20.0);
      }
    }
  };
}

void drift(Hidden& h, const Scene& s) {
  const Vector3d way = log_uniform(s.random, 3e-5, 3e-4) * direction(s);
  const double curve = s.random.uniform(-0.3, 0.3);
  for (int i = 0; i < 3; ++i) h.parameters.push_back({std::string("way_") + "xyz"[i], "", way(i) * 1e3, "mm"});
  h.change = [way, curve](const Session& session, std::vector<Change>& changes) {
    for (Eigen::Index i = 0; i < session.count(); ++i) {
      const double t = (session.time(i) - session.time_span(0)) / (session.time_span(1) - session.time_span(0));
      const Eigen::Isometry3d moved(Eigen::Translation3d((t + curve * (t * t - t)) * way));
      Change& change = changes[i];
      change.world = moved * change.world;
    }
  };
}

void tracker_knock(Hidden& h, const Scene& s) {
  const auto rows = static_cast<std::uint64_t>(s.measured.count());
  Eigen::Index row = 0;
  do {  // not where the held-out block interrupts the file: its place would not be known
    row = static_cast<Eigen::Index>(rows / 5 + s.random.below(3 * rows / 5));
  } while (row == 0 || s.measured.order(row) - s.measured.order(row - 1) > 1.5);
  const double moment = 0.5 * (s.measured.time(row - 1) + s.measured.time(row));
  const Vector3d shift = log_uniform(s.random, 3e-5, 5e-4) * direction(s);
  const Vector3d axis = s.arm.planar ? Vector3d(0, 0, sign(s.random)) : direction(s);
  const double angle = log_uniform(s.random, 1e-5, 2e-4);
  const Vector3d centre = s.arm.base.xyz;
  const Eigen::Isometry3d moved =
      Eigen::Translation3d(centre + shift) * Eigen::AngleAxisd(angle, axis) * Eigen::Translation3d(-centre);
  h.parameters = {{"first_order_after", "", s.measured.order(row), "1"}};
  for (int i = 0; i < 3; ++i) h.parameters.push_back({std::string("shift_") + "xyz"[i], "", shift(i) * 1e3, "mm"});
  h.change = [moment, moved](const Session& session, std::vector<Change>& changes) {
    for (Eigen::Index i = 0; i < session.count(); ++i) {
      Change& change = changes[i];
      if (session.time(i) > moment) change.world = moved * change.world;
    }
  };
}

}  // namespace

bool draw_frame(Hidden& h, const Scene& s) {
  if (h.kind == "axis_wobble") {
    axis_wobble(h, s);
  } else if (h.kind == "thermal_growth") {
    thermal_growth(h, s);
  } else if (h.kind == "drift") {
    drift(h, s);
  } else if (h.kind == "tracker_knock") {
    tracker_knock(h, s);
  } else {
    return false;
  }
  return true;
}

}  // namespace blind
