#include <fmt/format.h>

#include <algorithm>
#include <stdexcept>
#include <vector>

#include "llmt/files.hpp"
#include "llmt/limits.hpp"
#include "llmt/model.hpp"
#include "model/codes.hpp"
#include "model_files/model_json.hpp"

namespace llmt {
namespace {

Json to_array(const Eigen::VectorXd& values) { return Json(std::vector<double>(values.begin(), values.end())); }

Json rows_to_json(const Eigen::MatrixXd& matrix) {
  Json rows = Json::array();
  for (Eigen::Index i = 0; i < matrix.rows(); ++i) {
    rows.push_back(to_array(matrix.row(i)));
  }
  return rows;
}

Json split_to_json(const Node& node, const Model& model) {
  Json json = {{"input", model.inputs()[node.split_input].name}, {"column", node.split_input}};
  if (node.is_oblique()) json["direction"] = to_array(node.direction);
  if (node.level_side.empty()) {
    json["threshold"] = node.threshold;
    json["half_width"] = node.half_width;
  } else {
    json["level_side"] = node.level_side;
  }
  json["missing_left"] = node.missing_left;
  json["left"] = node.left;
  json["right"] = node.right;
  return json;
}

// The lower triangle of a symmetric matrix, row by row.
std::vector<double> lower_triangle(const Eigen::MatrixXd& matrix) {
  std::vector<double> lower;
  for (Eigen::Index i = 0; i < matrix.rows(); ++i) {
    for (Eigen::Index j = 0; j <= i; ++j) {
      lower.push_back(matrix(i, j));
    }
  }
  return lower;
}

Json to_json(const Node& node, const Model& model) {
  Json json;
  if (!node.is_leaf()) json["split"] = split_to_json(node, model);
  json["samples"] = node.samples;
  json["rank"] = node.rank;
  json["rss"] = to_array(node.rss);
  json["value"] = to_array(node.value);
  json["slope"] = rows_to_json(node.slope);
  json["mean"] = to_array(node.mean);
  json["low"] = to_array(node.low);
  json["high"] = to_array(node.high);
  if (node.inverse_gram.size() > 0) json["inverse_gram"] = lower_triangle(node.inverse_gram);
  return json;
}

Json to_json(const InputColumn& input) {
  Json json = {{"name", input.name}, {"low", input.low}, {"high", input.high}, {"centre", input.centre}};
  if (!input.codes.empty()) {
    json["codes"] = input.codes;
    if (input.has_empty_level()) json["empty_level"] = input.codes.size();
  } else if (input.is_categorical()) {
    json["levels"] = input.levels;
  }
  return json;
}

Json to_json(const Regressor& regressor) {
  Json json = {{"column", regressor.input}};
  if (regressor.level >= 0) json["level"] = regressor.level;
  if (regressor.second_input >= 0) json["second_column"] = regressor.second_input;
  json["centre"] = regressor.centre;
  return json;
}

bool has_output_range(const Partition& partition) { return partition.output_range.size() > 0; }

// [] for an output that is not clamped.
Json output_range_to_json(const Eigen::MatrixXd& range) {
  Json rows = Json::array();
  for (Eigen::Index o = 0; o < range.rows(); ++o) {
    rows.push_back(range.row(o).allFinite() ? to_array(range.row(o)) : Json::array());
  }
  return rows;
}

Json to_json(const Partition& partition, const Model& model) {
  Json nodes = Json::array();
  for (const Node& node : partition.nodes) {
    nodes.push_back(to_json(node, model));
  }
  const bool has_outer_slope = partition.outer_slope.size() > 0;
  Json json = {{"outputs", partition.outputs},
               {"validity",
                {{"kind", name_of(partition.validity.kind)},
                 {"width", partition.validity.width},
                 {"smoothness", 1}}},  // continuous derivatives of a blend
               {"outer_slope", rows_to_json(has_outer_slope ? partition.outer_slope : partition.nodes.front().slope)},
               {"residual_range", rows_to_json(partition.residual_range)}};
  if (has_output_range(partition)) json["output_range"] = output_range_to_json(partition.output_range);
  json["nodes"] = std::move(nodes);
  return json;
}

int version_of(const Model& model) {
  if (std::ranges::any_of(model.inputs(), &InputColumn::has_empty_level)) return model_format_version_with_empty_levels;
  if (has_codes(model.inputs())) return model_format_version_with_codes;
  return std::ranges::any_of(model.partitions(), has_output_range) ? model_format_version_with_range
                                                                   : model_format_version;
}

// Containers counted, as parse_json() does. No model is deep.
std::int64_t values_in(const Json& json) {
  std::int64_t count = 1;
  for (const Json& value : json) count += json.is_structured() ? values_in(value) : 0;
  return count;
}

[[noreturn]] void refuse_size(std::int64_t size, const char* what) {
  throw std::runtime_error(fmt::format(
      "llmt::to_json: the model has {} {}; at most {} MiB and {} values are read. Fewer leaves or inputs, or a model "
      "without intervals, take less",
      size, what, model_limit.bytes >> 20, most(Limit::model_values)));
}

// `indent`: of a line, as nlohmann's dump() takes it; -1: one line.
std::string text_of(const Json& json, int indent) {
  if (const std::int64_t values = values_in(json); values > most(Limit::model_values)) refuse_size(values, "values");
  std::string text;
  try {
    text = json.dump(indent) + "\n";
  } catch (const Json::type_error&) {
    throw std::runtime_error("llmt::to_json: a column name is not valid UTF-8");
  }
  if (text.size() > model_limit.bytes) refuse_size(text.size(), "bytes");
  return text;
}

}  // namespace

Json json_of(const Model& model) {
  Json json;
  json["format"] = model_format_name;
  json["version"] = version_of(model);
  json["inputs"] = Json::array();
  for (const InputColumn& input : model.inputs()) {
    json["inputs"].push_back(to_json(input));
  }
  json["outputs"] = Json::array();
  for (const OutputColumn& output : model.outputs()) {
    json["outputs"].push_back({{"name", output.name}, {"low", output.low}, {"high", output.high}});
  }
  json["regressors"] = Json::array();
  for (const Regressor& regressor : model.regressors()) {
    json["regressors"].push_back(to_json(regressor));
  }
  json["partitions"] = Json::array();
  for (const Partition& partition : model.partitions()) {
    json["partitions"].push_back(to_json(partition, model));
  }
  return json;
}

std::string model_text(const Json& json) { return text_of(json, 1); }

std::string compact_text(const Json& json) { return text_of(json, -1); }

std::string to_json(const Model& model) { return model_text(json_of(model)); }

void save(const Model& model, const std::string& path) { write_file(path, to_json(model)); }

}  // namespace llmt
