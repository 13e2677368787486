#include "bytes/samples.hpp"

#include <charconv>
#include <cmath>
#include <limits>

namespace bytes {

double Generator::uniform() {
  state_ = state_ * 6364136223846793005ULL + 1442695040888963407ULL;
  std::uint64_t bits = state_;
  bits = (bits ^ (bits >> 33)) * 0xff51afd7ed558ccdULL;
  bits ^= bits >> 33;
  return static_cast<double>(bits >> 11) / 9007199254740992.0;
}

double Generator::noise() {
  double sum = -2.0;
  for (int k = 0; k < 4; ++k) sum += uniform();
  return sum;
}

Sample make_sample(Eigen::Index rows, std::uint64_t seed) {
  Generator generator(seed);
  Sample sample{Eigen::MatrixXd(rows, 3), Eigen::MatrixXd(rows, 1)};
  for (Eigen::Index row = 0; row < rows; ++row) {
    const double a = 4.0 * generator.uniform() - 2.0;
    const double b = 100.0 * generator.uniform();
    const double c = 1.0 + 0.01 * generator.uniform();
    const double u = b / 50.0 - 1.0;
    const double v = 200.0 * (c - 1.0) - 1.0;
    const double ridge = a + u > 0.5 ? 1.5 * (a + u - 0.5) : 0.0;
    const double jump = b > 62.0 ? 2.0 : 0.0;
    const double bend = std::sqrt(1.0 + a * a) * v * 0.5;
    sample.inputs.row(row) << a, b, c;
    sample.outputs(row, 0) = 2.0 * a + ridge + jump + bend + 0.8 * u * v + 0.25 * generator.noise();
  }
  return sample;
}

void add_output(Sample& sample) {
  Generator generator(77);
  sample.outputs.conservativeResize(Eigen::NoChange, 2);
  for (Eigen::Index row = 0; row < sample.inputs.rows(); ++row) {
    const double a = sample.inputs(row, 0);
    const double u = sample.inputs(row, 1) / 50.0 - 1.0;
    sample.outputs(row, 1) = 1000.0 * ((u > 0.24 ? -1.0 : 0.0) + a * a * 0.3 + u * a) + 50.0 * generator.noise();
  }
}

void remove_values(Eigen::MatrixXd& inputs) {
  for (Eigen::Index row = 0; row < inputs.rows(); ++row) {
    if (row % 7 == 3) inputs(row, 0) = std::numeric_limits<double>::quiet_NaN();
    if (row % 11 == 5) inputs(row, 2) = std::numeric_limits<double>::quiet_NaN();
  }
}

void make_categorical(Sample& sample) {
  Generator generator(5);
  for (Eigen::Index row = 0; row < sample.inputs.rows(); ++row) {
    const double level = row % 41 == 7 ? 4.0 : std::floor(4.0 * generator.uniform());
    sample.inputs(row, 2) = level;
    sample.outputs(row, 0) += level == 1.0 ? 1.2 : level == 3.0 ? -0.7 * sample.inputs(row, 0) : 0.0;
  }
}

Eigen::VectorXd make_weights(Eigen::Index rows) {
  const double values[] = {1.0, 0.5, 1.0, 3.0, 0.0};
  Eigen::VectorXd weights(rows);
  for (Eigen::Index row = 0; row < rows; ++row) weights(row) = values[row % 5];
  return weights;
}

Eigen::MatrixXd make_queries() {
  Eigen::MatrixXd queries = make_sample(60, 999).inputs;
  queries.topRows(10).col(0) *= 3.0;
  queries.middleRows(5, 10).col(1).array() -= 70.0;
  return queries;
}

std::string to_csv(const std::vector<std::string>& names, const Eigen::MatrixXd& columns) {
  std::string text;
  for (const std::string& name : names) text += (text.empty() ? "" : ",") + name;
  text += '\n';
  for (Eigen::Index row = 0; row < columns.rows(); ++row) {
    for (Eigen::Index column = 0; column < columns.cols(); ++column) {
      if (column > 0) text += ',';
      const double value = columns(row, column);
      char digits[32];
      if (!std::isnan(value)) text.append(digits, std::to_chars(digits, digits + sizeof digits, value).ptr);
    }
    text += '\n';
  }
  return text;
}

}  // namespace bytes
