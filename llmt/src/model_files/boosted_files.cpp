// Boosted models as JSON: docs/file-formats.md.
#include <algorithm>
#include <cmath>
#include <utility>

#include "boosted/model/boosted_checks.hpp"
#include "llmt/boosted_model.hpp"
#include "llmt/files.hpp"
#include "llmt/limits.hpp"
#include "model_files/model_json.hpp"
#include "model_files/spread_files.hpp"

namespace llmt {
namespace {

// A sum of inputs with factors, which versions before 3 did not have.
bool is_direction(const BoostedFeature& feature) {
  if (feature.level >= 0) return false;
  const bool is_sum =
      feature.factors.front() == 1.0 &&
      (feature.factors.size() == 1 || (feature.factors.size() == 2 && std::abs(feature.factors[1]) == 1.0));
  return !is_sum;
}

bool has_directions(const BoostedModel& model) {
  return std::ranges::any_of(model.sums(),
                             [](const BoostedSum& sum) { return std::ranges::any_of(sum.features, is_direction); });
}

Json of_input(const InputColumn& input, double deviation) {
  Json json = {{"name", input.name}, {"low", input.low}, {"high", input.high}};
  if (input.is_categorical()) {
    json["levels"] = input.levels;
  } else {
    json["centre"] = input.centre;
    json["deviation"] = deviation;
  }
  return json;
}

// Single inputs, their sums and their differences as programs before version 3 read them.
Json of_feature(const BoostedFeature& feature) {
  if (is_direction(feature)) return {{"columns", feature.inputs}, {"factors", feature.factors}};
  Json json = {{"column", feature.inputs.front()}};
  if (feature.level >= 0) json["level"] = feature.level;
  if (feature.inputs.size() == 2) json[feature.factors[1] > 0.0 ? "plus_column" : "minus_column"] = feature.inputs[1];
  return json;
}

// 0 in place of 0.0, since there are thousands.
Json short_number(double value) {
  return value == std::floor(value) && std::abs(value) < 1e6 ? Json(static_cast<int>(value)) : Json(value);
}

// Lists of numbers: a sum has thousands of splits and leaves.
Json of_tree(const BoostedTree& tree) {
  Json splits = Json::array();
  for (const BoostedSplit& split : tree.splits) {
    splits.push_back(
        {split.feature, split.threshold, split.half_width, short_number(split.missing_left), split.left, split.right});
  }
  Json leaves = Json::array();
  Json means = Json::array();
  bool has_means = false;
  for (const BoostedLeaf& leaf : tree.leaves) {
    Json of_leaf = {leaf.constant, leaf.low, leaf.high};
    for (std::size_t k = 0; k < leaf.features.size(); ++k) {
      of_leaf.push_back(leaf.features[k]);
      of_leaf.push_back(leaf.slopes[k]);
      const double mean = leaf.means.empty() ? 0.0 : leaf.means[k];
      means.push_back(short_number(mean));
      has_means = has_means || mean != 0.0;
    }
    leaves.push_back(std::move(of_leaf));
  }
  Json json = {{"splits", std::move(splits)}, {"leaves", std::move(leaves)}};
  if (has_means) json["means"] = std::move(means);
  if (tree.smallest_share != BoostedTree().smallest_share) json["smallest_share"] = tree.smallest_share;
  return json;
}

// Without spreads as programs before them read it. Those find no residuals where there are some.
void write_held_out(const std::vector<SumResiduals>& parts, Json& json) {
  if (parts.size() == 1 && parts.front().spread.is_even()) {
    json["residuals"] = parts.front().residuals;
    return;
  }
  for (const SumResiduals& part : parts) {
    json["held_out"].push_back({{"residuals", part.residuals}, {"spread", json_of(part.spread)}});
  }
}

InputColumn input_from(const JsonReader& json, double& deviation) {
  InputColumn input{.name = json.member("name").as<std::string>(),
                    .low = json.member("low").as<double>(),
                    .high = json.member("high").as<double>()};
  deviation = 1.0;
  if (json.has("levels")) {
    input.levels = json.member("levels").list<std::string>();
    if (input.levels.empty()) json.member("levels").fail("it is empty");
    return input;
  }
  input.centre = json.member("centre").as<double>();
  deviation = json.member("deviation").as<double>();
  return input;
}

BoostedFeature feature_from(const JsonReader& json) {
  if (json.has("columns")) {
    return {.inputs = json.member("columns").list<int>(), .factors = json.member("factors").list<double>()};
  }
  BoostedFeature feature{.inputs = {json.member("column").as<int>()}, .level = json.as("level", -1)};
  for (const char* key : {"plus_column", "minus_column"}) {
    if (!json.has(key)) continue;
    feature.inputs.push_back(json.member(key).as<int>());
    feature.factors.push_back(key[0] == 'p' ? 1.0 : -1.0);
  }
  return feature;
}

BoostedSplit split_from(const JsonReader& json) {
  const std::vector<JsonReader> parts = json.elements();
  if (parts.size() != 6) json.fail("a split has 6 numbers");
  return {.feature = parts[0].as<int>(),
          .threshold = parts[1].as<double>(),
          .half_width = parts[2].as<double>(),
          .missing_left = parts[3].as<double>(),
          .left = parts[4].as<int>(),
          .right = parts[5].as<int>()};
}

BoostedLeaf leaf_from(const JsonReader& json) {
  const std::vector<JsonReader> parts = json.elements();
  if (parts.size() < 3 || parts.size() % 2 == 0) json.fail("a leaf has 3 numbers, and 2 for each slope");
  BoostedLeaf leaf{.constant = parts[0].as<double>(), .low = parts[1].as<double>(), .high = parts[2].as<double>()};
  for (std::size_t k = 3; k < parts.size(); k += 2) {
    leaf.features.push_back(parts[k].as<int>());
    leaf.slopes.push_back(parts[k + 1].as<double>());
  }
  return leaf;
}

// One for each slope, leaf by leaf.
void give_means(const JsonReader& json, BoostedTree& tree) {
  const auto means = json.list<double>();
  std::size_t slopes = 0;
  for (const BoostedLeaf& leaf : tree.leaves) slopes += leaf.slopes.size();
  if (means.size() != slopes) json.fail(fmt::format("{} means of {} slopes", means.size(), slopes));
  auto next = means.begin();
  for (BoostedLeaf& leaf : tree.leaves) {
    const auto begin = std::exchange(next, next + std::ssize(leaf.slopes));
    leaf.means.assign(begin, next);
  }
}

BoostedSum sum_from(const JsonReader& json) {
  BoostedSum sum{
      .base = json.member("base").as<double>(), .rate = json.member("rate").as<double>(), .features = {}, .trees = {}};
  for (const JsonReader& feature : json.member("features").elements()) sum.features.push_back(feature_from(feature));
  for (const JsonReader& entry : json.member("trees").elements()) {
    BoostedTree tree;
    for (const JsonReader& split : entry.member("splits").elements()) tree.splits.push_back(split_from(split));
    for (const JsonReader& leaf : entry.member("leaves").elements()) tree.leaves.push_back(leaf_from(leaf));
    if (entry.has("means")) give_means(entry.member("means"), tree);
    tree.smallest_share = entry.as("smallest_share", tree.smallest_share);
    sum.trees.push_back(std::move(tree));
  }
  if (json.has("residuals")) sum.held_out.push_back({json.member("residuals").list<double>()});
  if (!json.has("held_out")) return sum;
  for (const JsonReader& part : json.member("held_out").elements()) {
    sum.held_out.push_back({part.member("residuals").list<double>(), spread_from(part.member("spread"))});
  }
  return sum;
}

void check_boosted_format(const JsonReader& root) {
  if (!root.has("format") || root.member("format").as<std::string>() != boosted_format_name) {
    root.fail("not a file of a boosted model, which llmt fit --boost writes");
  }
  if (const int version = root.member("version").as<int>(); version < 1 || version > boosted_format_version) {
    root.fail(
        fmt::format("version {} of the format of boosted models cannot be read, this program knows versions 1 to {}",
                    version, boosted_format_version));
  }
}

}  // namespace

Json json_of(const BoostedModel& model) {
  constexpr int without_directions = 2;
  Json json = {{"format", boosted_format_name},
               {"version", has_directions(model) ? boosted_format_version : without_directions}};
  json["inputs"] = Json::array();
  for (std::size_t j = 0; j < model.inputs().size(); ++j) {
    json["inputs"].push_back(of_input(model.inputs()[j], model.deviations()[j]));
  }
  json["outputs"] = Json::array();
  for (const OutputColumn& output : model.outputs()) {
    json["outputs"].push_back({{"name", output.name}, {"low", output.low}, {"high", output.high}});
  }
  json["sums"] = Json::array();
  for (const BoostedSum& sum : model.sums()) {
    Json features = Json::array();
    for (const BoostedFeature& feature : sum.features) features.push_back(of_feature(feature));
    Json trees = Json::array();
    for (const BoostedTree& tree : sum.trees) trees.push_back(of_tree(tree));
    json["sums"].push_back(
        {{"base", sum.base}, {"rate", sum.rate}, {"features", std::move(features)}, {"trees", std::move(trees)}});
    write_held_out(sum.held_out, json["sums"].back());
  }
  if (!model.gaps().empty()) json["gaps"] = json_of(model.gaps());
  if (!model.record().empty()) json["training"] = json_of(model.record());
  return json;
}

std::string to_json(const BoostedModel& model) { return compact_text(json_of(model)); }

BoostedModel boosted_model_from(const JsonReader& root) {
  check_boosted_format(root);
  std::vector<InputColumn> inputs;
  std::vector<double> deviations;
  for (const JsonReader& input : root.member("inputs").elements()) {
    inputs.push_back(input_from(input, deviations.emplace_back()));
  }
  std::vector<OutputColumn> outputs;
  for (const JsonReader& output : root.member("outputs").elements()) {
    outputs.push_back({.name = output.member("name").as<std::string>(),
                       .low = output.member("low").as<double>(),
                       .high = output.member("high").as<double>()});
  }
  std::vector<BoostedSum> sums;
  for (const JsonReader& sum : root.member("sums").elements()) sums.push_back(sum_from(sum));
  std::vector<Gap> gaps = gaps_from(root);
  try {
    return {std::move(inputs), std::move(outputs), std::move(deviations),
            std::move(sums),   std::move(gaps),    record_from(root)};
  } catch (const BoostedFault& fault) {
    root.fail_at(fault.pointer(), fault.problem());
  } catch (const std::invalid_argument& error) {
    root.member(root.has("training") && !root.has("gaps") ? "training" : "gaps").fail(error.what());
  }
}

BoostedModel boosted_from_json(const std::string& text, const std::string& name) {
  const JsonDocument document = parse_json(text, name, most(Limit::model_values));
  return boosted_model_from({document.value(), name});
}

void save(const BoostedModel& model, const std::string& path) { write_file(path, to_json(model)); }

BoostedModel load_boosted(const std::string& path) { return boosted_from_json(read_file(path, model_limit), path); }

}  // namespace llmt
