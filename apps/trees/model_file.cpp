#include "trees/model_file.hpp"

#include <fmt/format.h>

#include <exception>
#include <filesystem>
#include <fstream>
#include <stdexcept>

#include "llmt/csv.hpp"
#include "shared/table_file.hpp"

namespace llmt::apps {
namespace {

// Whether the file is no JSON, but a table of two columns or more.
bool is_table(const std::string& path) {
  std::error_code unknown;
  if (!std::filesystem::is_regular_file(path, unknown) || is_json_file(path)) return false;
  try {
    const Csv csv = Csv::read(path);
    return csv.columns().size() > 1 && csv.rows() > 0;
  } catch (const std::exception&) {
    return false;
  }
}

// Whether a JSON file names its format among its first letters.
bool begins_with(const std::string& path, const char* format) {
  std::error_code unknown;
  if (!std::filesystem::is_regular_file(path, unknown) || !is_json_file(path)) return false;
  std::ifstream file(path, std::ios::binary);
  std::string begin(200, ' ');
  file.read(begin.data(), static_cast<std::streamsize>(begin.size()));
  return begin.find(format) != std::string::npos;
}

}  // namespace

ModelWithIntervals load_model(const std::string& path, bool with_intervals) {
  try {
    return with_intervals ? load_with_intervals(path) : ModelWithIntervals{load(path), {}};
  } catch (const std::runtime_error&) {
    if (!is_table(path)) throw;
  }
  throw std::runtime_error(path + ": this is a table; a model file (JSON) is expected");
}

Model load_model(const std::string& path) { return load_model(path, false).model; }

Eigen::VectorXd positive_weights(const Csv& csv, const std::string& column, int threads) {
  Eigen::VectorXd weights = csv.numbers(column, threads);
  for (Eigen::Index row = 0; row < weights.size(); ++row) {
    if (!(weights(row) > 0.0)) {
      csv.refuse(row, column, fmt::format("a weight is positive, this one is {}", weights(row)));
    }
  }
  return weights;
}

bool is_boosted_file(const std::string& path) { return begins_with(path, "\"llmt-boosted-model\""); }

bool is_dynamic_file(const std::string& path) { return begins_with(path, "\"llmt-dynamic-model\""); }

}  // namespace llmt::apps
