#include "discovery/terms/samples.hpp"

namespace llmt::discovery {

Eigen::MatrixXd means(const Eigen::MatrixXd& of_rows, const Samples& samples) {
  Eigen::MatrixXd result(samples.size(), of_rows.cols());
  for (Eigen::Index c = 0; c < of_rows.cols(); ++c) {
    for (Eigen::Index i = 0; i < samples.size(); ++i) {
      const std::span<const Eigen::Index> rows = samples.rows_of(i);
      double sum = 0.0;
      for (const Eigen::Index row : rows) sum += of_rows(row, c);
      result(i, c) = rows.size() == 1 ? sum : sum / static_cast<double>(rows.size());
    }
  }
  return result;
}

}  // namespace llmt::discovery
