#include "llmt/robotics/calibration_problem.hpp"

#include <memory>
#include <vector>

#include "llmt/robotics/robot.hpp"

namespace llmt::robotics {

discovery::LeastSquaresProblem calibration_problem(const Robot& robot, const Measurements& measurements) {
  validate(robot);
  validate(measurements, robot);
  struct Shared {
    Robot robot;
    Measurements measurements;
    std::vector<Eigen::Index> rows;
    Eigen::VectorXd measured;
  };
  const auto shared = std::make_shared<Shared>(Shared{robot, measurements, measured_rows(measurements), {}});
  const auto stacked = [](const Eigen::MatrixXd& points) -> Eigen::VectorXd {
    const Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor> by_row = points;
    return Eigen::Map<const Eigen::VectorXd>(by_row.data(), by_row.size());
  };
  shared->measured = stacked(measurements.positions_mm)(shared->rows);
  discovery::LeastSquaresProblem problem;
  problem.parameters = parameters(robot);
  problem.residual = [shared, stacked](const Eigen::VectorXd& values) -> Eigen::VectorXd {
    const Robot moved = with_values(shared->robot, values);
    return stacked(positions(moved, shared->measurements.poses))(shared->rows) - shared->measured;
  };
  problem.jacobian = [shared](const Eigen::VectorXd& values) -> Eigen::MatrixXd {
    const Robot moved = with_values(shared->robot, values);
    const Eigen::MatrixXd jacobian = position_jacobian(moved, shared->measurements.poses);
    return jacobian(shared->rows, Eigen::all);
  };
  return problem;
}

}  // namespace llmt::robotics
