#include "hypotheses/error_patterns.hpp"

#include <fmt/format.h>

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <numbers>

#include "kinematics/units.hpp"
#include "linear_algebra/linear_algebra.hpp"

namespace llmt::robotics {
namespace {

// Angle error of a joint: columns of `functions` (n x k) times the joint's lever.
Eigen::MatrixXd acting_on(const Scene& scene, std::size_t joint, const Eigen::MatrixXd& functions) {
  Eigen::MatrixXd signature(3 * functions.rows(), functions.cols());
  for (Eigen::Index i = 0; i < functions.rows(); ++i) {
    signature.middleRows(3 * i, 3) = scene.lever[joint].middleRows(3 * i, 3) * functions.row(i);
  }
  return signature;
}

Hypothesis pattern_of(std::string family, std::string location, Eigen::MatrixXd signature, ErrorPattern pattern,
                      double choices = 1.0) {
  Hypothesis hypothesis;
  hypothesis.candidate.family = std::move(family);
  hypothesis.candidate.location = std::move(location);
  hypothesis.candidate.signature = std::move(signature);
  hypothesis.candidate.generic = true;
  hypothesis.candidate.prior_cost = 2.0 * std::log(choices);
  hypothesis.pattern = std::move(pattern);
  return hypothesis;
}

// cos(m pi u), u = 0..1 over the range of x: smooth, and flat at the ends.
Eigen::MatrixXd cosines(const Eigen::VectorXd& x, Eigen::Index count) {
  Eigen::MatrixXd functions(x.size(), count);
  const double low = x.minCoeff();
  const double range = std::max(1e-300, x.maxCoeff() - low);
  for (Eigen::Index m = 0; m < count; ++m) {
    const double order = std::numbers::pi * static_cast<double>(m + 1) / range;
    for (Eigen::Index i = 0; i < x.size(); ++i) functions(i, m) = std::cos(order * (x(i) - low));
  }
  return functions;
}

bool moves(const Eigen::VectorXd& x) { return x.maxCoeff() - x.minCoeff() > 0.05; }

void add_smooth(const Scene& scene, std::vector<Hypothesis>& patterns) {
  const std::vector<Joint>& joints = scene.robot.chain.joints;
  for (std::size_t input = 0; input < joints.size(); ++input) {
    const Eigen::VectorXd q = scene.poses.joints.col(input);
    if (!moves(q)) continue;
    const std::string name = fmt::format("q{}", input + 1);
    for (std::size_t j = 0; j < joints.size(); ++j) {
      patterns.push_back(pattern_of("?smooth", joints[j].name + "(" + name + ")", acting_on(scene, j, cosines(q, 4)),
                                    {joints[j].name, {name}, std::nullopt, "smooth"}));
    }
    patterns.push_back(pattern_of("?fine", joints[input].name, acting_on(scene, input, cosines(q, 12)),
                                  {joints[input].name, {name}, std::nullopt, "a map of the joint"}));
  }
}

double bump(double x) { return std::abs(x) < 1.0 ? 0.5 + 0.5 * std::cos(std::numbers::pi * x) : 0.0; }

// Gain of one function beyond offset and first harmonic, which geometry absorbs.
double local_gain(const JointSignal& signal, const std::vector<double>& values) {
  Eigen::Matrix4d gram = Eigen::Matrix4d::Zero();
  double moment = 0.0;
  for (std::size_t i = 0; i < values.size(); ++i) {
    const Eigen::Vector4d row(1.0, std::cos(signal.angle[i]), std::sin(signal.angle[i]), values[i]);
    gram += signal.weight[i] * row * row.transpose();
    moment += signal.along[i] * values[i];
  }
  const Eigen::Vector3d shared = gram.block<3, 1>(0, 3);
  const Eigen::Matrix3d nuisance = gram.topLeftCorner<3, 3>() + 1e-9 * gram(0, 0) * Eigen::Matrix3d::Identity();
  const double own = gram(3, 3) - shared.dot(nuisance.ldlt().solve(shared));
  return own > 1e-3 * gram(3, 3) ? moment * moment / own : 0.0;
}

struct Local {
  double centre = 0.0;
  double width = 0.0;  // half width of a bump; 0: a step
  double gain = -1.0;
};

double local_value(const Local& local, double q) {
  if (local.width > 0.0) return bump((q - local.centre) / local.width);
  return q > local.centre ? 1.0 : 0.0;
}

void add_local(const Scene& scene, std::vector<Hypothesis>& patterns) {
  constexpr double step = 3.0 / degrees;
  const std::vector<Joint>& joints = scene.robot.chain.joints;
  for (std::size_t j = 0; j < joints.size(); ++j) {
    if (joints[j].type != JointType::revolute) continue;
    const JointSignal signal = joint_signal(scene, j);
    if (signal.angle.size() < 12 || signal.high - signal.low < 0.2) continue;
    std::vector<double> values(signal.angle.size());
    for (const bool is_step : {false, true}) {
      Local best;
      double tried = 0.0;
      const std::vector<double> widths = is_step ? std::vector<double>{0.0} : std::vector<double>{4.0, 8.0, 16.0, 30.0};
      for (const double width : widths) {
        for (double centre = signal.low; centre <= signal.high; centre += step) {
          Local local{centre, width / degrees, -1.0};
          double inside = 0.0;
          for (std::size_t i = 0; i < values.size(); ++i) {
            values[i] = local_value(local, signal.angle[i]);
            inside += values[i] > 0.1 ? 1.0 : 0.0;
          }
          if (inside < 3.0 || inside > static_cast<double>(values.size()) - 3.0) continue;
          tried += 1.0;
          local.gain = local_gain(signal, values);
          if (local.gain > best.gain) best = local;
        }
      }
      if (best.gain < 0.0) continue;
      const Eigen::VectorXd function =
          scene.poses.joints.col(j).unaryExpr([&](double q) { return local_value(best, q); });
      const std::string kind =
          is_step ? fmt::format("a step at {:.0f} deg", degrees * best.centre)
                  : fmt::format("a bump at {:.0f} deg, {:.0f} deg wide", degrees * best.centre, degrees * best.width);
      patterns.push_back(pattern_of(is_step ? "?step" : "?bump", joints[j].name, acting_on(scene, j, function),
                                    {joints[j].name, {fmt::format("q{}", j + 1)}, std::nullopt, kind},
                                    tried * static_cast<double>(joints.size())));
    }
  }
}

Eigen::MatrixXd pair_waves(const Eigen::VectorXd& a, const Eigen::VectorXd& b) {
  Eigen::MatrixXd functions(a.size(), 12);
  Eigen::Index next = 0;
  for (const auto& [u, v] : {std::pair{1, 1}, {1, -1}, {2, 1}, {2, -1}, {1, 2}, {1, -2}}) {
    for (Eigen::Index i = 0; i < a.size(); ++i) {
      const double phase = u * a(i) + v * b(i);
      functions(i, next) = std::cos(phase);
      functions(i, next + 1) = std::sin(phase);
    }
    next += 2;
  }
  return functions;
}

void add_pairs(const Scene& scene, std::vector<Hypothesis>& patterns) {
  struct Pair {
    std::size_t a, b, joint;
    double gain;
  };
  const std::vector<Joint>& joints = scene.robot.chain.joints;
  std::vector<Pair> pairs;
  for (std::size_t j = 0; j < joints.size(); ++j) {
    const JointSignal signal = joint_signal(scene, j);
    const auto n = std::ssize(signal.rows);
    const Eigen::VectorXd along = Eigen::VectorXd::Map(signal.along.data(), n);
    const Eigen::VectorXd weight = Eigen::VectorXd::Map(signal.weight.data(), n);
    for (std::size_t a = 0; a < joints.size(); ++a) {
      for (std::size_t b = a + 1; b < joints.size(); ++b) {
        const Eigen::MatrixXd waves =
            pair_waves(scene.poses.joints(signal.rows, a), scene.poses.joints(signal.rows, b));
        Eigen::MatrixXd gram = weighted_gram(waves, weight);
        gram.diagonal().array() *= 1.0 + 1e-6;
        const Eigen::VectorXd moment = transposed_product(waves, along);
        pairs.push_back({a, b, j, moment.dot(solve_symmetric(gram, moment))});
      }
    }
  }
  constexpr std::size_t kept = 8;
  std::ranges::stable_sort(pairs, std::greater<>{}, &Pair::gain);
  const double choices = std::max(1.0, static_cast<double>(pairs.size()) / static_cast<double>(kept));
  for (std::size_t k = 0; k < std::min(kept, pairs.size()); ++k) {
    const Pair& pair = pairs[k];
    const std::string qa = fmt::format("q{}", pair.a + 1);
    const std::string qb = fmt::format("q{}", pair.b + 1);
    const Eigen::MatrixXd waves = pair_waves(scene.poses.joints.col(pair.a), scene.poses.joints.col(pair.b));
    patterns.push_back(pattern_of(
        "?pair", fmt::format("{}({},{})", joints[pair.joint].name, qa, qb), acting_on(scene, pair.joint, waves),
        {joints[pair.joint].name, {qa, qb}, std::nullopt, "a function of two joints"}, choices));
  }
}

// Angle errors that grow with the gravity torque otherwise than in proportion.
void add_loads(const Scene& scene, std::vector<Hypothesis>& patterns) {
  for (std::size_t j = 0; j < scene.robot.chain.joints.size(); ++j) {
    const Eigen::VectorXd load = scene.loads.col(j);
    const double largest = load.cwiseAbs().maxCoeff();
    if (!(largest > 0.0)) continue;
    Eigen::MatrixXd functions(load.size(), 3);
    for (Eigen::Index i = 0; i < load.size(); ++i) {
      const double u = load(i) / largest;
      functions.row(i) << std::copysign(std::sqrt(std::abs(u)), u), u * std::abs(u), u * u;
    }
    const std::string& name = scene.robot.chain.joints[j].name;
    patterns.push_back(
        pattern_of("?load", name, acting_on(scene, j, functions),
                   {name, {fmt::format("gravity torque of {}", name)}, std::nullopt, "nonlinear in the torque"}));
  }
}

// Displacements of the tool in its own frame that depend on how it hangs.
void add_tool(const Scene& scene, std::vector<Hypothesis>& patterns) {
  const Kinematics kinematics(scene.robot.chain);
  const Eigen::Index n = scene.poses.count();
  Eigen::MatrixXd linear = Eigen::MatrixXd::Zero(3 * n, 9);
  Eigen::MatrixXd square = Eigen::MatrixXd::Zero(3 * n, 18);
  Eigen::MatrixXd sided = Eigen::MatrixXd::Zero(3 * n, 15);
  for (Eigen::Index i = 0; i < n; ++i) {
    const Skeleton skeleton = kinematics.skeleton(scene.poses.joints.row(i).transpose());
    const Eigen::Matrix3d& tool = skeleton.tool.rotation;
    Eigen::Vector3d down = tool.transpose() * skeleton.base_rotation * scene.robot.chain.gravity_m_s2;
    if (down.norm() > 0.0) down.normalize();
    Eigen::Matrix<double, 6, 1> squares;
    squares << down(0) * down(0), down(1) * down(1), down(2) * down(2), down(0) * down(1), down(1) * down(2),
        down(2) * down(0);
    // A part that droops until it meets a stop moves to the side that is down, whatever the angle.
    Eigen::Matrix<double, 5, 1> sides;
    sides << down, Eigen::Vector2d::Zero();
    const double across = down.head<2>().norm();
    if (across > 0.0) sides.tail<2>() = down.head<2>() / across;
    for (Eigen::Index axis = 0; axis < 3; ++axis) {
      for (Eigen::Index row = 0; row < 3; ++row) {
        if (!scene.measured[row]) continue;
        sided.block(3 * i + row, 5 * axis, 1, 5) = tool(row, axis) * sides.transpose();
        linear.block(3 * i + row, 3 * axis, 1, 3) = tool(row, axis) * down.transpose();
        square.block(3 * i + row, 6 * axis, 1, 6) = tool(row, axis) * squares.transpose();
      }
    }
  }
  const ErrorPattern pattern{"tool", {"orientation of the tool to gravity"}, std::nullopt, "smooth"};
  patterns.push_back(pattern_of("?tool", "linear", linear, pattern));
  patterns.push_back(pattern_of("?tool", "quadratic", square, pattern));
  patterns.push_back(pattern_of("?tool", "sided", sided, pattern));
}

void add_covariates(const Scene& scene, std::vector<Hypothesis>& patterns) {
  for (const char* name : {"time_s", "order", "temp_C", "payload_kg"}) {
    const auto found = scene.poses.covariates.find(name);
    if (found == scene.poses.covariates.end()) continue;
    const Eigen::VectorXd& x = found->second;
    if (!(x.maxCoeff() > x.minCoeff())) continue;
    const Eigen::MatrixXd functions = cosines(x, std::string(name) == "payload_kg" ? 1 : 4);
    Eigen::MatrixXd signature = Eigen::MatrixXd::Zero(3 * x.size(), 3 * functions.cols());
    for (Eigen::Index i = 0; i < x.size(); ++i) {
      for (Eigen::Index axis = 0; axis < 3; ++axis) {
        if (scene.measured[axis]) {
          signature.block(3 * i + axis, axis * functions.cols(), 1, functions.cols()) = functions.row(i);
        }
      }
    }
    patterns.push_back(pattern_of("?wander", name, signature, {"base", {name}, std::nullopt, "smooth"}));
  }
}

}  // namespace

std::vector<Hypothesis> pattern_hypotheses(const Scene& scene) {
  std::vector<Hypothesis> patterns;
  add_smooth(scene, patterns);
  add_local(scene, patterns);
  add_pairs(scene, patterns);
  add_loads(scene, patterns);
  add_tool(scene, patterns);
  add_covariates(scene, patterns);
  return patterns;
}

}  // namespace llmt::robotics
