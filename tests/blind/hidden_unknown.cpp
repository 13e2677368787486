// Effects that are in no catalogue: a tool should say that something is missing, and not call it by a name.
#include <algorithm>
#include <cmath>
#include <numbers>

#include "blind/hidden.hpp"

namespace blind {
namespace {

using Eigen::Vector3d;

double inside(const Scene& s, int joint, double share) {
  const Joint& j = s.arm.joints[joint];
  return 0.5 * (j.low + j.high) + share * s.random.uniform(-0.5, 0.5) * (j.high - j.low);
}

// A dress pack: a spring from beside the base to the forearm, slack below its length, pulls at two elastic drives that
// the controller has no model of.
void cable(Hidden& h, const Scene& s) {
  const int first = s.arm.planar ? 0 : 1;
  const std::size_t forearm = first + 1;
  const double reach = s.arm.name == "small6" ? 0.4 : 1.0;
  const Vector3d hook = reach * Vector3d(s.random.uniform(-0.5, 0.5), s.random.uniform(-0.5, 0.5),
                                         s.arm.planar ? 0.0 : s.random.uniform(0.2, 0.8));
  const Vector3d clip = reach * Vector3d(s.random.uniform(0.1, 0.4), s.random.uniform(-0.2, 0.2),
                                         s.arm.planar ? 0.0 : s.random.uniform(-0.2, 0.2));
  const Pieces pieces = s.pieces;
  const auto length = [pieces, hook, clip, forearm](const Eigen::VectorXd& q) {
    return (frames(pieces, q)[forearm] * clip - pieces.base * hook).norm();
  };
  double mean = 0.0;
  for (Eigen::Index i = 0; i < s.measured.count(); ++i) mean += length(s.measured.q.row(i).transpose());
  mean /= static_cast<double>(s.measured.count());
  const double slack = s.random.uniform(0.6, 0.95) * mean;
  const double softness = s.random.uniform(0.4, 1.0);  // of the second drive, against the first
  const auto pull = [length, slack, first, softness](const Eigen::VectorXd& q) {
    Eigen::Vector2d angle;
    const double force = std::max(0.0, length(q) - slack);
    for (int k = 0; k < 2; ++k) {
      Eigen::VectorXd high = q, low = q;
      high(first + k) += 1e-5;
      low(first + k) -= 1e-5;
      angle(k) = -force * (length(high) - length(low)) / 2e-5 * (k == 0 ? 1.0 : softness);
    }
    return angle;
  };
  double largest = 1e-12;
  for (Eigen::Index i = 0; i < s.measured.count(); ++i) {
    largest = std::max(largest, pull(s.measured.q.row(i).transpose()).cwiseAbs().maxCoeff());
  }
  const double scale = log_uniform(s.random, 8e-5, 5e-4) / largest;
  h.locations = {joint_name(first), joint_name(first + 1)};
  h.change = [pull, scale, first](const Session& session, std::vector<Change>& changes) {
    for (Eigen::Index i = 0; i < session.count(); ++i) {
      const Eigen::Vector2d angle = scale * pull(session.q.row(i).transpose());
      for (int k = 0; k < 2; ++k) changes[i].angle(first + k) += angle(k);
    }
  };
}

void worn_tooth(Hidden& h, const Scene& s, int joint) {
  const double half = s.random.uniform(5.0, 15.0) * std::numbers::pi / 360.0;
  double centre = 0.0;
  for (int attempt = 0; attempt < 200; ++attempt) {  // a tooth that hardly any pose meets is an outlier, not an effect
    centre = inside(s, joint, 0.9);
    if (((s.measured.q.col(joint).array() - centre).abs() < half).count() >= 4) break;
  }
  const double height = sign(s.random) * log_uniform(s.random, 1e-4, 8e-4);
  h.locations = {joint_name(joint)};
  h.change = [=](const Session& session, std::vector<Change>& changes) {
    for (Eigen::Index i = 0; i < session.count(); ++i) {
      const double x = (session.q(i, joint) - centre) / half;
      if (std::abs(x) < 1.0) changes[i].angle(joint) += 0.5 * height * (1.0 + std::cos(std::numbers::pi * x));
    }
  };
}

void step(Hidden& h, const Scene& s, int joint) {
  const double at = inside(s, joint, 0.6), height = sign(s.random) * log_uniform(s.random, 5e-5, 5e-4);
  h.locations = {joint_name(joint)};
  h.change = [=](const Session& session, std::vector<Change>& changes) {
    for (Eigen::Index i = 0; i < session.count(); ++i) {
      if (session.q(i, joint) > at) changes[i].angle(joint) += height;
    }
  };
}

void cross(Hidden& h, const Scene& s, int joint) {
  const int a = s.pick(0, s.arm.planar ? 1 : 4);
  int b = a;
  while (b == a) b = s.pick(0, s.arm.planar ? 1 : 4);
  const double size = log_uniform(s.random, 5e-5, 4e-4);
  h.locations = {joint_name(joint)};
  h.change = [=](const Session& session, std::vector<Change>& changes) {
    for (Eigen::Index i = 0; i < session.count(); ++i) {
      changes[i].angle(joint) += size * std::sin(session.q(i, a)) * std::cos(2.0 * session.q(i, b));
    }
  };
}

// The tool droops about its flange and soon meets a stop.
void loose_flange(Hidden& h, const Scene& s) {
  const bool planar = s.arm.planar;
  const double most = planar ? log_uniform(s.random, 5e-5, 4e-4) : log_uniform(s.random, 3e-4, 4e-3);
  const double sharp = s.random.uniform(2.0, 5.0);
  const Pieces pieces = s.pieces;
  h.change = [=](const Session& session, std::vector<Change>& changes) {
    const Vector3d down = (pieces.base.linear() * pieces.gravity).normalized();
    const std::size_t flange = session.q.cols() - 1;
    for (Eigen::Index i = 0; i < session.count(); ++i) {
      const Vector3d u = frames(pieces, session.q.row(i).transpose())[flange].linear().transpose() * down;
      Vector3d& tilt = changes[i].tilt[flange + 1];
      if (planar) {
        tilt.z() += most * std::tanh(sharp * u.y());
      } else {
        const Vector3d axis = Vector3d::UnitZ().cross(u);
        const double sine = axis.norm();
        if (sine > 0.0) tilt += most * std::tanh(sharp * sine) / sine * axis;
      }
    }
  };
}

void friction_load(Hidden& h, const Scene& s) {
  const int joint = s.arm.planar ? s.pick(0, 1) : s.pick(1, 4);
  const Pieces pieces = s.pieces;
  double largest = 1e-9;
  for (Eigen::Index i = 0; i < s.measured.count(); ++i) {
    const Eigen::VectorXd q = s.measured.q.row(i).transpose();
    largest = std::max(largest, std::abs(gravity_torque(pieces, q, s.measured.payload(i))(joint)));
  }
  const double size = log_uniform(s.random, 5e-5, 4e-4), sharp = s.random.uniform(5.0, 20.0);
  h.locations = {joint_name(joint)};
  h.change = [=](const Session& session, std::vector<Change>& changes) {
    for (Eigen::Index i = 0; i < session.count(); ++i) {
      const double load = gravity_torque(pieces, session.q.row(i).transpose(), session.payload(i))(joint) / largest;
      changes[i].angle(joint) += size * std::tanh(sharp * load) * std::sqrt(std::abs(load));
    }
  };
}

}  // namespace

bool draw_unknown(Hidden& h, const Scene& s) {
  const int joint = s.pick(0, s.arm.planar ? 1 : 4);
  if (h.kind == "cable") {
    cable(h, s);
  } else if (h.kind == "worn_tooth") {
    worn_tooth(h, s, joint);
  } else if (h.kind == "step") {
    step(h, s, joint);
  } else if (h.kind == "cross") {
    cross(h, s, joint);
  } else if (h.kind == "loose_flange") {
    loose_flange(h, s);
  } else if (h.kind == "friction_load") {
    friction_load(h, s);
  } else {
    return false;
  }
  return true;
}

}  // namespace blind
