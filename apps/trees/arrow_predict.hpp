/// \file
/// `llmt predict` of a table in Arrow files, or in several files, which need not fit into memory.
#pragma once

#include <string>
#include <vector>

#include "llmt/csv.hpp"

namespace llmt::apps {

struct PredictArguments {
  std::string model;
  std::string data;
  std::vector<std::string> more;  ///< files behind `data`
  std::string output;
  bool json = false;
  double interval = 0.0;          ///< level; 0: none
  std::vector<double> quantiles;  ///< probabilities
  std::string weight;             ///< column; empty: none
  DecimalMark mark = DecimalMark::point;
  bool thousands = false;
  int threads = 0;
};

/// Appends the shortest text that reads back as the same number.
void append_number(std::string& text, DecimalMark mark, double value);

/// Reads rows piece by piece and writes their predictions; the table's own columns are not repeated.
void predict_files(const PredictArguments& arguments);

}  // namespace llmt::apps
