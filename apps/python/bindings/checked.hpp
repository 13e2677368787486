/// \file
/// Judging a model by new rows, of trees and of sums of trees.
#pragma once

#include <Eigen/Core>
#include <map>
#include <optional>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

#include "llmt/check.hpp"
#include "python/bindings/arrays.hpp"
#include "report/document/document_text.hpp"
#include "report/model/table_check.hpp"

namespace llmt::python {

/// What was asked for beside the rows.
struct CheckedRows {
  const Array& inputs;
  const Array& outputs;
  const std::vector<std::map<std::string, Eigen::Index>>& words;
  CheckOptions options;
};

/// The result as JSON, and as text. `checked`: what check() takes; `columns`: its inputs; `tree`: null of a sum.
template <class Checked>
std::tuple<std::string, std::string> check_rows(const Checked& checked, const std::vector<InputColumn>& columns,
                                                const Model* tree, const CheckedRows& rows) {
  report::TableCheckFacts facts{.model = "the model",
                                .data = "X",
                                .check = {},
                                .inputs = columns,
                                .tree = tree,
                                .words = {},
                                .level = rows.options.level,
                                .has_limits = !rows.options.limits.empty()};
  for (const auto& words : rows.words) facts.words.emplace_back(words.begin(), words.end());
  const Eigen::MatrixXd inputs = rows_of(rows.inputs);
  const Eigen::MatrixXd outputs = rows_of(rows.outputs);
  {
    const nb::gil_scoped_release unlocked;
    facts.check = check(checked, inputs, outputs, rows.options);
  }
  constexpr std::size_t width = 120;
  return {report::check_json(facts).dump(), report::document_text(report::check_document(facts), width)};
}

/// The options of a check.
inline CheckOptions check_options(double level, std::vector<double> limits, const std::optional<Vector>& weights,
                                  int threads) {
  CheckOptions options{.level = level, .limits = std::move(limits), .weights = {}, .max_threads = threads};
  if (weights) options.weights = vector_of(*weights);
  return options;
}

}  // namespace llmt::python
