#include "llmt/robotics/robot.hpp"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <cmath>
#include <limits>
#include <set>
#include <stdexcept>

namespace llmt::robotics {
namespace {

// A robot prepared for evaluation over one set of poses: kinematics compiled, columns of the effects found.
class Evaluator {
 public:
  Evaluator(const Robot& robot, const Poses& poses);

  Eigen::Vector3d position(Eigen::Index row) const;
  Eigen::Matrix3Xd jacobian(Eigen::Index row) const;

 private:
  struct Prepared {
    const EffectType* type;
    std::size_t index;
    std::vector<const Eigen::VectorXd*> columns;
  };

  Deformation effect_at(std::size_t effect, Eigen::Index row, const PoseContext& pose,
                        const std::vector<double>& values) const;
  template <typename Use>
  void with_context(Eigen::Index row, const Eigen::VectorXd& q, Use use) const;
  Eigen::Matrix3Xd effect_columns(Eigen::Index row, const PoseContext& pose, const Skeleton& deformed) const;

  const Robot& robot_;
  const Poses& poses_;
  Kinematics kinematics_;
  std::vector<Prepared> effects_;
  const Eigen::VectorXd* payload_ = nullptr;
};

void add(Deformation& sum, const Deformation& part) {
  sum.joint += part.joint;
  for (std::size_t i = 0; i < sum.link.size(); ++i) {
    sum.link[i].translation_mm += part.link[i].translation_mm;
    sum.link[i].rotation_rad += part.link[i].rotation_rad;
  }
  sum.world_mm += part.world_mm;
}

Evaluator::Evaluator(const Robot& robot, const Poses& poses) : robot_(robot), poses_(poses), kinematics_(robot.chain) {
  if (poses.joints.cols() != static_cast<Eigen::Index>(robot.chain.joints.size())) {
    throw std::invalid_argument(fmt::format("llmt::robotics::positions: the poses have {} joints, robot {} has {}",
                                            poses.joints.cols(), robot.chain.name, robot.chain.joints.size()));
  }
  const auto column = [&](const std::string& name) -> const Eigen::VectorXd* {
    const auto found = poses.covariates.find(name);
    return found == poses.covariates.end() ? nullptr : &found->second;
  };
  payload_ = column("payload_kg");
  for (const Effect& effect : robot.effects) {
    Prepared prepared{&effect_type(effect.type), effect_index(robot.chain, effect), {}};
    for (const std::string& name : prepared.type->columns) {
      prepared.columns.push_back(column(name));
      if (prepared.columns.back() == nullptr) {
        throw std::invalid_argument(fmt::format(
            "llmt::robotics::positions: effect {} needs the column {}, which is missing", effect.type, name));
      }
    }
    effects_.push_back(std::move(prepared));
  }
}

template <typename Use>
void Evaluator::with_context(Eigen::Index row, const Eigen::VectorXd& q, Use use) const {
  const Skeleton rigid = kinematics_.skeleton(q);
  const PoseContext pose{.chain = robot_.chain,
                         .q = q,
                         .skeleton = rigid,
                         .gravity_m_s2 = rigid.base_rotation * robot_.chain.gravity_m_s2,
                         .payload_kg = payload_ != nullptr ? (*payload_)(row) : robot_.chain.payload.mass_kg,
                         .columns = {}};
  Deformation deformation(kinematics_.joints());
  for (std::size_t e = 0; e < effects_.size(); ++e) {
    add(deformation, effect_at(e, row, pose, robot_.effects[e].values));
  }
  use(pose, deformation);
}

Deformation Evaluator::effect_at(std::size_t effect, Eigen::Index row, const PoseContext& pose,
                                 const std::vector<double>& values) const {
  const Prepared& prepared = effects_[effect];
  std::vector<double> columns;
  for (const Eigen::VectorXd* column : prepared.columns) columns.push_back((*column)(row));
  PoseContext own = pose;
  own.columns = columns;
  Deformation deformation(kinematics_.joints());
  prepared.type->apply(own, prepared.index, values, deformation);
  return deformation;
}

Eigen::Vector3d Evaluator::position(Eigen::Index row) const {
  const Eigen::VectorXd q = poses_.joints.row(row).transpose();
  if (effects_.empty()) return kinematics_.forward(q).position_mm;
  Eigen::Vector3d result;
  with_context(row, q, [&](const PoseContext&, const Deformation& deformation) {
    result = kinematics_.forward(q, &deformation).position_mm;
  });
  return result;
}

// First-order displacement of the tool by a small deformation of an already deformed arm.
Eigen::Vector3d displacement(const Chain& chain, const Skeleton& skeleton, const Deformation& change) {
  const Eigen::Vector3d& tool = skeleton.tool.position_mm;
  Eigen::Vector3d sum = change.world_mm;
  for (std::size_t j = 0; j < chain.joints.size(); ++j) {
    const Eigen::Vector3d& axis = skeleton.joint_axis[j];
    const double moved = change.joint(static_cast<Eigen::Index>(j));
    const bool turns = chain.joints[j].type == JointType::revolute;
    sum += moved * (turns ? axis.cross(tool - skeleton.joint_origin[j]) : axis);
    sum += change.link[j].translation_mm + change.link[j].rotation_rad.cross(tool - skeleton.link_end[j]);
  }
  return sum;
}

Eigen::Matrix3Xd Evaluator::effect_columns(Eigen::Index row, const PoseContext& pose, const Skeleton& deformed) const {
  Eigen::Index count = 0;
  for (const Effect& effect : robot_.effects) count += std::ssize(effect.values);
  Eigen::Matrix3Xd columns(3, count);
  Eigen::Index next = 0;
  for (std::size_t e = 0; e < effects_.size(); ++e) {
    std::vector<double> values = robot_.effects[e].values;
    for (std::size_t k = 0; k < values.size(); ++k) {
      const double value = values[k];
      const double step = std::cbrt(std::numeric_limits<double>::epsilon()) *
                          std::max(std::abs(value), effects_[e].type->parameters[k].scale);
      values[k] = value + step;
      const Eigen::Vector3d above = displacement(robot_.chain, deformed, effect_at(e, row, pose, values));
      values[k] = value - step;
      const Eigen::Vector3d below = displacement(robot_.chain, deformed, effect_at(e, row, pose, values));
      values[k] = value;
      columns.col(next++) = (above - below) / (2.0 * step);
    }
  }
  return columns;
}

Eigen::Matrix3Xd Evaluator::jacobian(Eigen::Index row) const {
  const Eigen::VectorXd q = poses_.joints.row(row).transpose();
  if (effects_.empty()) return kinematics_.position_jacobian(q);
  Eigen::Matrix3Xd result;
  with_context(row, q, [&](const PoseContext& pose, const Deformation& deformation) {
    const Eigen::Matrix3Xd geometry = kinematics_.position_jacobian(q, &deformation);
    const Eigen::Matrix3Xd effects = effect_columns(row, pose, kinematics_.skeleton(q, &deformation));
    result.resize(3, geometry.cols() + effects.cols());
    result << geometry, effects;
  });
  return result;
}

}  // namespace

Poses select(const Poses& poses, const std::vector<std::ptrdiff_t>& rows) {
  Poses chosen{.joints = poses.joints(rows, Eigen::all), .covariates = {}};
  for (const auto& [name, values] : poses.covariates) chosen.covariates[name] = values(rows);
  return chosen;
}

void validate(const Robot& robot) {
  validate(robot.chain);
  std::set<std::string> seen;
  for (const Effect& effect : robot.effects) {
    effect_index(robot.chain, effect);
    if (!seen.insert(effect.type + "@" + effect.at).second) {
      throw std::invalid_argument(
          fmt::format("llmt::robotics::Robot: effect {} is there twice at {}", effect.type, effect.at));
    }
    for (const double value : effect.values) {
      if (!std::isfinite(value))
        throw std::invalid_argument("llmt::robotics::Robot: a value of " + effect.type + " is not finite");
    }
  }
}

std::vector<discovery::Parameter> parameters(const Robot& robot) {
  std::vector<discovery::Parameter> all = geometric_parameters(robot.chain);
  for (const Effect& effect : robot.effects) {
    const EffectType& type = effect_type(effect.type);
    for (std::size_t k = 0; k < type.parameters.size(); ++k) {
      const EffectParameter& parameter = type.parameters[k];
      all.push_back({.name = effect_parameter_name(effect, parameter),
                     .unit = parameter.unit,
                     .value = effect.values[k],
                     .scale = parameter.scale});
    }
  }
  return all;
}

Robot with_values(Robot robot, const Eigen::VectorXd& values) {
  const Eigen::Index geometric = geometric_parameter_count(robot.chain);
  Eigen::Index expected = geometric;
  for (const Effect& effect : robot.effects) expected += std::ssize(effect.values);
  if (values.size() != expected) {
    throw std::invalid_argument(
        fmt::format("llmt::robotics::with_values: values has {} entries, must be {}", values.size(), expected));
  }
  robot.chain = with_geometric_values(std::move(robot.chain), values.head(geometric));
  Eigen::Index next = geometric;
  for (Effect& effect : robot.effects) {
    for (double& value : effect.values) value = values(next++);
  }
  return robot;
}

Eigen::MatrixXd positions(const Robot& robot, const Poses& poses) {
  const Evaluator evaluator(robot, poses);
  Eigen::MatrixXd result(poses.count(), 3);
  for (Eigen::Index i = 0; i < poses.count(); ++i) result.row(i) = evaluator.position(i).transpose();
  return result;
}

Eigen::MatrixXd position_jacobian(const Robot& robot, const Poses& poses) {
  const Evaluator evaluator(robot, poses);
  Eigen::MatrixXd result(3 * poses.count(), static_cast<Eigen::Index>(parameters(robot).size()));
  for (Eigen::Index i = 0; i < poses.count(); ++i) result.middleRows(3 * i, 3) = evaluator.jacobian(i);
  return result;
}

}  // namespace llmt::robotics
