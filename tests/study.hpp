/// Some tests repeat themselves over seeds, arms, options or rows. The gate takes a small sample of these; with
/// LLMT_STUDIES in the environment (`ctest --preset studies`) the tests take all of them.
#pragma once

#include <cstdlib>

/// `all` in a study, `few` in the gate.
template <class T>
T sampled(T all, T few) {
  return std::getenv("LLMT_STUDIES") != nullptr ? all : few;
}
