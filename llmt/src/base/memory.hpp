/// \file
/// How much memory the machine has.
#pragma once

#include <unistd.h>

#include <algorithm>
#include <cstdint>

namespace llmt {

/// Physical memory of the machine, in bytes.
inline std::uintmax_t machine_memory() {
  const auto pages = static_cast<std::uintmax_t>(std::max(::sysconf(_SC_PHYS_PAGES), 1L));
  return pages * static_cast<std::uintmax_t>(::sysconf(_SC_PAGESIZE));
}

}  // namespace llmt
