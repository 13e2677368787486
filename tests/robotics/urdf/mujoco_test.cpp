// The same files in MuJoCo, which reads URDF itself.
#include <gtest/gtest.h>
#include <mujoco/mujoco.h>

#include <filesystem>

#include "llmt/files.hpp"
#include "llmt/robotics/urdf.hpp"
#include "robotics/urdf/random_urdf.hpp"

namespace llmt::robotics {
namespace {

TEST(UrdfInMuJoCo, PositionsOrientationsAndJacobiansOfAThousandChainsAgree) {
  const std::string path = (std::filesystem::path(testing::TempDir()) / "llmt_mujoco.urdf").string();
  Random random(11);
  double position = 0.0;
  double rotation = 0.0;
  double derivative = 0.0;
  for (int k = 0; k < 1000; ++k) {
    auto joints = random_urdf::random_joints(random);  // the last one moves: MuJoCo merges bodies that are fixed
    const std::string text = random_urdf::text_of(joints);
    write_file(path, text);
    char error[500] = "";
    mjModel* model = mj_loadXML(path.c_str(), nullptr, error, sizeof error);
    ASSERT_NE(model, nullptr) << error << text;
    mjData* data = mj_makeData(model);
    const Chain chain = parse_urdf(text, path);
    const Eigen::VectorXd q = random_urdf::random_values(chain, random);
    ASSERT_EQ(model->nq, q.size());
    for (Eigen::Index j = 0; j < q.size(); ++j) {
      const bool slides = chain.joints[j].type == JointType::prismatic;
      data->qpos[j] = slides ? q(j) / 1000.0 : q(j);
    }
    mj_kinematics(model, data);
    mj_comPos(model, data);
    const int body = model->nbody - 1;
    const Pose pose = forward(chain, q);
    using Matrix = Eigen::Matrix<double, 3, 3, Eigen::RowMajor>;
    const Eigen::Vector3d point = Eigen::Map<const Eigen::Vector3d>(data->xpos + 3 * body);
    position = std::max(position, (pose.position_mm - 1000.0 * point).norm());
    rotation = std::max(rotation, (pose.rotation - Eigen::Map<const Matrix>(data->xmat + 9 * body)).norm());
    Eigen::Matrix<double, 3, Eigen::Dynamic, Eigen::RowMajor> linear(3, model->nv);
    Eigen::Matrix<double, 3, Eigen::Dynamic, Eigen::RowMajor> angular(3, model->nv);
    mj_jac(model, data, linear.data(), angular.data(), point.data(), body);
    const auto jacobian = Kinematics(chain).joint_jacobian(q);
    for (Eigen::Index j = 0; j < q.size(); ++j) {
      const bool slides = chain.joints[j].type == JointType::prismatic;
      const Eigen::Vector3d in_mm = (slides ? 1.0 : 1000.0) * linear.col(j);
      derivative = std::max(derivative, (jacobian.col(j).head(3) - in_mm).norm());
      derivative = std::max(derivative, (jacobian.col(j).tail(3) - angular.col(j)).norm());
    }
    mj_deleteData(data);
    mj_deleteModel(model);
  }
  EXPECT_LT(position, 1e-6);
  EXPECT_LT(rotation, 1e-9);
  EXPECT_LT(derivative, 1e-6);
  RecordProperty("position_mm", fmt::format("{}", position));
  RecordProperty("rotation_rad", fmt::format("{}", rotation));
  RecordProperty("derivative_mm", fmt::format("{}", derivative));
}

}  // namespace
}  // namespace llmt::robotics
