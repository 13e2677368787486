#include "calibration/singular_values.hpp"

#include <Eigen/QR>
#include <Eigen/SVD>
#include <algorithm>

namespace llmt::robotics {

Eigen::VectorXd singular_values(const Eigen::MatrixXd& matrix) {
  const Eigen::HouseholderQR<Eigen::MatrixXd> qr(matrix);
  const Eigen::Index rows = std::min(matrix.rows(), matrix.cols());
  const Eigen::MatrixXd triangle = qr.matrixQR().topRows(rows).triangularView<Eigen::Upper>();
  return Eigen::JacobiSVD<Eigen::MatrixXd>(triangle).singularValues();
}

}  // namespace llmt::robotics
