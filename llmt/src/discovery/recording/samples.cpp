#include "discovery/recording/samples.hpp"

namespace llmt::discovery {

Eigen::VectorXd jumping_at(const std::vector<Crossing>& crossings, Eigen::VectorXd of_rows) {
  std::vector<double> jumps;
  for (const Crossing& own : crossings) {
    const auto at = [&](std::size_t k) { return of_rows(own.rows[k]); };
    jumps.push_back(own.shift * (1.5 * (at(2) - at(1)) - 0.5 * (at(3) - at(0))));
  }
  for (std::size_t k = 0; k < crossings.size(); ++k) {
    of_rows(crossings[k].rows[1]) += 0.5 * jumps[k];
    of_rows(crossings[k].rows[2]) += 0.5 * jumps[k];
  }
  return of_rows;
}

Eigen::MatrixXd means(const Eigen::MatrixXd& of_rows, const Samples& samples) {
  if (!samples.is_filtered()) return means_of_filtered(of_rows, samples);
  Eigen::MatrixXd result(samples.size(), of_rows.cols());
  const Eigen::VectorXd& weights = samples.weights();
  for (Eigen::Index c = 0; c < of_rows.cols(); ++c) {
    const Eigen::VectorXd column = samples.crossings() != nullptr ? jumping_at(*samples.crossings(), of_rows.col(c))
                                                                  : Eigen::VectorXd(of_rows.col(c));
    for (Eigen::Index i = 0; i < samples.size(); ++i) {
      const std::span<const Eigen::Index> around = samples.around(i);
      // Rows stand in the order of time in nearly all tables.
      if (around.back() - around.front() + 1 == weights.size()) {
        result(i, c) = weights.dot(column.segment(around.front(), weights.size()));
        continue;
      }
      double sum = 0.0;
      for (Eigen::Index k = 0; k < weights.size(); ++k) sum += weights(k) * column(around[k]);
      result(i, c) = sum;
    }
  }
  return result;
}

Eigen::MatrixXd means_of_filtered(const Eigen::MatrixXd& of_rows, const Samples& samples) {
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

double share_kept(const Eigen::VectorXd& of_rows, const Eigen::VectorXd& kept, const Samples& samples) {
  if (std::ssize(samples.rows()) == samples.size() && !samples.is_filtered()) return 1.0;
  const Eigen::VectorXd rows = of_rows(samples.rows());
  const double all = (rows.array() - rows.mean()).square().mean();
  return all > 0.0 ? (kept.array() - kept.mean()).square().mean() / all : 1.0;
}

double carriers(const Eigen::VectorXd& of_samples) {
  const Eigen::ArrayXd squares = (of_samples.array() - of_samples.mean()).square();
  const double sum = squares.sum();
  return sum > 0.0 ? sum * sum / squares.square().sum() : 0.0;
}

}  // namespace llmt::discovery
