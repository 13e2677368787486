#include <algorithm>
#include <limits>
#include <utility>

#include "llmt/files.hpp"
#include "llmt/limits.hpp"
#include "llmt/model.hpp"
#include "model/codes.hpp"
#include "model/model_checks.hpp"
#include "model_files/model_json.hpp"

namespace llmt {
namespace {

void read_split(const JsonReader& split, const std::vector<InputColumn>& inputs, Node& node) {
  node.split_input = split.member("column").as<int>();
  const bool exists = node.split_input >= 0 && node.split_input < std::ssize(inputs);
  if (exists && split.has("input") && split.member("input").as<std::string>() != inputs[node.split_input].name) {
    split.member("input").fail(
        fmt::format("column {} has the name \"{}\"", node.split_input, quotable(inputs[node.split_input].name)));
  }
  if (split.has("direction")) node.direction = split.member("direction").vector(std::ssize(inputs));
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

// `lower`: the lower triangle of a symmetric matrix, row by row.
Eigen::MatrixXd symmetric(const Eigen::VectorXd& lower, Eigen::Index size) {
  Eigen::MatrixXd matrix(size, size);
  for (Eigen::Index i = 0, k = 0; i < size; ++i) {
    for (Eigen::Index j = 0; j <= i; ++j, ++k) {
      matrix(i, j) = matrix(j, i) = lower(k);
    }
  }
  return matrix;
}

Node node_from_json(const JsonReader& json, const std::vector<InputColumn>& inputs, Eigen::Index outputs,
                    Eigen::Index regressors) {
  Node node;
  if (json.has("split")) read_split(json.member("split"), inputs, node);
  node.samples = json.member("samples").as<Eigen::Index>();
  node.rank = json.member("rank").as<int>();
  node.rss = json.member("rss").vector(outputs);
  node.value = json.member("value").vector(outputs);
  node.slope = json.member("slope").matrix(outputs, regressors);
  node.mean = json.member("mean").vector(regressors);
  node.low = json.member("low").vector(regressors);
  node.high = json.member("high").vector(regressors);
  for (const char* shared : {"shared_with", "guard_parent"}) {
    if (json.has(shared))
      json.member(shared).fail("leaves that share a local model cannot be read; fit the model anew");
  }
  if (json.has("inverse_gram")) {
    const Eigen::VectorXd lower = json.member("inverse_gram").vector((regressors + 1) * (regressors + 2) / 2);
    node.inverse_gram = symmetric(lower, regressors + 1);
  }
  return node;
}

Validity validity_from_json(const JsonReader& json) {
  const std::string kind = json.member("kind").as<std::string>();
  const auto found = std::ranges::find(choices<ValidityKind>(), kind, &Choice<ValidityKind>::name);
  if (found == choices<ValidityKind>().end()) {
    json.member("kind").fail(
        fmt::format("\"{}\" is not known: crisp, blend, gaussian and logistic are", quotable(kind)));
  }
  if (const int smoothness = json.member("smoothness").as<int>(); smoothness != 1) {
    json.member("smoothness").fail(fmt::format("{} is not known: blends have 1 continuous derivative", smoothness));
  }
  return {.kind = found->value, .width = json.member("width").as<double>()};
}

// Returns the version.
int check_format(const JsonReader& root) {
  if (root.has("format") && root.member("format").is_text() &&
      root.member("format").as<std::string>() == boosted_format_name) {
    root.fail("a boosted model, the sum of many trees; one tree is needed here: fit without --boost");
  }
  if (is_dynamic_model(root)) root.fail("a model of a system that moves; llmt simulate runs it, not llmt predict");
  if (!root.has("format") || root.member("format").as<std::string>() != model_format_name) {
    root.fail(fmt::format("not a model file: \"format\" is not \"{}\"", model_format_name));
  }
  const int version = root.member("version").as<int>();
  if (version < model_format_version || version > model_format_version_with_empty_levels) {
    root.fail(fmt::format("version {} of the model format cannot be read, this program knows versions {} to {}",
                          version, model_format_version, model_format_version_with_empty_levels));
  }
  return version;
}

InputColumn input_from_json(const JsonReader& json, int version) {
  InputColumn input{.name = json.member("name").as<std::string>(),
                    .low = json.member("low").as<double>(),
                    .high = json.member("high").as<double>(),
                    .centre = json.member("centre").as<double>()};
  if (json.has("levels")) input.levels = json.member("levels").list<std::string>();
  if (json.has("codes")) {
    const JsonReader codes = json.member("codes");
    if (version < model_format_version_with_codes) {
      codes.fail(fmt::format("a file of version {} has no such member", version));
    }
    if (json.has("levels")) codes.fail("an input has levels or codes, not both");
    input.codes = codes.list<double>();
    if (input.codes.empty()) codes.fail("it is empty");
    input.levels = names_of_codes(input.codes);
    if (json.has("empty_level")) {
      const JsonReader level = json.member("empty_level");
      if (!std::cmp_equal(level.as<int>(), input.codes.size())) level.fail("it is not the number of codes");
      input.levels.emplace_back();
    }
  }
  if (input.has_empty_level() && version < model_format_version_with_empty_levels) {
    json.fail(fmt::format("a file of version {} has no level of missing values, the last one without a name", version));
  }
  return input;
}

OutputColumn output_from_json(const JsonReader& json) {
  return {.name = json.member("name").as<std::string>(),
          .low = json.member("low").as<double>(),
          .high = json.member("high").as<double>()};
}

Regressor regressor_from_json(const JsonReader& json) {
  return {.input = json.member("column").as<int>(),
          .level = json.as("level", -1),
          .centre = json.member("centre").as<double>(),
          .second_input = json.as("second_column", -1)};
}

// [] for an output that is not clamped.
Eigen::MatrixXd output_range_from_json(const JsonReader& json, Eigen::Index outputs) {
  const std::vector<JsonReader> of_output = json.elements();
  if (std::ssize(of_output) != outputs) {
    json.fail(fmt::format("{} rows are needed, there are {}", outputs, of_output.size()));
  }
  constexpr double open = std::numeric_limits<double>::infinity();
  Eigen::MatrixXd range(outputs, 2);
  for (Eigen::Index o = 0; o < outputs; ++o) {
    range.row(o) << -open, open;
    if (of_output[o].size() > 0) range.row(o) = of_output[o].vector(2).transpose();
  }
  return range;
}

Partition partition_from_json(const JsonReader& json, const std::vector<InputColumn>& inputs, Eigen::Index regressors,
                              int version) {
  Partition partition{.outputs = json.member("outputs").list<int>(),
                      .validity = validity_from_json(json.member("validity")),
                      .nodes = {},
                      .outer_slope = {},
                      .residual_range = {},
                      .output_range = {}};
  const Eigen::Index outputs = std::ssize(partition.outputs);
  partition.outer_slope = json.member("outer_slope").matrix(outputs, regressors);
  if (const JsonReader range = json.member("residual_range"); !range.elements().empty()) {
    partition.residual_range = range.matrix(outputs, 2);
  }
  if (json.has("output_range")) {
    const JsonReader range = json.member("output_range");
    if (version < model_format_version_with_range) {
      range.fail(fmt::format("a file of version {} has no such member", version));
    }
    partition.output_range = output_range_from_json(range, outputs);
  }
  for (const JsonReader& node : json.member("nodes").elements()) {
    partition.nodes.push_back(node_from_json(node, inputs, outputs, regressors));
  }
  return partition;
}

// Calls read(element) for every element of an array.
template <class Read>
auto all_of(const JsonReader& array, const Read& read) {
  std::vector<decltype(read(array))> result;
  for (const JsonReader& element : array.elements()) {
    result.push_back(read(element));
  }
  return result;
}

}  // namespace

bool is_dynamic_model(const JsonReader& json) {
  return json.has("format") && json.member("format").is_text() &&
         json.member("format").as<std::string>() == dynamic_format_name;
}

Model model_from(const JsonReader& root) {
  const int version = check_format(root);
  std::vector<InputColumn> inputs =
      all_of(root.member("inputs"), [&](const JsonReader& entry) { return input_from_json(entry, version); });
  std::vector<OutputColumn> outputs = all_of(root.member("outputs"), output_from_json);
  std::vector<Regressor> regressors = all_of(root.member("regressors"), regressor_from_json);
  std::vector<Partition> partitions = all_of(root.member("partitions"), [&](const JsonReader& entry) {
    return partition_from_json(entry, inputs, std::ssize(regressors), version);
  });
  try {
    return {std::move(inputs), std::move(outputs), std::move(regressors), std::move(partitions)};
  } catch (const ModelFault& fault) {
    root.fail_at(fault.pointer(), fault.problem());
  }
}

Model from_json(const std::string& text, const std::string& name) {
  const JsonDocument json = parse_json(text, name, most(Limit::model_values));
  return model_from({json.value(), name});
}

Model load(const std::string& path) { return from_json(read_file(path, model_limit), path); }

}  // namespace llmt
