/// \file
/// How a table writes the fraction of a number.
#pragma once

namespace llmt {

/// What stands between the whole and the fraction of a number.
enum class DecimalMark : char { point = '.', comma = ',' };

}  // namespace llmt
