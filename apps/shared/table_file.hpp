/// \file
/// Tables that the programs are given: files, or standard input.
#pragma once

#include <string>

#include "llmt/csv.hpp"

namespace llmt::apps {

/// The name of a table in messages: its path, or "standard input" for a dash.
std::string table_name(const std::string& path);

/// A table from a file, or from standard input if `path` is a dash. Warns of a header that holds only numbers. Throws
/// as Csv::read(), and for a JSON file. `thousands`: numbers may have separators of thousands.
Csv read_table(const std::string& path, DecimalMark mark, bool thousands = false);

/// Whether the file begins as a JSON object does. False for what is no regular file.
bool is_json_file(const std::string& path);

}  // namespace llmt::apps
