// YAML written key by key.
#pragma once

#include <fmt/format.h>
#include <yaml-cpp/yaml.h>

#include <string>
#include <vector>

namespace llmt::robotics {

/// The shortest decimal that reads back to the same bits.
inline std::string exact(double value) { return fmt::format("{}", value); }

class YamlWriter {
 public:
  std::string finish() { return std::string(out_.c_str()) + "\n"; }

  YamlWriter& begin_map(YAML::EMITTER_MANIP style = YAML::Flow) { return put(style), put(YAML::BeginMap); }
  YamlWriter& end_map() { return put(YAML::EndMap); }
  YamlWriter& begin_list(YAML::EMITTER_MANIP style) { return put(style), put(YAML::BeginSeq); }
  YamlWriter& end_list() { return put(YAML::EndSeq); }
  YamlWriter& key(const std::string& name) { return put(YAML::Key), put(name), put(YAML::Value); }
  YamlWriter& word(const std::string& name, const std::string& value) { return key(name), put(value); }
  YamlWriter& number(const std::string& name, double value) { return key(name), put(exact(value)); }

  /// Where the value is the one that an absent key means, the key is left out.
  YamlWriter& optional(const std::string& name, double value, double absent) {
    return value == absent ? *this : number(name, value);
  }

  template <typename Range>
  YamlWriter& numbers(const std::string& name, const Range& values) {
    key(name).begin_list(YAML::Flow);
    for (const double value : values) put(exact(value));
    return end_list();
  }

  YamlWriter& words(const std::vector<std::string>& values) {
    begin_list(YAML::Block);
    for (const std::string& value : values) put(value);
    return end_list();
  }

 private:
  YAML::Emitter out_;

  template <typename Value>
  YamlWriter& put(const Value& value) {
    out_ << value;
    return *this;
  }
};

}  // namespace llmt::robotics
