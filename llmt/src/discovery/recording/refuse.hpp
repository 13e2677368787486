/// \file
/// The exception for a caller's mistake.
#pragma once

#include <stdexcept>
#include <string>

namespace llmt::discovery {

/// Throws std::invalid_argument: "llmt::discovery::FUNCTION: MESSAGE".
[[noreturn]] inline void refuse(const char* function, const std::string& message) {
  throw std::invalid_argument(std::string("llmt::discovery::") + function + ": " + message);
}

}  // namespace llmt::discovery
