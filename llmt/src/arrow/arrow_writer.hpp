/// \file
/// Rows as an Arrow file without a name.
#pragma once

#include <string>
#include <vector>

#include "arrow/table_bytes.hpp"
#include "llmt/arrow.hpp"

namespace llmt {

/// The file of ArrowTable::hold().
TableBytes held_rows(const std::string& name, const std::vector<std::string>& columns, const NextRows& next);

}  // namespace llmt
