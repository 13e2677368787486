#include "llmt/robotics/mechanism/mechanism_file.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <stdexcept>

#include "llmt/files.hpp"
#include "llmt/limits.hpp"
#include "yaml/yaml_reader.hpp"
#include "yaml/yaml_writer.hpp"

namespace llmt::robotics {
namespace {

// "value_mm": a quantity with its unit; "value" alone has the unit 1.
std::string key_of(const std::string& quantity, const std::string& unit) {
  return unit == "1" ? quantity : quantity + "_" + unit;
}

// The unit of the quantity that every entry has: its only key among "start_mm", "start_deg" and "start".
std::string unit_of(const YamlMap& map, const std::string& quantity) {
  std::string found;
  for (const char* unit : {"mm", "deg", "1"}) {
    if (!map.has(key_of(quantity, unit))) continue;
    if (!found.empty()) map.refuse(fmt::format("\"{}\" is there in two units", quantity));
    found = unit;
  }
  if (found.empty()) {
    map.refuse(fmt::format("one of the keys {0}_mm, {0}_deg and {0} (without a unit) is missing", quantity));
  }
  return found;
}

void finish(const YamlMap& map, const std::string& unit, std::vector<std::string> quantities,
            std::vector<std::string> known = {"name"}) {
  for (const std::string& quantity : quantities) known.push_back(key_of(quantity, unit));
  map.finish(known);
}

MechanismParameter read_parameter(YamlMap& map) {
  MechanismParameter parameter;
  parameter.name = map.text("name");
  parameter.unit = unit_of(map, "value");
  const auto key = [&](const char* quantity) { return key_of(quantity, parameter.unit); };
  parameter.value = map.number(key("value"));
  if (map.has("fixed")) {
    const std::string fixed = map.text("fixed");
    if (fixed != "true" && fixed != "false")
      map.refuse("fixed", "\"fixed\" must be true or false, is \"" + fixed + "\"");
    parameter.fixed = fixed == "true";
  }
  if (map.has(key("prior"))) parameter.prior_sigma = map.number(key("prior"));
  if (map.has(key("standard_error"))) parameter.standard_error = map.number(key("standard_error"));
  finish(map, parameter.unit, {"value", "prior", "standard_error"}, {"name", "fixed"});
  return parameter;
}

Coordinate read_coordinate(YamlMap& map, bool is_output) {
  Coordinate coordinate;
  coordinate.name = map.text("name");
  coordinate.unit = unit_of(map, "start");
  coordinate.output = is_output;
  const auto key = [&](const char* quantity) { return key_of(quantity, coordinate.unit); };
  coordinate.start = map.number(key("start"));
  if (map.has(key("sigma"))) coordinate.sigma = map.number(key("sigma"));
  if (map.has(key("limits"))) {
    const std::vector<double> limits = map.numbers(key("limits"), 2);
    coordinate.lower = limits[0];
    coordinate.upper = limits[1];
  }
  finish(map, coordinate.unit, {"start", "sigma", "limits"});
  return coordinate;
}

Mechanism read_document(YamlMap& map) {
  Mechanism mechanism;
  mechanism.name = map.text("mechanism");
  if (map.has("parameters")) {
    for (YamlMap& entry : map.maps("parameters", most(Limit::mechanism_parameters)))
      mechanism.parameters.push_back(read_parameter(entry));
  }
  for (const char* kind : {"joints", "outputs"}) {
    if (!map.has(kind)) continue;
    for (YamlMap& entry : map.maps(kind, most(Limit::mechanism_coordinates))) {
      mechanism.coordinates.push_back(read_coordinate(entry, std::string(kind) == "outputs"));
    }
  }
  if (map.has("definitions")) {
    YamlMap definitions = map.map("definitions");
    const std::vector<std::string> names = definitions.keys();
    if (std::ssize(names) > most(Limit::mechanism_parameters)) {
      map.refuse("definitions", fmt::format("there are {} definitions, at most {} are possible", names.size(),
                                            most(Limit::mechanism_parameters)));
    }
    for (const std::string& name : names) {
      mechanism.definitions.push_back({.name = name, .text = definitions.text(name)});
    }
  }
  mechanism.equations = map.texts("equations", most(Limit::mechanism_equations));
  map.finish({"mechanism", "parameters", "joints", "outputs", "definitions", "equations"});
  return mechanism;
}

void write_parameter(YamlWriter& out, const MechanismParameter& parameter) {
  const auto key = [&](const char* quantity) { return key_of(quantity, parameter.unit); };
  out.begin_map().word("name", parameter.name).number(key("value"), parameter.value);
  if (parameter.fixed) out.word("fixed", "true");
  if (parameter.prior_sigma) out.number(key("prior"), *parameter.prior_sigma);
  if (parameter.standard_error) out.number(key("standard_error"), *parameter.standard_error);
  out.end_map();
}

void write_coordinates(YamlWriter& out, const Mechanism& mechanism, bool outputs) {
  const auto is_of_kind = [outputs](const Coordinate& coordinate) { return coordinate.output == outputs; };
  if (std::ranges::none_of(mechanism.coordinates, is_of_kind)) return;
  out.key(outputs ? "outputs" : "joints").begin_list(YAML::Block);
  for (const Coordinate& coordinate : mechanism.coordinates) {
    if (!is_of_kind(coordinate)) continue;
    const auto key = [&](const char* quantity) { return key_of(quantity, coordinate.unit); };
    out.begin_map().word("name", coordinate.name).number(key("start"), coordinate.start);
    if (coordinate.has_limits()) out.numbers(key("limits"), std::vector{coordinate.lower, coordinate.upper});
    if (coordinate.sigma) out.number(key("sigma"), *coordinate.sigma);
    out.end_map();
  }
  out.end_list();
}

}  // namespace

Mechanism read_mechanism(const std::string& path) { return parse_mechanism(read_file(path, description_limit), path); }

Mechanism parse_mechanism(const std::string& text, const std::string& name) {
  YamlMap map(parse_yaml(text, name), name, "");
  if (!map.has("mechanism")) map.refuse("key \"mechanism\" is missing: this is no mechanism");
  Mechanism mechanism = read_document(map);
  try {
    validate(mechanism);
  } catch (const std::invalid_argument& error) {
    throw std::runtime_error(name + ": " + error.what());
  }
  return mechanism;
}

std::string to_yaml(const Mechanism& mechanism) {
  validate(mechanism);
  YamlWriter out;
  out.begin_map(YAML::Block).word("mechanism", mechanism.name);
  out.key("parameters").begin_list(YAML::Block);
  for (const MechanismParameter& parameter : mechanism.parameters) write_parameter(out, parameter);
  out.end_list();
  write_coordinates(out, mechanism, false);
  write_coordinates(out, mechanism, true);
  if (!mechanism.definitions.empty()) {
    out.key("definitions").begin_map(YAML::Block);
    for (const Definition& definition : mechanism.definitions) out.word(definition.name, definition.text);
    out.end_map();
  }
  out.key("equations").words(mechanism.equations);
  out.end_map();
  return out.finish();
}

void save(const Mechanism& mechanism, const std::string& path) { write_file(path, to_yaml(mechanism)); }

}  // namespace llmt::robotics
