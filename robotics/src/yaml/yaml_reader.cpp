#include "yaml/yaml_reader.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <yaml-cpp/eventhandler.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <sstream>
#include <stdexcept>

#include "llmt/limits.hpp"

namespace llmt::robotics {
namespace {

// The part of a file's text that a message shows.
std::string shown(const std::string& text) {
  constexpr std::size_t most = 60;
  if (text.size() <= most) return text;
  std::size_t end = most;
  while (end > 0 && (text[end] & 0xC0) == 0x80) --end;  // whole characters of UTF-8
  return text.substr(0, end) + "...";
}

// Reads a text without keeping it, to see how much it holds.
class Counter : public YAML::EventHandler {
 public:
  void OnDocumentStart(const YAML::Mark& mark) override {
    if (++documents_ == 2) throw YAML::ParserException(mark, "a second document begins, a file holds one");
  }
  void OnNull(const YAML::Mark& mark, YAML::anchor_t /*anchor*/) override { count(mark); }
  void OnAlias(const YAML::Mark& mark, YAML::anchor_t /*anchor*/) override { count(mark); }
  void OnScalar(const YAML::Mark& mark, const std::string& /*tag*/, YAML::anchor_t /*anchor*/,
                const std::string& /*value*/) override {
    count(mark);
  }
  void OnSequenceStart(const YAML::Mark& mark, const std::string& /*tag*/, YAML::anchor_t /*anchor*/,
                       YAML::EmitterStyle::value /*style*/) override {
    count(mark);
  }
  void OnMapStart(const YAML::Mark& mark, const std::string& /*tag*/, YAML::anchor_t /*anchor*/,
                  YAML::EmitterStyle::value /*style*/) override {
    count(mark);
  }
  void OnDocumentEnd() override {}
  void OnSequenceEnd() override {}
  void OnMapEnd() override {}

 private:
  int documents_ = 0;
  int nodes_ = 0;

  void count(const YAML::Mark& mark) {
    if (++nodes_ > most(Limit::yaml_nodes)) {
      throw YAML::ParserException(mark, fmt::format("more than {} keys, values and lists", most(Limit::yaml_nodes)));
    }
  }
};

}  // namespace

YAML::Node parse_yaml(const std::string& text, const std::string& file) {
  if (std::ssize(text) > most(Limit::description_bytes)) {
    throw std::runtime_error(
        fmt::format("{}: {} bytes, at most {} are read", file, text.size(), most(Limit::description_bytes)));
  }
  if (text.starts_with("\xFF\xFE") || text.starts_with("\xFE\xFF")) {
    throw std::runtime_error(fmt::format("{}: this is UTF-16, UTF-8 is needed", file));
  }
  if (const std::size_t zero = text.find('\0'); zero != std::string::npos) {  // yaml-cpp takes it for an escape
    throw std::runtime_error(
        fmt::format("{}:{}: a byte is 0", file,
                    1 + std::count(text.begin(), text.begin() + static_cast<std::ptrdiff_t>(zero), '\n')));
  }
  try {
    std::istringstream stream(text);
    YAML::Parser parser(stream);
    for (Counter counter; parser.HandleNextDocument(counter);) continue;
    return YAML::Load(text);
  } catch (const YAML::Exception& error) {
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
      refuse_at(entry.first, fmt::format("key \"{}\" is there twice", shown(entry.first.Scalar())));
  }
}

std::vector<std::string> YamlMap::keys() const {
  std::vector<std::string> keys;
  for (const auto& entry : node_) keys.push_back(entry.first.Scalar());
  return keys;
}

void YamlMap::refuse_at(const YAML::Node& node, const std::string& message) const {
  const int line = node.Mark().line;
  const std::string place = line < 0 ? file_ : fmt::format("{}:{}", file_, line + 1);
  throw std::runtime_error(where_.empty() ? fmt::format("{}: {}", place, message)
                                          : fmt::format("{}: {}: {}", place, where_, message));
}

void YamlMap::refuse(const std::string& key, const std::string& message) const {
  const YAML::Node value = node_[key];
  refuse_at(value ? value : node_, message);
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
  if (std::ssize(value.Scalar()) > most(Limit::expression_characters)) {
    refuse_at(value, fmt::format("\"{}\" has {} characters, at most {} are read", key, value.Scalar().size(),
                                 most(Limit::expression_characters)));
  }
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
    refuse_at(node, fmt::format("\"{}\" must be a number, is \"{}\"", key, shown(text)));
  }
  return value;
}

double YamlMap::number(const std::string& key) { return to_number(at(key), key); }

std::vector<double> YamlMap::numbers(const std::string& key, std::size_t count) {
  const YAML::Node value = at(key);
  if (!value.IsSequence() || value.size() != count)
    refuse_at(value, fmt::format("\"{}\" must be a list of {} numbers", key, count));
  return all_numbers(key, count);
}

std::vector<double> YamlMap::all_numbers(const std::string& key, std::size_t most) {
  const YAML::Node value = at(key);
  if (!value.IsSequence()) refuse_at(value, fmt::format("\"{}\" must be a list of numbers", key));
  if (value.size() > most) {
    refuse_at(value, fmt::format("\"{}\" has {} numbers, at most {} are read", key, value.size(), most));
  }
  std::vector<double> result;
  for (const YAML::Node& entry : value) result.push_back(to_number(entry, key));
  return result;
}

std::vector<std::string> YamlMap::texts(const std::string& key, std::size_t most) {
  const YAML::Node value = at(key);
  if (!value.IsSequence()) refuse_at(value, fmt::format("\"{}\" must be a list of texts", key));
  if (value.size() > most) {
    refuse_at(value, fmt::format("\"{}\" has {} entries, at most {} are read", key, value.size(), most));
  }
  std::vector<std::string> result;
  for (const YAML::Node& entry : value) {
    if (!entry.IsScalar()) refuse_at(entry, fmt::format("\"{}\" must be a list of texts", key));
    if (std::ssize(entry.Scalar()) > llmt::most(Limit::expression_characters)) {
      refuse_at(entry, fmt::format("{} characters, at most {} are read", entry.Scalar().size(),
                                   llmt::most(Limit::expression_characters)));
    }
    result.push_back(entry.Scalar());
  }
  return result;
}

Eigen::Vector3d YamlMap::vector(const std::string& key) {
  const std::vector<double> values = numbers(key, 3);
  return {values[0], values[1], values[2]};
}

YamlMap YamlMap::map(const std::string& key) { return {at(key), file_, where_.empty() ? key : where_ + "." + key}; }

std::vector<YamlMap> YamlMap::maps(const std::string& key, std::size_t most) {
  const YAML::Node value = at(key);
  std::vector<YamlMap> result;
  if (value.IsNull()) return result;
  if (!value.IsSequence()) refuse_at(value, fmt::format("\"{}\" must be a list", key));
  if (value.size() > most) {
    refuse_at(value, fmt::format("\"{}\" has {} entries, at most {} are read", key, value.size(), most));
  }
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
    refuse_at(entry.first, fmt::format("unknown key \"{}\"; known: {}", shown(key), fmt::join(known, ", ")));
  }
}

}  // namespace llmt::robotics
