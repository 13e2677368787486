/// \file
/// Inputs that a table has by accident: what `llmt` says of them, and which it leaves out.
#pragma once

#include <string>
#include <vector>

#include "report/table/columns.hpp"
#include "shared/table_files.hpp"
#include "trees/learning.hpp"

namespace llmt::apps {

/// Says which columns are inputs although they look like names or numbers of the rows, or as if some of their numbers
/// were none, and takes away what is left out: dates of many days, and words that differ in more than half of the rows.
/// One input stays at least. Nothing is said of inputs that were asked for, and none of these is left out; nor of
/// columns that stay with more than most_categories words, which the caller refuses. `names`: of the inputs.
void leave_out_accidental(const LearningArguments& arguments, std::vector<std::string>& names,
                          report::InputColumns& inputs);

/// The inputs without the dates and words that leave_out_accidental() leaves out, for files whose rows are not in
/// memory; says so. Reads all rows of columns of text, up to `most` different words of each; dates of more days are
/// left out.
std::vector<std::string> without_accidental_words(const LearningArguments& arguments, std::vector<std::string> names,
                                                  const TableFiles& table, std::size_t most);

}  // namespace llmt::apps
