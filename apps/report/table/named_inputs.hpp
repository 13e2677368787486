/// \file
/// Inputs that a caller names, and inputs that a table has by accident.
#pragma once

#include <Eigen/Core>
#include <optional>
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

/// An input that looks as if nobody meant it to be one, or not as it is.
struct AccidentalInput {
  enum class Kind {
    words,        ///< different words in many rows, such as names of the rows
    dates,        ///< words that all look like dates
    unit,         ///< numbers that are all written with the same unit, or with marks that no number has
    row_numbers,  ///< different whole numbers that rise or fall from row to row, or follow each other in another order
    far_value     ///< numbers some of which are one and the same, far from all others, as -999 for a missing value
  };
  Kind kind = Kind::words;
  int input = 0;
  /// Of a unit what all cells are: `a number and "kg"`. Of a far value how often it is there, and where the others are:
  /// "9 of 60 cells are -999, far from all others (-2.1 to 3.4)".
  std::string detail = {};
  /// Whether a fit leaves the input out unless it was asked for: dates of many days, and words that differ in more than
  /// half of the rows. As categories they cost much, and say nothing of new rows.
  bool is_left_out = false;
};

/// `9 of 60 cells are -999, far from all others (-2.1 to 3.4)`, where at least 3 values, and a hundredth, are the
/// smallest or the largest one, and farther from the next than all others from each other; else empty. NaN is no value.
std::string far_value(const Eigen::Ref<const Eigen::VectorXd>& values);

/// What an input of words is in a table of `rows` rows; nothing where its words are usual categories. `levels`: its
/// different words. A date is as in `2024-03-31`, `31.3.24` or `3/31/2024 14:05`.
std::optional<AccidentalInput> accidental_words(const std::vector<std::string>& levels, Eigen::Index rows);

/// Whether all words are dates, and there are several.
bool are_dates(const std::vector<std::string>& levels);

/// Such inputs: those of words first.
std::vector<AccidentalInput> accidental_inputs(const InputColumns& inputs);

}  // namespace llmt::report
