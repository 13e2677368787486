#include "model/json_reader.hpp"

namespace llmt {

JsonReader JsonReader::member(const char* key) const {
  if (!has(key)) fail(fmt::format("member \"{}\" is missing", key));
  return {json_.at(key), child(key)};
}

std::vector<JsonReader> JsonReader::elements() const {
  std::vector<JsonReader> result;
  for (const Json& element : array()) {
    result.emplace_back(element, child(std::to_string(result.size())));
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

void JsonReader::fail_at(const std::string& pointer, const std::string& what) const {
  throw std::runtime_error(fmt::format("{}: {}", at(pointer), what));
}

const Json& JsonReader::array() const {
  if (!json_.is_array()) fail(fmt::format("an array is needed, not {}", quotable(json_)));
  return json_;
}

std::string JsonReader::at(const std::string& pointer) const {
  if (pointer.empty()) return where_;
  return fmt::format("{}{}{}", where_, where_.find(": /") == std::string::npos ? ": " : "", pointer);
}

}  // namespace llmt
