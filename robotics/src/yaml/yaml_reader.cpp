#include "yaml/yaml_reader.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <stdexcept>

namespace llmt::robotics {

YAML::Node parse_yaml(const std::string& text, const std::string& file) {
  try {
    return YAML::Load(text);
  } catch (const YAML::ParserException& error) {
    throw std::runtime_error(fmt::format("{}:{}: {}", file, error.mark.line + 1, error.msg));
  }
}

YamlMap::YamlMap(const YAML::Node& node, std::string file, std::string where)
    : node_(node), file_(std::move(file)), where_(std::move(where)) {
  if (!node_.IsMap()) refuse("must be a map of keys and values");
  std::set<std::string> seen;
  for (const auto& entry : node_) {
    if (!entry.first.IsScalar()) refuse_at(entry.first, "a key must be a word");
    if (!seen.insert(entry.first.Scalar()).second)
      refuse_at(entry.first, fmt::format("key \"{}\" is there twice", entry.first.Scalar()));
  }
}

void YamlMap::refuse_at(const YAML::Node& node, const std::string& message) const {
  const int line = node.Mark().line;
  const std::string place = line < 0 ? file_ : fmt::format("{}:{}", file_, line + 1);
  throw std::runtime_error(where_.empty() ? fmt::format("{}: {}", place, message)
                                          : fmt::format("{}: {}: {}", place, where_, message));
}

YAML::Node YamlMap::at(const std::string& key) {
  asked_.insert(key);
  const YAML::Node value = node_[key];
  if (!value) refuse(fmt::format("key \"{}\" is missing", key));
  return value;
}

std::string YamlMap::text(const std::string& key) {
  const YAML::Node value = at(key);
  if (!value.IsScalar()) refuse_at(value, fmt::format("\"{}\" must be a word", key));
  return value.Scalar();
}

double YamlMap::to_number(const YAML::Node& node, const std::string& key) const {
  if (!node.IsScalar()) refuse_at(node, fmt::format("\"{}\" must be a number", key));
  const std::string& text = node.Scalar();
  const char* begin = text.data() + (text.starts_with('+') ? 1 : 0);
  const char* end = text.data() + text.size();
  double value = 0.0;
  const auto [stop, error] = std::from_chars(begin, end, value);
  if (error != std::errc() || stop != end || !std::isfinite(value)) {
    refuse_at(node, fmt::format("\"{}\" must be a number, is \"{}\"", key, text));
  }
  return value;
}

double YamlMap::number(const std::string& key) { return to_number(at(key), key); }

std::vector<double> YamlMap::numbers(const std::string& key, std::size_t count) {
  const YAML::Node value = at(key);
  if (!value.IsSequence() || value.size() != count)
    refuse_at(value, fmt::format("\"{}\" must be a list of {} numbers", key, count));
  return all_numbers(key);
}

std::vector<double> YamlMap::all_numbers(const std::string& key) {
  const YAML::Node value = at(key);
  if (!value.IsSequence()) refuse_at(value, fmt::format("\"{}\" must be a list of numbers", key));
  std::vector<double> result;
  for (const YAML::Node& entry : value) result.push_back(to_number(entry, key));
  return result;
}

Eigen::Vector3d YamlMap::vector(const std::string& key) {
  const std::vector<double> values = numbers(key, 3);
  return {values[0], values[1], values[2]};
}

YamlMap YamlMap::map(const std::string& key) { return {at(key), file_, where_.empty() ? key : where_ + "." + key}; }

std::vector<YamlMap> YamlMap::maps(const std::string& key) {
  const YAML::Node value = at(key);
  std::vector<YamlMap> result;
  if (value.IsNull()) return result;
  if (!value.IsSequence()) refuse_at(value, fmt::format("\"{}\" must be a list", key));
  const std::string where = where_.empty() ? key : where_ + "." + key;
  for (const YAML::Node& entry : value) result.emplace_back(entry, file_, fmt::format("{}[{}]", where, result.size()));
  return result;
}

void YamlMap::finish(const std::vector<std::string>& known) const {
  for (const auto& entry : node_) {
    const std::string& key = entry.first.Scalar();
    if (asked_.contains(key)) continue;
    if (std::ranges::find(known, key) != known.end())
      refuse_at(entry.first, fmt::format("key \"{}\" does not belong here", key));
    refuse_at(entry.first, fmt::format("unknown key \"{}\"; known: {}", key, fmt::join(known, ", ")));
  }
}

}  // namespace llmt::robotics
