// The programs under test, and the sample arm of the documentation.
#pragma once

#include <string>

#include "apps/program.hpp"

namespace program {

inline const std::string llmt_program = LLMT_PROGRAM;
#ifdef LLMT_ROBOT_PROGRAM
/// JSON of llmt-robot without the member that names files and options.
inline std::string without_record(const std::string& json) {
  const std::size_t begin = json.find("\n  \"made_from\": {");
  if (begin == std::string::npos) return json;
  return json.substr(0, begin) + json.substr(json.find("\n  }", begin) + 4);
}

inline const std::string robot_program = LLMT_ROBOT_PROGRAM;
inline const std::string sample_arm = LLMT_ROOT "/docs/samples/arm.yaml";
inline const std::string sample_measured = LLMT_ROOT "/docs/samples/arm_measured.csv";
#endif

}  // namespace program
