// Checks of a description that its readers share.
#pragma once

#include <cstddef>
#include <stdexcept>
#include <string>

namespace llmt::robotics {

/// A field that holds what it may not. `field` is the key under which description files have it, so that a reader can
/// name its line.
class FieldError : public std::invalid_argument {
 public:
  FieldError(std::string key, const std::string& message) : std::invalid_argument(message), field(std::move(key)) {}

  std::string field;
};

}  // namespace llmt::robotics
