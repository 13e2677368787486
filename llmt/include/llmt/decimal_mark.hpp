/// \file
/// The decimal mark of the numbers in a table.
#pragma once

namespace llmt {

/// The character between the whole and the fraction of a number.
enum class DecimalMark : char { point = '.', comma = ',' };

}  // namespace llmt
