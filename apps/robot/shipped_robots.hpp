/// \file
/// Robot descriptions that the program carries with it, so that `llmt-robot paper` needs no file.
#pragma once

namespace llmt::apps {

extern const char* const planar_two_link_yaml;
extern const char* const tx200_like_yaml;

}  // namespace llmt::apps
