/// \file
/// What a call that is refused says.
#pragma once

#include <functional>
#include <stdexcept>
#include <string>

namespace oracle {

inline std::string message_of(const std::function<void()>& call) {
  try {
    call();
  } catch (const std::invalid_argument& error) {
    return error.what();
  }
  return "no std::invalid_argument";
}

}  // namespace oracle
