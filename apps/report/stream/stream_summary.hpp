/// \file
/// What a stream learned, as text and as JSON.
#pragma once

#include <string>
#include <vector>

#include "llmt/model.hpp"
#include "llmt/stream.hpp"
#include "report/text/json.hpp"
#include "report/text/text.hpp"

namespace llmt::report {

/// A stream at the end of its rows.
struct StreamRun {
  std::string data;  ///< the name of the table
  std::vector<std::string> inputs;
  std::vector<std::string> targets;
  const Stream& stream;
  const Model& model;  ///< its snapshot
  std::string output;  ///< the file of the model; empty: none
};

/// Rows, splits, changes, and the errors of every output.
Json stream_json(const StreamRun& run);

/// The same for people. `width`: of tables.
std::string stream_text(const StreamRun& run, std::size_t width = no_width_limit);

}  // namespace llmt::report
