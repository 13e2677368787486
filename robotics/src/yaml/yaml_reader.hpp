// A YAML map read key by key. Every error names file, line and key; a key that was never read is an error too.
#pragma once

#include <yaml-cpp/yaml.h>

#include <Eigen/Core>
#include <set>
#include <string>
#include <vector>

namespace llmt::robotics {

class YamlMap {
 public:
  /// `where` names the map in messages, e.g. "joints[2]".
  YamlMap(const YAML::Node& node, std::string file, std::string where);

  bool has(const std::string& key) const { return static_cast<bool>(node_[key]); }

  std::vector<std::string> keys() const;  ///< in the order of the file

  std::string text(const std::string& key);  ///< at most 10 000 characters
  double number(const std::string& key);
  Eigen::Vector3d vector(const std::string& key);
  std::vector<double> numbers(const std::string& key, std::size_t count);
  std::vector<double> all_numbers(const std::string& key, std::size_t most);
  std::vector<std::string> texts(const std::string& key, std::size_t most);
  YamlMap map(const std::string& key);
  std::vector<YamlMap> maps(const std::string& key, std::size_t most);

  double number_or(const std::string& key, double otherwise) { return has(key) ? number(key) : otherwise; }
  Eigen::Vector3d vector_or(const std::string& key, const Eigen::Vector3d& otherwise) {
    return has(key) ? vector(key) : otherwise;
  }
  std::string text_or(const std::string& key, const std::string& otherwise) { return has(key) ? text(key) : otherwise; }

  /// To be called last: throws if the map has a key that was not asked for. `known` keys are listed in the message.
  void finish(const std::vector<std::string>& known) const;

  [[noreturn]] void refuse(const std::string& message) const { refuse_at(node_, message); }

  /// The same at the line of a key's value, or of the map if it has no such key.
  [[noreturn]] void refuse(const std::string& key, const std::string& message) const;

 private:
  YAML::Node node_;
  std::string file_;
  std::string where_;
  std::set<std::string> asked_;

  YAML::Node at(const std::string& key);
  double to_number(const YAML::Node& node, const std::string& key) const;
  [[noreturn]] void refuse_at(const YAML::Node& node, const std::string& message) const;
};

/// Parses a text of one document. Throws std::runtime_error `file:line: ...` if it is no YAML, holds a second document,
/// more than 16 MiB or more than 300 000 nodes.
YAML::Node parse_yaml(const std::string& text, const std::string& file);

}  // namespace llmt::robotics
