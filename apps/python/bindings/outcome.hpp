/// \file
/// What a robot's task has to say, for Python.
#pragma once

#include <nanobind/nanobind.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/vector.h>

#include <stdexcept>
#include <string>
#include <string_view>
#include <vector>

#include "python/bindings/errors.hpp"
#include "report/robot/input_checks.hpp"
#include "report/text/json.hpp"

namespace llmt::python {

namespace nb = nanobind;

/// The result of a task: `json`, `text`, `warnings` and more.
class Outcome {
 public:
  report::Warn warn() {
    return [this](const std::string& sentence) {
      constexpr std::string_view mark = "WARNING: ";  // of a line on a terminal
      warnings_.push_back(in_words_of_python(sentence.substr(sentence.starts_with(mark) ? mark.size() : 0)));
    };
  }

  const std::vector<std::string>& warnings() const { return warnings_; }

  nb::dict dict(const std::string& text, const report::Json& json) const {
    nb::dict result;
    result["text"] = in_words_of_python(text);
    result["json"] = json.dump(-1, ' ', false, report::Json::error_handler_t::replace);
    result["warnings"] = warnings_;
    return result;
  }

 private:
  std::vector<std::string> warnings_;
};

/// A refusal, and what looks wrong, each on a line of its own.
inline std::runtime_error refused(std::string refusal, const std::vector<std::string>& notes) {
  for (const std::string& note : notes) refusal += "\n- " + note;
  return std::runtime_error(refusal);
}

}  // namespace llmt::python
