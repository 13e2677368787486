/// \file
/// Whether a model is still good on new rows, as a document and as JSON.
#pragma once

#include <Eigen/Core>
#include <string>
#include <vector>

#include "llmt/check.hpp"
#include "report/document/document.hpp"
#include "report/table/columns.hpp"
#include "report/text/json.hpp"

namespace llmt::report {

struct TableCheckFacts {
  std::string model;  ///< its name
  std::string data;   ///< that of the new rows
  TableCheck check;
  std::vector<InputColumn> inputs;  ///< of the model
  const Model* tree = nullptr;      ///< null: a sum of trees
  std::vector<UnknownWords> words;  ///< one an input; empty for numbers and codes
  double level = 0.05;              ///< CheckOptions::level
  bool has_limits = false;          ///< whether CheckOptions::limits were stated
};

/// The verdict and the error of every target in one sentence each; what changed, in tables; the picture of the errors.
Document check_document(const TableCheckFacts& facts);

/// The same with all digits.
Json check_json(const TableCheckFacts& facts);

/// Why a model is no longer good, in a sentence; empty if it is, or if that is not known.
std::string check_refusal(const TableCheckFacts& facts);

}  // namespace llmt::report
