// The programs under test, and the sample arm of the documentation.
#pragma once

#include <string>

#include "apps/program.hpp"

namespace program {

inline const std::string llmt_program = LLMT_PROGRAM;
#ifdef LLMT_ROBOT_PROGRAM
inline const std::string robot_program = LLMT_ROBOT_PROGRAM;
inline const std::string sample_arm = LLMT_ROOT "/docs/samples/arm.yaml";
inline const std::string sample_measured = LLMT_ROOT "/docs/samples/arm_measured.csv";
#endif

}  // namespace program
