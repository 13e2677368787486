// Changes to a valid description, made by the bytes of an input: most still pass the parser, and meet the checks behind
// it.
#pragma once

#include <iterator>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "fuzz/fuzz.hpp"

namespace fuzz {

using Json = nlohmann::ordered_json;

/// All values in `json`, `json` itself first.
inline void collect(Json& json, std::vector<Json*>& all) {
  all.push_back(&json);
  if (!json.is_structured()) return;
  for (Json& value : json) collect(value, all);
}

inline void change_number(Json& json, Bytes& bytes) {
  if (json.is_number_integer() && bytes.byte() % 8 != 0) {
    json = json.get<std::int64_t>() + bytes.below(5) - 2;
  } else {
    switch (bytes.below(4)) {
      case 0:
        json = json.get<double>() * bytes.ordinary();
        break;
      case 1:
        json = json.get<double>() + bytes.ordinary();
        break;
      case 2:
        json = bytes.number();
        break;
      default:
        json = static_cast<std::int64_t>(bytes.number() / 1e290);
    }
  }
}

inline void change_structure(Json& json, const Json& other, Bytes& bytes) {
  const std::size_t at = json.empty() ? 0 : bytes.below(256) % json.size();
  switch (bytes.below(4)) {
    case 0:
      if (!json.empty()) json.erase(std::next(json.begin(), static_cast<std::ptrdiff_t>(at)));
      break;
    case 1:
      if (json.is_array() && !json.empty()) json.push_back(Json(json[at]));
      break;
    case 2:
      if (json.is_array()) json.push_back(other);
      if (json.is_object()) json[bytes.coin() ? "level_side" : "scale"] = other;
      break;
    default:
      json = other;
  }
}

/// Changes a few values of `json`: numbers mostly, sometimes words and structure.
inline void mutate(Json& json, Bytes& bytes, const std::vector<std::string>& words) {
  const int changes = 1 + bytes.below(4);
  for (int k = 0; k < changes && !bytes.empty(); ++k) {
    std::vector<Json*> all;
    collect(json, all);
    Json& chosen = *all[bytes.below(65536) % all.size()];
    const Json other = *all[bytes.below(65536) % all.size()];
    const int kind = bytes.below(16);
    if (kind == 0) {
      chosen = bytes.one_of(words);
    } else if (kind == 1) {
      chosen = other;
    } else if (chosen.is_structured()) {
      change_structure(chosen, other, bytes);
    } else if (chosen.is_number()) {
      change_number(chosen, bytes);
    } else if (chosen.is_string()) {
      chosen = bytes.coin() ? bytes.one_of(words) : chosen.get<std::string>() + bytes.one_of(words);
    } else {
      chosen = bytes.number();
    }
  }
}

}  // namespace fuzz
