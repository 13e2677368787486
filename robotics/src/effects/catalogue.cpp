#include "llmt/robotics/catalogue.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <stdexcept>

#include "effects/effect_entries.hpp"
#include "effects/formula_term.hpp"
#include "llmt/files.hpp"
#include "yaml/yaml_reader.hpp"

namespace llmt::robotics {
namespace {

constexpr std::size_t most_entries = 1000;
constexpr std::size_t most_terms = 100;  // of one effect

void read_sizes(YamlMap& map, double& scale, double& lower, double& upper) {
  scale = map.number_or("scale", scale);
  lower = map.number_or("lower", lower);
  upper = map.number_or("upper", upper);
  if (!(scale > 0.0)) map.refuse("scale", fmt::format("\"scale\" is {}, must be > 0", scale));
  if (!(lower <= upper))
    map.refuse("lower", fmt::format("\"lower\" is {}, must not be above \"upper\", {}", lower, upper));
}

bool read_yes_or_no(YamlMap& map, const std::string& key, bool otherwise) {
  const std::string text = map.text_or(key, otherwise ? "true" : "false");
  if (text == "true") return true;
  if (text == "false") return false;
  map.refuse(key, fmt::format("\"{}\" is \"{}\", must be true or false", key, text));
}

void read_words(YamlMap& map, EffectType& type) {
  type.title = map.text_or("title", type.title);
  type.note = map.text_or("note", type.note);
  type.searched = read_yes_or_no(map, "search", type.searched);
}

void change_type(YamlMap map, std::vector<EffectType>& types) {
  const std::string name = map.text("type");
  const auto type = std::ranges::find(types, name, &EffectType::name);
  if (type == types.end()) {
    std::vector<std::string> known;
    for (const EffectType& other : types) known.push_back(other.name);
    map.refuse("type", fmt::format("\"type\" is \"{}\", which is no effect; known: {}", name, fmt::join(known, ", ")));
  }
  read_words(map, *type);
  if (map.has("parameters")) {
    YamlMap parameters = map.map("parameters");
    std::vector<std::string> known;
    for (EffectParameter& parameter : type->parameters) {
      known.push_back(parameter.name);
      if (!parameters.has(parameter.name)) continue;
      YamlMap sizes = parameters.map(parameter.name);
      read_sizes(sizes, parameter.scale, parameter.lower, parameter.upper);
      sizes.finish({"scale", "lower", "upper"});
    }
    parameters.finish(known);
  }
  map.finish({"type", "title", "search", "note", "parameters"});
}

EffectPlace read_place(YamlMap& map) {
  const std::string place = map.text("place");
  if (place == "joint") return EffectPlace::joint;
  if (place == "robot") return EffectPlace::robot;
  map.refuse("place", fmt::format("\"place\" is \"{}\", must be joint or robot", place));
}

void read_own_term(YamlMap map, EffectType& type) {
  FormulaTerm term = read_formula_term(map);
  EffectParameter parameter{.name = term.name, .unit = term.unit};
  if (parameter.name.empty()) parameter.name = fmt::format("coefficient_{}", type.terms.size() + 1);
  if (parameter.unit.empty()) parameter.unit = term.acts_on == "joint" ? "rad" : "mm";
  parameter.lower = map.number("lower");
  parameter.upper = map.number("upper");
  parameter.scale = scale_of(term, false);
  read_sizes(map, parameter.scale, parameter.lower, parameter.upper);
  map.finish({"name", "joint", "x", "y", "z", "unit", "scale", "lower", "upper"});
  type.terms.push_back(std::move(term));
  type.parameters.push_back(std::move(parameter));
}

// Of an arm with more joints than any: mistakes in the expressions show here, those in joint numbers at the robot.
Chain longest_arm() {
  Chain any;
  for (int j = 1; j <= 99; ++j) any.joints.emplace_back().name = fmt::format("joint{}", j);
  return any;
}

void read_own_terms(YamlMap& map, EffectType& type) {
  const Chain any = longest_arm();
  const Effect effect{.type = "formula", .at = type.place == EffectPlace::joint ? "joint99" : "", .values = {}};
  for (const YamlMap& entry : map.maps("terms", most_terms)) {
    read_own_term(entry, type);
    FormulaTerm term = type.terms.back();
    term.text = with_joint_number(term.text, 98);
    const std::string reason = term_refusal(any, effect, term);
    if (!reason.empty()) entry.refuse(term.acts_on, reason);
  }
  Effect whole = effect;
  whole.formula = {type.name, type.terms};
  for (FormulaTerm& term : whole.formula.terms) term.text = with_joint_number(term.text, 98);
  const std::string reason = formula_refusal(any, whole);
  if (!reason.empty()) map.refuse(reason);
}

// Columns of an effect at any joint: a number that stands for "{}" in the text stands for it in the names as well.
std::vector<std::string> own_columns(const EffectType& type) {
  constexpr std::size_t placeholder = 98;
  std::vector<FormulaTerm> terms = type.terms;
  for (FormulaTerm& term : terms) term.text = with_joint_number(term.text, placeholder);
  std::vector<std::string> columns = formula_columns(terms);
  for (std::string& column : columns) {
    const std::size_t at = column.find(std::to_string(placeholder + 1));
    if (at != std::string::npos) column.replace(at, 2, "{}");
  }
  return columns;
}

EffectType read_own(YamlMap map, const std::vector<EffectType>& types) {
  EffectType type{.name = map.text("formula")};
  if (std::ranges::find(types, type.name, &EffectType::name) != types.end()) {
    map.refuse("formula", fmt::format("\"formula\" is \"{}\", which is the name of another effect", type.name));
  }
  type.family = type.name;
  type.title = type.name;
  type.source = "the user";
  read_words(map, type);
  type.place = read_place(map);
  read_own_terms(map, type);
  for (const FormulaTerm& term : type.terms) {
    type.formula += fmt::format("{}{}: {}", type.formula.empty() ? "" : ", ", term.acts_on, term.text);
  }
  map.finish({"formula", "title", "search", "note", "place", "terms"});
  type.columns = own_columns(type);
  return type;
}

std::vector<EffectType> read_entries(const std::string& text, const std::string& name, std::vector<EffectType> types) {
  YamlMap map(parse_yaml(text, name), name, "");
  for (const YamlMap& entry : map.maps("effects", most_entries)) {
    if (entry.has("formula")) {
      types.push_back(read_own(entry, types));
    } else {
      change_type(entry, types);
    }
  }
  map.finish({"effects"});
  return types;
}

}  // namespace

const std::vector<EffectType>& effect_types() {
  static const std::vector<EffectType> types = [] {
    std::vector<EffectType> all = elastic_effects();
    for (EffectType& type : joint_effects()) all.push_back(std::move(type));
    for (EffectType& type : whole_arm_effects()) all.push_back(std::move(type));
    for (EffectType& type : instrument_effects()) all.push_back(std::move(type));
    all.push_back(formula_effect());
    return read_entries(default_catalogue_yaml, "catalogue.yaml", std::move(all));
  }();
  return types;
}

std::vector<EffectType> parse_catalogue(const std::string& text, const std::string& name) {
  return read_entries(text, name, effect_types());
}

std::vector<EffectType> read_catalogue(const std::string& path) {
  return parse_catalogue(read_file(path, description_limit), path);
}

}  // namespace llmt::robotics
