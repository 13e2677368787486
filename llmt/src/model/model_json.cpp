#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cstdint>
#include <nlohmann/json.hpp>
#include <optional>
#include <stdexcept>
#include <type_traits>
#include <utility>

#include "llmt/files.hpp"
#include "llmt/model.hpp"
#include "model/shared_leaves.hpp"

namespace llmt {
namespace {

using Json = nlohmann::ordered_json;

// In the order of ValidityKind.
constexpr std::array<const char*, 4> validity_names = {"crisp", "blend", "gaussian", "logistic"};

constexpr const char* format_name = "llmt-model";
constexpr int format_version = 2;

Json to_array(const Eigen::VectorXd& values) { return Json(std::vector<double>(values.begin(), values.end())); }

Json rows_to_json(const Eigen::MatrixXd& matrix) {
  Json rows = Json::array();
  for (Eigen::Index i = 0; i < matrix.rows(); ++i) {
    rows.push_back(to_array(matrix.row(i)));
  }
  return rows;
}

Json node_to_json(const Node& node, const Model& model) {
  Json json;
  if (!node.is_leaf()) {
    json["split"] = {{"input", model.inputs()[node.split_input].name}, {"column", node.split_input}};
    if (node.is_oblique()) {
      json["split"]["direction"] = to_array(node.direction);
    }
    if (node.level_side.empty()) {
      json["split"]["threshold"] = node.threshold;
      json["split"]["half_width"] = node.half_width;
    } else {
      json["split"]["level_side"] = node.level_side;
    }
    json["split"]["missing_left"] = node.missing_left;
    json["split"]["left"] = node.left;
    json["split"]["right"] = node.right;
  }
  json["samples"] = node.samples;
  json["rank"] = node.rank;
  json["rss"] = to_array(node.rss);
  json["value"] = to_array(node.value);
  json["slope"] = rows_to_json(node.slope);
  json["mean"] = to_array(node.mean);
  json["low"] = to_array(node.low);
  json["high"] = to_array(node.high);
  if (node.guard_parent >= 0) {
    json["guard_parent"] = node.guard_parent;
  }
  if (node.inverse_gram.size() > 0) {
    std::vector<double> lower;  // triangle, row by row
    for (Eigen::Index i = 0; i < node.inverse_gram.rows(); ++i) {
      for (Eigen::Index j = 0; j <= i; ++j) {
        lower.push_back(node.inverse_gram(i, j));
      }
    }
    json["inverse_gram"] = std::move(lower);
  }
  return json;
}

// A JSON value together with the way to it, so that an error can say where it is.
class Reader {
 public:
  Reader(const Json& json, std::string where) : json_(json), where_(std::move(where)) {}

  Reader member(const char* key) const {
    if (!json_.is_object() || !json_.contains(key)) {
      fail(fmt::format("member \"{}\" is missing", key));
    }
    return {json_.at(key), child(key)};
  }
  bool has(const char* key) const { return json_.is_object() && json_.contains(key); }

  std::vector<Reader> elements() const {
    if (!json_.is_array()) {
      fail("an array is needed");
    }
    std::vector<Reader> result;
    for (std::size_t i = 0; i < json_.size(); ++i) {
      result.emplace_back(json_[i], child(std::to_string(i)));
    }
    return result;
  }

  template <class Value>
  Value as() const {
    const bool fits = std::is_same_v<Value, std::string> ? json_.is_string()
                      : std::is_integral_v<Value>        ? json_.is_number_integer()
                                                         : json_.is_number();
    if (!fits) {
      fail(fmt::format("{} is needed, not {}",
                       std::is_same_v<Value, std::string> ? "a text"
                       : std::is_integral_v<Value>        ? "a whole number"
                                                          : "a number",
                       json_.dump().substr(0, 40)));
    }
    if constexpr (std::is_integral_v<Value>) {
      const std::int64_t value = json_.get<std::int64_t>();
      if (!std::in_range<Value>(value)) {
        fail(fmt::format("{} is out of range", value));
      }
      return static_cast<Value>(value);
    } else {
      return json_.get<Value>();
    }
  }

  template <class Value>
  std::vector<Value> list() const {
    std::vector<Value> result;
    for (const Reader& element : elements()) {
      result.push_back(element.as<Value>());
    }
    return result;
  }

  Eigen::VectorXd vector(Eigen::Index size) const {
    const std::vector<double> values = list<double>();
    if (std::ssize(values) != size) {
      fail(fmt::format("{} numbers are needed, there are {}", size, values.size()));
    }
    return Eigen::Map<const Eigen::VectorXd>(values.data(), size);
  }

  // `path: /member/0`, a JSON pointer behind the name of the file.
  std::string child(const std::string& key) const {
    return fmt::format("{}{}{}", where_, where_.find(": /") == std::string::npos ? ": /" : "/", key);
  }

  [[noreturn]] void fail(const std::string& what) const {
    throw std::runtime_error(fmt::format("{}: {}", where_, what));
  }

 private:
  const Json& json_;
  std::string where_;
};

Eigen::MatrixXd rows_from_json(const Reader& json, Eigen::Index rows, Eigen::Index columns) {
  const std::vector<Reader> elements = json.elements();
  if (std::ssize(elements) != rows) {
    json.fail(fmt::format("{} rows are needed, there are {}", rows, elements.size()));
  }
  Eigen::MatrixXd matrix(rows, columns);
  for (Eigen::Index i = 0; i < rows; ++i) {
    matrix.row(i) = elements[i].vector(columns).transpose();
  }
  return matrix;
}

Node node_from_json(const Reader& json, Eigen::Index inputs, Eigen::Index outputs, Eigen::Index regressors) {
  Node node;
  if (json.has("split")) {
    const Reader split = json.member("split");
    node.split_input = split.member("column").as<int>();
    if (split.has("direction")) {
      node.direction = split.member("direction").vector(inputs);
    }
    if (split.has("level_side")) {
      node.level_side = split.member("level_side").list<int>();
    } else {
      node.threshold = split.member("threshold").as<double>();
      node.half_width = split.member("half_width").as<double>();
    }
    node.missing_left = split.member("missing_left").as<double>();
    node.left = split.member("left").as<int>();
    node.right = split.member("right").as<int>();
  }
  node.samples = json.member("samples").as<Eigen::Index>();
  node.rank = json.member("rank").as<int>();
  node.rss = json.member("rss").vector(outputs);
  node.value = json.member("value").vector(outputs);
  node.slope = rows_from_json(json.member("slope"), outputs, regressors);
  node.mean = json.member("mean").vector(regressors);
  node.low = json.member("low").vector(regressors);
  node.high = json.member("high").vector(regressors);
  if (json.has("guard_parent")) node.guard_parent = json.member("guard_parent").as<int>();
  if (json.has("inverse_gram")) {
    const Eigen::VectorXd lower = json.member("inverse_gram").vector((regressors + 1) * (regressors + 2) / 2);
    node.inverse_gram.resize(regressors + 1, regressors + 1);
    for (Eigen::Index i = 0, k = 0; i <= regressors; ++i) {
      for (Eigen::Index j = 0; j <= i; ++j, ++k) {
        node.inverse_gram(i, j) = node.inverse_gram(j, i) = lower(k);
      }
    }
  }
  return node;
}

Validity validity_from_json(const Reader& json) {
  const std::string kind = json.member("kind").as<std::string>();
  const auto found = std::ranges::find(validity_names, kind);
  if (found == validity_names.end()) {
    json.member("kind").fail(fmt::format("\"{}\" is not known: crisp, blend, gaussian and logistic are", kind));
  }
  return {.kind = static_cast<ValidityKind>(found - validity_names.begin()),
          .width = json.member("width").as<double>(),
          .smoothness = json.member("smoothness").as<int>()};
}

}  // namespace

std::string to_json(const Model& model) {
  Json json;
  json["format"] = format_name;
  json["version"] = format_version;
  json["inputs"] = Json::array();
  for (const InputColumn& input : model.inputs()) {
    json["inputs"].push_back(
        {{"name", input.name}, {"low", input.low}, {"high", input.high}, {"centre", input.centre}});
    if (input.is_categorical()) {
      json["inputs"].back()["levels"] = input.levels;
    }
  }
  json["outputs"] = Json::array();
  for (const OutputColumn& output : model.outputs()) {
    json["outputs"].push_back({{"name", output.name}, {"low", output.low}, {"high", output.high}});
  }
  json["regressors"] = Json::array();
  for (const Regressor& regressor : model.regressors()) {
    Json entry = {{"column", regressor.input}};
    if (regressor.level >= 0) {
      entry["level"] = regressor.level;
    }
    if (regressor.second_input >= 0) {
      entry["second_column"] = regressor.second_input;
    }
    entry["centre"] = regressor.centre;
    json["regressors"].push_back(std::move(entry));
  }
  json["partitions"] = Json::array();
  for (const Partition& partition : model.partitions()) {
    Json nodes = Json::array();
    for (const Node& node : partition.nodes) {
      nodes.push_back(node_to_json(node, model));
    }
    json["partitions"].push_back(
        {{"outputs", partition.outputs},
         {"validity",
          {{"kind", validity_names[static_cast<std::size_t>(partition.validity.kind)]},
           {"width", partition.validity.width},
           {"smoothness", partition.validity.smoothness}}},
         {"outer_slope",
          rows_to_json(partition.outer_slope.size() > 0 ? partition.outer_slope : partition.nodes.front().slope)},
         {"residual_range", rows_to_json(partition.residual_range)},
         {"nodes", std::move(nodes)}});
  }
  try {
    return json.dump(1) + "\n";
  } catch (const Json::type_error&) {
    throw std::runtime_error("llmt::to_json: a column name is not valid UTF-8");
  }
}

Model from_json(const std::string& text, const std::string& name) {
  Json json;
  try {
    json = Json::parse(text);
  } catch (const Json::parse_error& error) {
    throw std::runtime_error(fmt::format("{}: not JSON, or cut off: {}", name, error.what()));
  }
  const Reader root(json, name);
  if (!root.has("format") || root.member("format").as<std::string>() != format_name) {
    root.fail(fmt::format("not a model file: \"format\" is not \"{}\"", format_name));
  }
  if (const int version = root.member("version").as<int>(); version != format_version) {
    root.fail(fmt::format("version {} of the model format cannot be read, this program knows version {}", version,
                          format_version));
  }
  std::vector<InputColumn> inputs;
  for (const Reader& input : root.member("inputs").elements()) {
    inputs.push_back(
        {.name = input.member("name").as<std::string>(),
         .low = input.member("low").as<double>(),
         .high = input.member("high").as<double>(),
         .centre = input.member("centre").as<double>(),
         .levels = input.has("levels") ? input.member("levels").list<std::string>() : std::vector<std::string>{}});
  }
  std::vector<OutputColumn> outputs;
  for (const Reader& output : root.member("outputs").elements()) {
    outputs.push_back({.name = output.member("name").as<std::string>(),
                       .low = output.member("low").as<double>(),
                       .high = output.member("high").as<double>()});
  }
  std::vector<Regressor> regressors;
  for (const Reader& entry : root.member("regressors").elements()) {
    regressors.push_back({.input = entry.member("column").as<int>(),
                          .level = entry.has("level") ? entry.member("level").as<int>() : -1,
                          .centre = entry.member("centre").as<double>(),
                          .second_input = entry.has("second_column") ? entry.member("second_column").as<int>() : -1});
  }
  std::vector<Partition> partitions;
  for (const Reader& entry : root.member("partitions").elements()) {
    Partition partition{.outputs = entry.member("outputs").list<int>(),
                        .validity = validity_from_json(entry.member("validity")),
                        .nodes = {},
                        .outer_slope = {},
                        .residual_range = {}};
    partition.outer_slope =
        rows_from_json(entry.member("outer_slope"), std::ssize(partition.outputs), std::ssize(regressors));
    if (const Reader range = entry.member("residual_range"); !range.elements().empty()) {
      partition.residual_range = rows_from_json(range, std::ssize(partition.outputs), 2);
    }
    std::vector<std::optional<int>> shared_with;
    for (const Reader& node : entry.member("nodes").elements()) {
      partition.nodes.push_back(
          node_from_json(node, std::ssize(inputs), std::ssize(partition.outputs), std::ssize(regressors)));
      shared_with.push_back(node.has("shared_with") ? std::optional(node.member("shared_with").as<int>())
                                                    : std::nullopt);
    }
    try {
      set_guard_parents(partition, shared_with);
    } catch (const std::invalid_argument& error) {
      entry.fail(error.what());
    }
    partitions.push_back(std::move(partition));
  }
  try {
    return {std::move(inputs), std::move(outputs), std::move(regressors), std::move(partitions)};
  } catch (const std::invalid_argument& error) {
    throw std::runtime_error(fmt::format("{}: {}", name, error.what()));
  }
}

void save(const Model& model, const std::string& path) { write_file(path, to_json(model)); }

Model load(const std::string& path) { return from_json(read_file(path), path); }

}  // namespace llmt
