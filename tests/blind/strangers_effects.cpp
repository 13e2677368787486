#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <stdexcept>

#include "blind/arms.hpp"
#include "blind/strangers.hpp"

namespace blind {
namespace {

using Eigen::Vector3d;
constexpr double turn = 2.0 * std::numbers::pi;

double any_phase(llmt::Random& random) { return random.uniform(-0.5 * turn, 0.5 * turn); }

Vector3d any_direction(const StrangerScene& s) {
  return Vector3d(s.random.normal(), s.random.normal(), s.arm.planar ? 0.0 : s.random.normal()).normalized();
}

bool is_wrist(const StrangerScene& s, int joint) { return joint >= s.arm.size() - 3 && !s.arm.planar; }

// A joint that carries weight.
int loaded_joint(const StrangerScene& s) { return s.arm.planar ? s.pick(0, 1) : s.pick(1, s.arm.size() - 2); }

double largest_load(const StrangerScene& s, int joint) {
  double largest = 1e-9;
  for (Eigen::Index i = 0; i < s.measured.count(); ++i) {
    largest = std::max(largest, std::abs(gravity_torque(s.pieces, s.measured.q.row(i), s.measured.payload(i))(joint)));
  }
  return largest;
}

// error(session, row) is added to the angle of a joint.
template <typename Error>
void add_angle(Hidden& h, int joint, Error error) {
  h.locations = {joint_name(joint)};
  h.change = [joint, error](const Session& session, std::vector<Change>& changes) {
    for (Eigen::Index i = 0; i < session.count(); ++i) changes[i].angle(joint) += error(session, i);
  };
}

template <typename Error>
void add_angle_of(Hidden& h, int joint, Error error) {
  add_angle(h, joint, [joint, error](const Session& session, Eigen::Index i) { return error(session.q(i, joint)); });
}

void soft_drives(Hidden& h, const StrangerScene& s) {
  std::vector<double> compliance(s.arm.size(), 0.0);
  const int wanted = s.pick(1, s.arm.planar ? 2 : 4);
  for (int k = 0; k < wanted; ++k) {
    const int j = loaded_joint(s);
    if (compliance[j] > 0.0) continue;
    compliance[j] = is_wrist(s, j) ? log_uniform(s.random, s.scale.wrist_low, s.scale.wrist_high)
                                   : log_uniform(s.random, s.scale.main_low, s.scale.main_high);
    h.locations.push_back(joint_name(j));
    h.parameters.push_back({"compliance", joint_name(j), compliance[j], "rad/Nm"});
  }
  h.elastic = [compliance](Elasticity& e) {
    e.joint_compliance.resize(compliance.size(), 0.0);
    for (std::size_t j = 0; j < compliance.size(); ++j) e.joint_compliance[j] += compliance[j];
  };
}

void soft_link(Hidden& h, const StrangerScene& s, bool twists) {
  // The links that are long: upper arm or forearm.
  const int link = s.arm.planar ? s.pick(0, 1) : s.arm.name == "arm7" ? 2 + 2 * s.pick(0, 1) - 1 : s.pick(1, 2);
  ElasticBar bar;
  bar.joint = link;
  bar.segments = 16;
  (twists ? bar.torsion : bar.flexibility) = log_uniform(s.random, s.scale.bar_low, s.scale.bar_high);
  h.locations = {joint_name(link)};
  h.parameters = {{twists ? "torsion" : "flexibility", joint_name(link), bar.torsion + bar.flexibility, "1/Nm2"}};
  h.elastic = [bar](Elasticity& e) {
    const auto same = std::ranges::find(e.bars, bar.joint, &ElasticBar::joint);
    if (same == e.bars.end()) {
      e.bars.push_back(bar);
    } else {
      same->flexibility += bar.flexibility;
      same->torsion += bar.torsion;
    }
  };
}

void wave(Hidden& h, const StrangerScene& s, int joint) {
  const double a = log_uniform(s.random, s.scale.wave_low, s.scale.wave_high), first = any_phase(s.random);
  const double second = any_phase(s.random), overtone = s.random.uniform(0.0, 0.15);
  const double order = 2.0 * s.arm.joints[joint].gear_ratio;
  h.parameters = {{"amplitude", joint_name(joint), a, "rad"}, {"per_turn", joint_name(joint), order, "1"}};
  add_angle_of(h, joint, [=](double q) {
    return a * std::sin(order * q + first) + overtone * a * std::sin(2.0 * order * q + second);
  });
}

// Bristles that stretch (LuGre at rest): the deflection follows the way by sigma, out of the whole path.
void bristles(Hidden& h, const StrangerScene& s, int joint) {
  const double half = log_uniform(s.random, s.scale.play_low, s.scale.play_high);
  const double way = log_uniform(s.random, 0.004, 0.05);
  h.parameters = {{"half_width", joint_name(joint), half, "rad"}};
  h.locations = {joint_name(joint)};
  h.change = [=](const Session& session, std::vector<Change>& changes) {
    double state = 0.0, at = 0.0;
    const auto follow = [&](double to) {
      const double by = to - at, side = by < 0.0 ? -1.0 : 1.0;
      state = side - (side - state) * std::exp(-std::abs(by) / way);
      at = to;
    };
    for (Eigen::Index i = 0; i < session.count(); ++i) {
      const double q = session.q(i, joint);
      if (std::abs(q - at) > 2e-3) follow(q - session.approach(i, joint) * 1e-3);
      follow(q);
      changes[i].angle(joint) -= half * state;
    }
  };
}

void play(Hidden& h, const StrangerScene& s, bool by_approach) {
  Play p;
  p.joint = by_approach ? s.moving_joint() : loaded_joint(s);
  p.half_width = 0.5 * log_uniform(s.random, s.scale.play_low, s.scale.play_high);
  const double load = largest_load(s, p.joint);
  if (by_approach) p.friction = 1.4 * load + 0.5;
  h.locations = {joint_name(p.joint)};
  h.parameters = {{"half_width", joint_name(p.joint), p.half_width, "rad"}};
  h.elastic = [p](Elasticity& e) { e.plays.push_back(p); };
}

// The teeth share the load little by little: no jump at zero load.
void soft_play(Hidden& h, const StrangerScene& s) {
  const int joint = loaded_joint(s);
  const double half = 0.5 * log_uniform(s.random, s.scale.play_low, s.scale.play_high);
  const double soft = s.random.uniform(0.01, 0.06) * largest_load(s, joint);
  const Pieces pieces = s.pieces;
  h.parameters = {{"half_width", joint_name(joint), half, "rad"}};
  add_angle(h, joint, [=](const Session& session, Eigen::Index i) {
    return half * std::tanh(gravity_torque(pieces, session.q.row(i), session.payload(i))(joint) / soft);
  });
}

using Move = std::function<Eigen::Isometry3d(const Session&, Eigen::Index, const Vector3d&)>;

// What an instrument at the origin gets wrong, at the point that it would have seen.
void instrument(Hidden& h, const StrangerScene& s, const Move& move) {
  const Pieces pieces = s.pieces;
  h.change = [pieces, move](const Session& session, std::vector<Change>& changes) {
    for (Eigen::Index i = 0; i < session.count(); ++i) {
      const Vector3d point = tool_point(pieces, session.q.row(i));
      changes[i].world = move(session, i, point) * changes[i].world;
    }
  };
}

void instrument_azimuth(Hidden& h, const StrangerScene& s) {
  const double a = log_uniform(s.random, 1e-5, 1.5e-4), first = any_phase(s.random);
  const double b = s.random.uniform() < 0.5 ? a * s.random.uniform(0.2, 0.8) : 0.0, second = any_phase(s.random);
  instrument(h, s, [=](const Session&, Eigen::Index, const Vector3d& p) {
    const double azimuth = std::atan2(p.y(), p.x());
    const double wrong = a * std::sin(azimuth - first) + b * std::sin(2.0 * azimuth - second);
    return Eigen::Isometry3d(Eigen::AngleAxisd(wrong, Vector3d::UnitZ()));
  });
}

void instrument_range(Hidden& h, const StrangerScene& s) {
  const double offset = sign(s.random) * log_uniform(s.random, 5e-5, 8e-4);
  const double scale = sign(s.random) * log_uniform(s.random, 5e-6, 6e-5);
  const double periodic = log_uniform(s.random, 1e-5, 1.5e-4), length = s.random.uniform(0.3, 1.5);
  const double phase = any_phase(s.random);
  instrument(h, s, [=](const Session&, Eigen::Index, const Vector3d& p) {
    const double r = p.norm(), more = offset + scale * r + periodic * std::sin(turn * r / length + phase);
    return Eigen::Isometry3d(Eigen::Translation3d(more / r * p));
  });
}

void instrument_settles(Hidden& h, const StrangerScene& s) {
  const Vector3d way = log_uniform(s.random, 4e-5, 4e-4) * any_direction(s);
  const double angle = sign(s.random) * log_uniform(s.random, 5e-6, 6e-5), share = s.random.uniform(0.1, 0.5);
  instrument(h, s, [=](const Session& session, Eigen::Index i, const Vector3d&) {
    const double t = (session.time(i) - session.time_span(0)) / (session.time_span(1) - session.time_span(0));
    const double grown = 1.0 - std::exp(-t / share);
    return Eigen::Isometry3d(Eigen::Translation3d(grown * way) * Eigen::AngleAxisd(grown * angle, Vector3d::UnitZ()));
  });
}

void knock(Hidden& h, const StrangerScene& s) {
  const auto n = static_cast<std::uint64_t>(s.measured.count());
  const auto row = static_cast<Eigen::Index>(n / 4 + s.random.below(n / 2));
  const double moment = 0.5 * (s.measured.time(row - 1) + s.measured.time(row));
  const Vector3d shift = log_uniform(s.random, 5e-5, 2e-3) * any_direction(s);
  const Eigen::Isometry3d moved(Eigen::Translation3d(shift) *
                                Eigen::AngleAxisd(log_uniform(s.random, 1e-5, 3e-4), Vector3d::UnitZ()));
  instrument(h, s, [=](const Session& session, Eigen::Index i, const Vector3d&) {
    return session.time(i) > moment ? moved : Eigen::Isometry3d::Identity();
  });
}

void growth(Hidden& h, const StrangerScene& s) {
  const double steel = 11.5e-6, aluminium = 23.5e-6;
  std::vector<double> links;
  const double metal = s.arm.joints[1].mass > 100.0 ? steel : aluminium;
  for (int j = 0; j <= s.arm.size(); ++j) links.push_back(metal * s.random.uniform(0.85, 1.15));
  h.change = [links](const Session& session, std::vector<Change>& changes) {
    for (Eigen::Index i = 0; i < session.count(); ++i) {
      for (std::size_t j = 0; j < links.size(); ++j) {
        changes[i].stretch[j] += links[j] * (session.temperature(i) - 20.0);
      }
    }
  };
}

bool draw_unlisted(Hidden& h, const StrangerScene& s) {
  const int joint = s.moving_joint();
  const double size = log_uniform(s.random, s.scale.play_low, s.scale.play_high);
  const double middle = s.measured.q.col(joint).mean();
  if (h.kind == "cross") {
    int other = joint;
    while (other == joint) other = s.moving_joint();
    add_angle(h, joint, [=](const Session& session, Eigen::Index i) {
      return size * std::sin(session.q(i, joint) + 0.4) * std::sin(2.0 * session.q(i, other));
    });
  } else if (h.kind == "step") {
    add_angle_of(h, joint, [=](double q) { return q > middle + 0.3 ? size : 0.0; });
  } else if (h.kind == "saw") {  // the lobes of a worn gear: no sine
    const double period = s.random.uniform(0.35, 0.9);
    add_angle_of(h, joint, [=](double q) { return 2.0 * size * (q / period - std::floor(q / period) - 0.5); });
  } else {
    return false;
  }
  return true;
}

bool draw_drives(Hidden& h, const StrangerScene& s) {
  const int joint = s.moving_joint();
  if (h.kind == "joint_compliance") {
    soft_drives(h, s);
  } else if (h.kind == "link_bending" || h.kind == "link_torsion") {
    soft_link(h, s, h.kind == "link_torsion");
  } else if (h.kind == "elastic_base") {
    const double c = log_uniform(s.random, s.scale.stand_low, s.scale.stand_high);
    h.parameters = {{"compliance", "", c, "rad/Nm"}};
    h.elastic = [c](Elasticity& e) { e.base_compliance = c; };
  } else if (h.kind == "backlash_gravity" || h.kind == "backlash_approach") {
    play(h, s, h.kind == "backlash_approach");
  } else if (h.kind == "backlash_soft") {
    soft_play(h, s);
  } else if (h.kind == "hysteresis") {
    bristles(h, s, joint);
  } else if (h.kind == "transmission_error_gear") {
    wave(h, s, joint);
  } else if (h.kind == "eccentricity" || h.kind == "eccentricity_twice") {
    const double a = log_uniform(s.random, s.scale.encoder_low, s.scale.encoder_high), phase = any_phase(s.random);
    const double times = h.kind == "eccentricity" ? 1.0 : 2.0;
    h.parameters = {{"amplitude", joint_name(joint), a, "rad"}};
    add_angle_of(h, joint, [=](double q) { return std::asin(a * std::sin(times * q + phase)); });
  } else if (h.kind == "joint_gain") {
    const double gain = sign(s.random) * log_uniform(s.random, 4e-5, 9e-4);
    h.parameters = {{"gain", joint_name(joint), gain, "1"}};
    add_angle_of(h, joint, [=](double q) { return gain * q; });
  } else if (h.kind == "wrist_coupling") {
    const int to = s.arm.planar ? 1 : s.pick(s.arm.size() - 2, s.arm.size() - 1);
    const double k = sign(s.random) * log_uniform(s.random, 1e-4, 2e-3);
    h.parameters = {{"coupling", joint_name(to), k, "1"}};
    add_angle(h, to, [=](const Session& session, Eigen::Index i) { return k * session.q(i, to - 1); });
  } else {
    return false;
  }
  return true;
}

}  // namespace

std::vector<std::string> stranger_kinds(const Arm& arm) {
  std::vector<std::string> kinds = {"joint_compliance",   "joint_compliance",
                                    "link_bending",       "elastic_base",
                                    "backlash_gravity",   "backlash_approach",
                                    "hysteresis",         "eccentricity",
                                    "eccentricity_twice", "joint_gain",
                                    "wrist_coupling",     "transmission_error_gear",
                                    "thermal_growth",     "drift",
                                    "tracker_knock"};
  if (!arm.planar) kinds.emplace_back("link_torsion");
  return kinds;
}

Hidden draw_stranger(const std::string& kind, const StrangerScene& s) {
  Hidden h;
  h.kind = kind;
  if (draw_drives(h, s) || draw_unlisted(h, s)) return h;
  if (kind == "instrument_azimuth") {
    instrument_azimuth(h, s);
  } else if (kind == "instrument_range") {
    instrument_range(h, s);
  } else if (kind == "drift") {
    instrument_settles(h, s);
  } else if (kind == "tracker_knock") {
    knock(h, s);
  } else if (kind == "thermal_growth") {
    growth(h, s);
  } else {
    throw std::invalid_argument("no stranger of kind '" + kind + "'");
  }
  return h;
}

}  // namespace blind
