// Catalogues of effects: what is read makes effects that can be added to a robot. Inputs that begin with a control
// character change a valid catalogue; others are YAML as they stand.
#include <stdexcept>

#include "fuzz/json_mutator.hpp"
#include "llmt/robotics/catalogue.hpp"
#include "llmt/robotics/robot.hpp"

namespace fuzz_catalogue {
namespace {

using namespace llmt::robotics;

const std::vector<std::string> words = {"",      "joint_gain", "joint_map", "formula", "true", "false", "joint",
                                        "robot", "x",          "q{}",       "{}",      "q99",  "1/q{}", "q{} = 1"};

fuzz::Json catalogue() {
  return fuzz::Json::parse(R"json({"effects": [
    {"type": "wrist_coupling", "search": false},
    {"type": "joint_compliance", "note": "data sheet",
     "parameters": {"compliance": {"scale": 2e-7, "lower": 0, "upper": 1}}},
    {"formula": "belt_pitch", "title": "belt", "place": "joint", "note": "maker",
     "terms": [{"name": "cosine", "joint": "cos(37 * q{})", "unit": "rad", "scale": 1e-4, "lower": -1, "upper": 1},
               {"name": "load", "joint": "tau{} * temp_C", "lower": -1e-5, "upper": 1e-5}]
},
    {"formula": "roof", "place": "robot", "terms": [{"z": "q1 * payload_kg", "scale": 1, "lower": -1, "upper": 1}]}]
})json");
}

Chain arm() {
  Chain chain;
  chain.name = "arm";
  for (int j = 1; j <= 3; ++j) {
    Joint& joint = chain.joints.emplace_back();
    joint.name = fmt::format("joint{}", j);
    joint.a_mm = 100.0 * j;
    joint.type = j == 3 ? JointType::prismatic : JointType::revolute;
  }
  return chain;
}

}  // namespace

FUZZ_TARGET(catalogue) {
  std::string text = fuzz::text_of(data, size);
  if (size > 0 && data[0] < ' ') {
    fuzz::Bytes bytes(data + 1, size - 1);
    static const fuzz::Json valid = catalogue();
    fuzz::Json json = valid;
    fuzz::mutate(json, bytes, words);
    text = json.dump(-1, ' ', false, fuzz::Json::error_handler_t::replace);
  }
  try {
    const std::vector<EffectType> types = parse_catalogue(text, "c");
    const Chain chain = arm();
    for (std::size_t k = effect_types().size(); k < types.size(); ++k) {
      for (const EffectParameter& parameter : types[k].parameters) {
        fuzz::require(parameter.scale > 0.0 && parameter.lower <= parameter.upper, "sizes are in order");
      }
      try {
        const Effect effect = make_effect(types[k], chain, 1);
        fuzz::require(effect.values.size() == types[k].terms.size(), "each term has a value");
        effect_columns(chain, effect);
      } catch (const std::invalid_argument&) {
        // An expression may name a joint that this robot does not have.
      }
    }
  } catch (const std::runtime_error& error) {
    fuzz::require(std::string(error.what()).starts_with("c:"), fmt::format("'{}' names the file", error.what()));
  }
  return 0;
}

}  // namespace fuzz_catalogue
