/// \file
/// What a robot's task has to say, for Python.
#pragma once

#include <nanobind/nanobind.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/vector.h>

#include <algorithm>
#include <optional>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "llmt/finding.hpp"
#include "report/robot/input_checks.hpp"
#include "report/text/json.hpp"

namespace llmt::python {

namespace nb = nanobind;

/// How Python names arguments and, of a table in memory, rows.
inline Face python_face(const std::optional<std::string>& text) {
  return {.before_option = "", .between_words = '_', .switched_on = "=True", .in_memory = text.has_value()};
}

/// The result of a task: `json`, `text`, `warnings` and more.
class Outcome {
 public:
  explicit Outcome(Face face = python_face({})) : face_(std::move(face)) {}

  report::Warn warn() {
    return [this](const Finding& finding) { warnings_.push_back(finding.words(face_)); };
  }

  const Face& face() const { return face_; }
  const std::vector<std::string>& warnings() const { return warnings_; }

  nb::dict dict(const std::string& text, const report::Json& json) const {
    nb::dict result;
    result["text"] = text;
    result["json"] = json.dump(-1, ' ', false, report::Json::error_handler_t::replace);
    result["warnings"] = warnings_;
    return result;
  }

 private:
  Face face_;
  std::vector<std::string> warnings_;
};

/// A refusal, and what looks wrong, each on a line of its own.
inline std::runtime_error refused(std::string refusal, const std::vector<std::string>& notes) {
  for (const std::string& note : notes) refusal += "\n- " + note;
  return std::runtime_error(refusal);
}

}  // namespace llmt::python
