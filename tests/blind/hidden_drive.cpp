// Errors between the number that a controller logs and the angle of the joint. No MuJoCo.
#include <algorithm>
#include <cmath>
#include <numbers>

#include "blind/hidden.hpp"

namespace blind {
namespace {

constexpr double pi = std::numbers::pi;

double phase(llmt::Random& random) { return random.uniform(-pi, pi); }

// Adds error(q_i) to the angle of one joint.
template <typename Error>
void at_joint(Hidden& h, int joint, Error error) {
  h.locations = {joint_name(joint)};
  h.change = [joint, error](const Session& s, std::vector<Change>& changes) {
    for (Eigen::Index i = 0; i < s.count(); ++i) changes[i].angle(joint) += error(s.q(i, joint));
  };
}

// The scale's reading is known as a function of the true angle; the controller drives to the reading q. Returns
// true angle - q.
template <typename Reading>
double true_minus_read(double q, Reading reading) {
  double angle = q;
  for (int round = 0; round < 6; ++round) {
    const double wrong = reading(angle) - q;
    angle -= std::atan2(std::sin(wrong), std::cos(wrong));  // the scale's own turns do not matter
  }
  return angle - q;
}

void eccentricity(Hidden& h, const Scene& s, int joint) {
  const double e = log_uniform(s.random, 3e-5, 3e-4), where = phase(s.random);
  h.parameters = {{"amplitude", joint_name(joint), e, "rad"}};
  at_joint(h, joint, [e, where](double q) {  // lines of a circle, read from beside its centre
    return true_minus_read(
        q, [&](double t) { return std::atan2(std::sin(t) + e * std::sin(where), std::cos(t) + e * std::cos(where)); });
  });
}

void eccentricity_twice(Hidden& h, const Scene& s, int joint) {
  const double k = log_uniform(s.random, 2e-5, 2e-4), where = phase(s.random);
  h.parameters = {{"amplitude", joint_name(joint), k, "rad"}};
  at_joint(h, joint, [k, where](double q) {  // a ring pressed into an ellipse
    return true_minus_read(q, [&](double t) {
      return where + std::atan2((1.0 - k) * std::sin(t - where), (1.0 + k) * std::cos(t - where));
    });
  });
}

void transmission(Hidden& h, const Scene& s, int joint, bool by_gear) {
  const double a = log_uniform(s.random, 5e-5, 3e-4), first = phase(s.random), second = phase(s.random);
  const double ratio = s.arm.joints[joint].gear_ratio;
  const double order = by_gear ? 2.0 * ratio : log_uniform(s.random, 15.0, 120.0);
  h.parameters = {{"amplitude", joint_name(joint), a, "rad"}, {"per_turn", joint_name(joint), order, "1"}};
  at_joint(h, joint, [=](double q) {
    const double twice = by_gear ? 0.05 * a * std::sin(2.0 * order * q + second) : 0.0;  // strain waves have overtones
    return a * std::sin(order * q + first) + twice;
  });
}

// The state of a friction element (-1 ... 1) that follows its joint: exponentially (Dahl) or as play.
struct Follower {
  bool dahl;
  double presliding;  // rad
  double state = 0.0;
  void move(double by) {
    const double side = by < 0.0 ? -1.0 : 1.0;
    state = dahl ? side - (side - state) * std::exp(-std::abs(by) / presliding)
                 : std::clamp(state + by / presliding, -1.0, 1.0);
  }
};

void hysteresis(Hidden& h, const Scene& s, int joint) {
  const double width = log_uniform(s.random, 5e-5, 3e-4), presliding = log_uniform(s.random, 0.01, 0.06);
  const bool dahl = s.random.uniform() < 0.5;
  h.locations = {joint_name(joint)};
  h.parameters = {{"half_width", joint_name(joint), width, "rad"},
                  {"presliding", joint_name(joint), presliding, "rad"}};
  h.change = [=](const Session& session, std::vector<Change>& changes) {
    constexpr double last_move = 1e-3;  // rad: far beyond any play, far below the presliding
    Follower follower{dahl, presliding};
    double at = 0.0;  // the arm comes from its zero pose
    for (Eigen::Index i = 0; i < session.count(); ++i) {
      const double before = session.q(i, joint) - session.approach(i, joint) * last_move;
      if (std::abs(before - at) > 2.0 * last_move) follower.move(before - at);
      at = session.q(i, joint);
      follower.move(at - before);
      changes[i].angle(joint) -= width * follower.state;
    }
  };
}

void read_back_lag(Hidden& h, const Scene& s) {
  std::vector<double> share(s.joints(), 0.0);
  const int only = s.random.uniform() < 0.6 ? s.pick(0, std::min(s.joints() - 1, 4)) : -1;
  for (int j = 0; j < s.joints(); ++j) {
    if (only >= 0 && j != only) continue;
    share[j] = log_uniform(s.random, 0.05, 0.6);
    h.locations.push_back(joint_name(j));
    h.parameters.push_back({"share", joint_name(j), share[j], "1"});
  }
  h.change = [share](const Session& session, std::vector<Change>& changes) {
    for (Eigen::Index i = 0; i < session.count(); ++i) {
      for (std::size_t j = 0; j < share.size(); ++j) {
        const Eigen::Index c = j;
        changes[i].angle(c) += share[j] * (session.read_back(i, c) - session.q(i, c));
      }
    }
  };
}

void wrist_coupling(Hidden& h, const Scene& s) {
  const int joint = s.arm.planar ? 1 : s.pick(4, 5);
  const double k = sign(s.random) * log_uniform(s.random, 5e-5, 5e-4);
  h.locations = {joint_name(joint)};
  h.parameters = {{"coupling", joint_name(joint), k, "1"}};
  h.change = [joint, k](const Session& session, std::vector<Change>& changes) {
    for (Eigen::Index i = 0; i < session.count(); ++i) {
      changes[i].angle(joint) += k * session.q(i, joint - 1);
    }
  };
}

}  // namespace

bool draw_drive(Hidden& h, const Scene& s) {
  // The last joint of a six-axis arm hardly moves the point that is measured.
  const int joint = s.pick(0, s.arm.planar ? 1 : 4);
  if (h.kind == "eccentricity") {
    eccentricity(h, s, joint);
  } else if (h.kind == "eccentricity_twice") {
    eccentricity_twice(h, s, joint);
  } else if (h.kind == "joint_gain") {
    const double gain = sign(s.random) * log_uniform(s.random, 2e-5, 4e-4);
    h.parameters = {{"gain", joint_name(joint), gain, "1"}};
    at_joint(h, joint, [gain](double q) { return gain * q; });
  } else if (h.kind == "transmission_error_gear" || h.kind == "transmission_error_order") {
    transmission(h, s, joint, h.kind == "transmission_error_gear");
  } else if (h.kind == "hysteresis") {
    hysteresis(h, s, joint);
  } else if (h.kind == "read_back_lag") {
    read_back_lag(h, s);
  } else if (h.kind == "wrist_coupling") {
    wrist_coupling(h, s);
  } else {
    return false;
  }
  return true;
}

}  // namespace blind
