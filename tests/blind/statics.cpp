#include "blind/statics.hpp"

#include <fmt/format.h>
#include <mujoco/mujoco.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <stdexcept>

namespace blind {
namespace {

mjModel* load(const std::string& text) {
  const auto files = std::make_unique<mjVFS>();
  mj_defaultVFS(files.get());
  if (mj_makeEmptyFileVFS(files.get(), "arm.xml", static_cast<int>(text.size())) != 0) {
    throw std::runtime_error("MuJoCo takes no virtual file");
  }
  std::memcpy(files->filedata[mj_findFileVFS(files.get(), "arm.xml")], text.data(), text.size());
  char why[1000] = "";
  mjModel* model = mj_loadXML("arm.xml", files.get(), why, sizeof why);
  mj_deleteVFS(files.get());
  if (model == nullptr) throw std::runtime_error(fmt::format("MuJoCo cannot load the arm: {}", why));
  return model;
}

}  // namespace

bool Elasticity::rigid() const {
  const bool soft = std::ranges::any_of(joint_compliance, [](double c) { return c > 0.0; });
  return !soft && bars.empty() && base_compliance <= 0.0 && plays.empty();
}

struct StaticArm::Engine {
  mjModel* model = nullptr;
  mjData* data = nullptr;
  std::vector<Play> plays;
  double extra_payload = 0.0;
  int payload_body = 0;
  int tool = 0;
  std::vector<int> motor, loose, elastic;  // degrees of freedom; all joints are hinges, so qpos has the same numbers
  Eigen::VectorXd loose_angle;

  void forces() {
    mj_kinematics(model, data);
    mj_comPos(model, data);
    mj_tendon(model, data);
    mj_comVel(model, data);
    mj_passive(model, data);
    mj_rne(model, data, 0, data->qfrc_bias);
  }
  // Torque on a hinge from weight and springs, N m.
  double torque(int dof) const { return data->qfrc_passive[dof] - data->qfrc_bias[dof]; }

  // Newton with the springs' own stiffness as the matrix: weight changes so little with the deflection that the error
  // falls by the deflection (1e-3) in each step.
  void settle_springs() {
    for (int round = 0; round < 60; ++round) {
      forces();
      double largest = 0.0;
      for (const int dof : elastic) {
        const double step = torque(dof) / model->jnt_stiffness[dof];
        data->qpos[dof] += step;
        largest = std::max(largest, std::abs(step));
      }
      if (largest < 1e-14) return;
    }
    throw std::runtime_error("the elastic hinges do not settle");
  }

  // Torque on a loose hinge when it stands at x, everything elastic at rest.
  double torque_at(int dof, double x) {
    data->qpos[dof] = x;
    settle_springs();
    return torque(dof);
  }

  // Where a loose hinge rests: at a stop that the weight presses it to, or hanging between them.
  double rest(const Play& play, int dof, double approach) {
    const double h = play.half_width;
    if (play.friction > 0.0) {  // dragged along by the motor: it trails, unless its weight overcomes the friction
      const double trailing = -approach * h;
      return torque_at(dof, trailing) * approach > play.friction ? -trailing : trailing;
    }
    const double up = torque_at(dof, h);
    if (up >= 0.0) return h + play.stop_compliance * up;
    const double down = torque_at(dof, -h);
    if (down <= 0.0) return -h + play.stop_compliance * down;
    double low = -h, high = h;  // stable: the torque falls through zero
    while (high - low > 1e-12) {
      const double middle = 0.5 * (low + high);
      (torque_at(dof, middle) > 0.0 ? low : high) = middle;
    }
    return low;
  }
};

StaticArm::StaticArm(const Arm& arm, const Elasticity& elasticity) : engine_(std::make_unique<Engine>()) {
  Engine& e = *engine_;
  e.model = load(to_mjcf(arm, elasticity));
  e.data = mj_makeData(e.model);
  if (e.model->nq != e.model->nv) throw std::runtime_error("not all joints are hinges");
  e.plays = elasticity.plays;
  e.extra_payload = elasticity.extra_payload;
  e.payload_body = mj_name2id(e.model, mjOBJ_BODY, "payload");
  e.tool = mj_name2id(e.model, mjOBJ_SITE, "tool");
  const auto id = [&](const char* kind, int joint) {
    return mj_name2id(e.model, mjOBJ_JOINT, fmt::format("{}{}", kind, joint + 1).c_str());
  };
  for (int j = 0; j < arm.size(); ++j) e.motor.push_back(id("q", j));
  for (const Play& play : e.plays) e.loose.push_back(id("p", play.joint));
  for (int dof = 0; dof < e.model->nv; ++dof) {
    if (e.model->jnt_stiffness[dof] > 0.0) e.elastic.push_back(dof);
  }
  e.loose_angle = Eigen::VectorXd::Zero(e.plays.size());
}

StaticArm::~StaticArm() {
  if (!engine_) return;
  mj_deleteData(engine_->data);
  mj_deleteModel(engine_->model);
}

StaticArm::StaticArm(StaticArm&&) noexcept = default;

Eigen::Vector3d StaticArm::tool_point(const Eigen::VectorXd& q, double payload_kg, const Eigen::VectorXd& approach) {
  Engine& e = *engine_;
  e.model->body_mass[e.payload_body] = payload_kg + e.extra_payload;
  std::fill_n(e.data->qpos, e.model->nq, 0.0);
  for (std::size_t j = 0; j < e.motor.size(); ++j) e.data->qpos[e.motor[j]] = q(j);
  // Plays hardly feel each other: two rounds settle them.
  for (int round = 0; round < (e.plays.size() > 1 ? 3 : 1); ++round) {
    for (std::size_t i = 0; i < e.plays.size(); ++i) {
      const double at = e.rest(e.plays[i], e.loose[i], approach(e.plays[i].joint));
      e.data->qpos[e.loose[i]] = e.loose_angle(i) = at;
    }
  }
  e.settle_springs();
  mj_kinematics(e.model, e.data);
  return Eigen::Map<const Eigen::Vector3d>(e.data->site_xpos + 3 * e.tool);
}

const Eigen::VectorXd& StaticArm::loose() const { return engine_->loose_angle; }

}  // namespace blind
