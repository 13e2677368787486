/// \file
/// Terms that a user writes down as expressions.
#pragma once

#include <string>
#include <vector>

#include "llmt/discovery/terms.hpp"

namespace llmt::apps {

/// Reads a file of lines `name = expression`; `#` starts a comment. Expressions (see Expression) are of the inputs'
/// names (where they are words of letters, digits and _), of `output` for the simulated output if that is not empty,
/// and of pi.
///
/// Throws std::runtime_error `path:line: ...` for a line without =, a name that is not a word, is there twice or is one
/// of `taken`, an expression that cannot be parsed or names something else, and one that is not finite at a row of
/// `rows`.
std::vector<discovery::ModelTerm> read_terms(const std::string& path, const discovery::Inputs& inputs,
                                             const std::string& output, const discovery::Rows& rows,
                                             const std::vector<std::string>& taken);

/// As read_terms(), from memory; `file` stands for the path in messages.
std::vector<discovery::ModelTerm> parse_terms(const std::string& text, const std::string& file,
                                              const discovery::Inputs& inputs, const std::string& output,
                                              const discovery::Rows& rows, const std::vector<std::string>& taken);

}  // namespace llmt::apps
