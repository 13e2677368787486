/// \file
/// Inputs that a caller names, and inputs that a table has by accident.
#pragma once

#include <string>
#include <vector>

#include "report/table/columns.hpp"

namespace llmt::report {

/// Positions of `names` among the inputs. Throws std::invalid_argument that begins with `option`, which is who names
/// them, for a name that is not there, with the name that was most likely meant.
std::vector<int> positions_of(const std::string& option, const std::vector<std::string>& names,
                              const std::vector<std::string>& inputs);

/// A number for each input: 1 if it is named, -1 if with a leading minus, 0 if not. Empty if none is. Throws as
/// positions_of(), and if an input is named with both signs.
std::vector<int> signs_of(const std::string& option, const std::vector<std::string>& names,
                          const std::vector<std::string>& inputs);

/// An input that looks as if nobody meant it to be one.
struct AccidentalInput {
  enum class Kind {
    words,       ///< different words in most rows, such as names of the rows
    dates,       ///< words that all look like dates
    unit,        ///< numbers that all have the same unit behind them
    row_numbers  ///< consecutive whole numbers from 0 or 1 on
  };
  Kind kind = Kind::words;
  int input = 0;
  std::string unit = {};
};

/// Such inputs: those of words first.
std::vector<AccidentalInput> accidental_inputs(const InputColumns& inputs);

}  // namespace llmt::report
