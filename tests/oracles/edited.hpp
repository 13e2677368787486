// Texts that differ in one place.
#pragma once

#include <gtest/gtest.h>

#include <string>

namespace oracle {

/// The text with the first `part` in it replaced; the test fails where there is none.
inline std::string replaced(std::string text, const std::string& part, const std::string& by) {
  const std::size_t at = text.find(part);
  EXPECT_NE(at, std::string::npos) << part;
  return at == std::string::npos ? text : text.replace(at, part.size(), by);
}

}  // namespace oracle
