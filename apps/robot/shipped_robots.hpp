/// \file
/// Robot descriptions that the program carries with it, so that `llmt-robot paper` and `demo` need no
/// file.
#pragma once

namespace llmt::apps {

extern const char* const planar_two_link_yaml;
extern const char* const tx200_like_yaml;
extern const char* const sample_arm_yaml;       ///< docs/samples/arm.yaml
extern const char* const sample_real_arm_yaml;  ///< docs/samples/arm_true.yaml

}  // namespace llmt::apps
