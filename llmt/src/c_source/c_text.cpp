#include "c_source/c_text.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <cmath>
#include <stdexcept>
#include <string_view>

namespace llmt {
namespace {

// Whether a text begins with a mark of direction or a line separator of Unicode: U+061C, U+200E, U+200F, U+2028 to
// U+202E, U+2066 to U+2069.
bool begins_with_mark(std::string_view text) {
  const auto lies = [&](const char* first, const char* last) { return text >= first && text.substr(0, 3) <= last; };
  return text.starts_with("\xD8\x9C") || lies("\xE2\x80\x8E", "\xE2\x80\x8F") || lies("\xE2\x80\xA8", "\xE2\x80\xAE") ||
         lies("\xE2\x81\xA6", "\xE2\x81\xA9");
}

}  // namespace

std::string c_comment(const std::string& text) {
  std::string safe;
  for (std::size_t i = 0; i < text.size(); ++i) {
    const char letter = text[i];
    const bool plain = static_cast<unsigned char>(letter) >= 32 && letter != 127 && letter != '/' && letter != '*' &&
                       letter != '\\' && letter != '?' && !begins_with_mark(std::string_view(text).substr(i));
    safe += plain ? letter : '_';
    if (!plain && static_cast<unsigned char>(letter) >= 0x80) i += letter == '\xE2' ? 2 : 1;
  }
  return safe;
}

std::string Tables::number(double value) {
  if (std::isinf(value)) return value > 0.0 ? "HUGE_VAL" : "-HUGE_VAL";
  std::string text = fmt::format("{}", value);
  if (text.find_first_of(".e") == std::string::npos) text += ".0";
  return text;
}

std::string Tables::add(const std::string& what, const char* type, const std::vector<std::string>& entries) {
  if (entries.empty()) return "0";
  const std::string table = fmt::format("{}_{}", name_, what);
  text_ += fmt::format("\nstatic const {} {}[] = {{", type, table);
  std::size_t column = 120;
  for (const std::string& entry : entries) {
    if (column + entry.size() + 2 > 110) {
      text_ += "\n    ";
      column = 4;
    }
    text_ += entry + ", ";
    column += entry.size() + 2;
  }
  text_ += "\n};\n";
  return table;
}

std::string Tables::add(const std::string& what, const std::vector<double>& values) {
  std::vector<std::string> entries;
  for (const double value : values) entries.push_back(number(value));
  return add(what, "double", entries);
}

std::string Tables::add(const std::string& what, const std::vector<int>& values) {
  std::vector<std::string> entries;
  for (const int value : values) entries.push_back(std::to_string(value));
  return add(what, "int", entries);
}

std::string with_name(std::string text, const std::string& name) {
  for (std::size_t at = text.find('@'); at != std::string::npos; at = text.find('@', at + name.size())) {
    text.replace(at, 1, name);
  }
  return text;
}

std::string head_comment(const std::string& kind, const std::vector<InputColumn>& inputs,
                         const std::vector<OutputColumn>& outputs, const std::string& name) {
  std::string text = fmt::format("/* {}, written by llmt. int {}_predict(inputs, outputs)\n", kind, name);
  for (std::size_t j = 0; j < inputs.size(); ++j) {
    const InputColumn& input = inputs[j];
    text += fmt::format("   inputs[{}]: {}", j, c_comment(input.name));
    for (std::size_t level = 0; level < input.levels.size(); ++level) {
      const bool is_empty = input.levels[level].empty() && level + 1 == input.levels.size();
      text += fmt::format("{} {} = {}", level == 0 ? "," : ";",
                          is_empty              ? "NaN"
                          : input.codes.empty() ? std::to_string(level)
                                                : fmt::format("{}", input.codes[level]),
                          is_empty ? "no value" : c_comment(input.levels[level]));
    }
    text += "\n";
  }
  for (std::size_t o = 0; o < outputs.size(); ++o) {
    text += fmt::format("   outputs[{}]: {}\n", o, c_comment(outputs[o].name));
  }
  return text + "   A missing input is NaN. */\n";
}

CSource c_source_of(const std::string& comment, const std::string& name, const std::string& header_name,
                    const std::string& declarations, const Tables& tables, const std::string& functions) {
  CSource result;
  result.header = comment + with_name(
                                "#ifndef @_MODEL_H\n#define @_MODEL_H\n\n"
                                "/* 0, or 1 without touching the outputs if an input is infinite. */\n"
                                "int @_predict(const double *inputs, double *outputs);\n\n#endif\n",
                                name);
  result.source = comment + fmt::format("#include \"{}\"\n\n#include <math.h>\n\n", header_name) +
                  with_name(declarations, name) + tables.text() + with_name(functions, name);
  return result;
}

bool is_c_identifier(std::string_view text) {
  const auto is_letter = [](char c) { return std::isalpha(static_cast<unsigned char>(c)) != 0; };
  return !text.empty() && text.size() <= 31 && is_letter(text[0]) &&
         std::ranges::all_of(text, [&](char c) { return is_letter(c) || (c >= '0' && c <= '9') || c == '_'; }) &&
         !is_c_word(text);
}

void check_c_name(const std::string& name) {
  if (is_c_identifier(name)) return;
  throw std::invalid_argument(
      fmt::format("llmt::to_c: name is \"{}\", must be an identifier of C of at most 31 characters", name));
}

}  // namespace llmt
