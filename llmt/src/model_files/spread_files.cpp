#include "model_files/spread_files.hpp"

namespace llmt {

Json json_of(const Spread& spread) {
  Json nodes = Json::array();
  for (const SpreadNode& node : spread.nodes) {
    if (node.is_leaf()) {
      nodes.push_back(Json::array({node.factor}));
    } else {
      nodes.push_back({node.column, node.threshold, node.missing_left ? 1 : 0, node.left, node.right});
    }
  }
  Json json = {{"nodes", std::move(nodes)}};
  if (!spread.levels.empty()) json["levels"] = spread.levels;
  if (spread.noise_share > 0.0) {
    json["noise_share"] = spread.noise_share;
    json["usual_weight"] = spread.usual_weight;
  }
  return json;
}

Json json_of(const std::vector<Gap>& gaps) {
  Json json = Json::array();
  for (const Gap& gap : gaps) {
    Json sides = Json::array();
    for (const GapSide& side : gap.sides) sides.push_back({side.column, side.low, side.high});
    json.push_back(std::move(sides));
  }
  return json;
}

Json json_of(const TrainingRecord& record) {
  Json inputs = Json::array();
  for (const InputRecord& input : record.inputs) {
    Json& json = inputs.emplace_back(Json::object());
    if (input.empty()) continue;
    if (input.missing > 0) json["missing"] = input.missing;
    if (!input.values.empty()) json["values"] = input.values;
    json["counts"] = input.counts;
  }
  Json json = {{"inputs", std::move(inputs)}};
  if (record.size_limit > 0) json["size_limit"] = record.size_limit;
  for (const std::vector<LeafRecord>& of_output : record.leaves) {
    Json& leaves = json["leaves"].emplace_back(Json::array());
    for (const LeafRecord& leaf : of_output) leaves.push_back({leaf.rows, leaf.mean_square});
  }
  return json;
}

std::vector<Gap> gaps_from(const JsonReader& model) {
  std::vector<Gap> gaps;
  if (!model.has("gaps")) return gaps;
  for (const JsonReader& entry : model.member("gaps").elements()) {
    Gap& gap = gaps.emplace_back();
    for (const JsonReader& side : entry.elements()) {
      const std::vector<JsonReader> parts = side.elements();
      if (parts.size() != 3) side.fail("a side of a gap has 3 numbers: a column, and the ends");
      gap.sides.push_back({parts[0].as<int>(), parts[1].as<double>(), parts[2].as<double>()});
    }
  }
  return gaps;
}

TrainingRecord record_from(const JsonReader& model) {
  TrainingRecord record;
  if (!model.has("training")) return record;
  const JsonReader training = model.member("training");
  for (const JsonReader& json : training.member("inputs").elements()) {
    InputRecord& input = record.inputs.emplace_back();
    input.missing = json.as<Eigen::Index>("missing", 0);
    if (json.has("values")) input.values = json.member("values").list<double>();
    if (json.has("counts")) input.counts = json.member("counts").list<Eigen::Index>();
  }
  record.size_limit = training.as<Eigen::Index>("size_limit", 0);
  if (!training.has("leaves")) return record;
  for (const JsonReader& of_output : training.member("leaves").elements()) {
    std::vector<LeafRecord>& leaves = record.leaves.emplace_back();
    for (const JsonReader& leaf : of_output.elements()) {
      const std::vector<JsonReader> parts = leaf.elements();
      if (parts.size() != 2) leaf.fail("a leaf has 2 numbers: rows, and a mean square");
      leaves.push_back({parts[0].as<Eigen::Index>(), parts[1].as<double>()});
    }
  }
  return record;
}

Spread spread_from(const JsonReader& json) {
  Spread spread;
  for (const JsonReader& entry : json.member("nodes").elements()) {
    const std::vector<JsonReader> parts = entry.elements();
    SpreadNode& node = spread.nodes.emplace_back();
    if (parts.size() == 1) {
      node.factor = parts[0].as<double>();
      continue;
    }
    if (parts.size() != 5) entry.fail("a leaf of a spread has 1 number, a split 5");
    const int side = parts[2].as<int>();
    if (side != 0 && side != 1) parts[2].fail("0 or 1 is needed");
    node.column = parts[0].as<int>();
    node.threshold = parts[1].as<double>();
    node.missing_left = side == 1;
    node.left = parts[3].as<int>();
    node.right = parts[4].as<int>();
    if (node.left < 0) parts[3].fail("it must not be negative");
  }
  if (json.has("noise_share")) {
    spread.noise_share = json.member("noise_share").as<double>();
    spread.usual_weight = json.member("usual_weight").as<double>();
  }
  if (!json.has("levels")) return spread;
  for (const JsonReader& values : json.member("levels").elements()) spread.levels.push_back(values.list<double>());
  return spread;
}

}  // namespace llmt
