// Messages of exceptions, for tests that pin what a message says.
#pragma once

#include <stdexcept>
#include <string>

namespace oracle {

/// The message of the exception of type `Exception` that a call throws; other exceptions pass through.
template <class Exception = std::invalid_argument, class Call>
std::string thrown(const Call& call) {
  try {
    call();
  } catch (const Exception& error) {
    return error.what();
  }
  return "nothing was thrown";
}

}  // namespace oracle
