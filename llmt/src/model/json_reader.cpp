#include "model/json_reader.hpp"

namespace llmt {

JsonReader JsonReader::member(const char* key) const {
  if (!has(key)) fail(fmt::format("member \"{}\" is missing", key));
  return {json_.at(key), child(key)};
}

std::vector<JsonReader> JsonReader::elements() const {
  if (!json_.is_array()) fail("an array is needed");
  std::vector<JsonReader> result;
  for (std::size_t i = 0; i < json_.size(); ++i) {
    result.emplace_back(json_[i], child(std::to_string(i)));
  }
  return result;
}

Eigen::VectorXd JsonReader::vector(Eigen::Index size) const {
  const std::vector<double> values = list<double>();
  if (std::ssize(values) != size) fail(fmt::format("{} numbers are needed, there are {}", size, values.size()));
  return Eigen::Map<const Eigen::VectorXd>(values.data(), size);
}

Eigen::MatrixXd JsonReader::matrix(Eigen::Index rows, Eigen::Index columns) const {
  const std::vector<JsonReader> of_row = elements();
  if (std::ssize(of_row) != rows) fail(fmt::format("{} rows are needed, there are {}", rows, of_row.size()));
  Eigen::MatrixXd matrix(rows, columns);
  for (Eigen::Index i = 0; i < rows; ++i) {
    matrix.row(i) = of_row[i].vector(columns).transpose();
  }
  return matrix;
}

std::string JsonReader::child(const std::string& key) const {
  return fmt::format("{}{}{}", where_, where_.find(": /") == std::string::npos ? ": /" : "/", key);
}

}  // namespace llmt
