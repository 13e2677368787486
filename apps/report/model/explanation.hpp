/// \file
/// Where predictions come from, as text and as JSON: the importance of inputs over a table, the contributions of inputs
/// in one row.
#pragma once

#include <Eigen/Core>
#include <string>
#include <vector>

#include "llmt/explain.hpp"
#include "llmt/partition.hpp"
#include "report/text/json.hpp"
#include "report/text/text.hpp"

namespace llmt::report {

/// The columns of a model of any kind.
struct ModelColumns {
  template <class AnyModel>
  ModelColumns(const AnyModel& model) : inputs(model.inputs()), outputs(model.outputs()) {}

  const std::vector<InputColumn>& inputs;
  const std::vector<OutputColumn>& outputs;
};

/// What explanations of one tree begin from; those of a sum of trees begin from a mean over rows.
inline constexpr const char* at_the_means = "at the means of the inputs";

/// importance() of a table.
struct TableExplanation {
  std::string model;  ///< the name of its file
  std::string data;   ///< the name of the table
  Eigen::Index rows = 0;
  Eigen::Index rows_used = 0;
  Eigen::MatrixXd shares;                ///< outputs x inputs
  std::string beginning = at_the_means;  ///< of the contributions: the prediction ...
};

/// The inputs of each output, the most important one first.
Json explanation_json(const ModelColumns& model, const TableExplanation& explanation);

/// The same for people. `width`: of tables.
std::string explanation_text(const ModelColumns& model, const TableExplanation& explanation,
                             std::size_t width = no_width_limit);

/// attribute() of a row.
struct RowExplanation {
  std::string model;       ///< the name of its file
  std::string data;        ///< the name of the table
  Eigen::Index row = 1;    ///< counted from 1
  Eigen::Index line = 0;   ///< of the row in the file
  Eigen::VectorXd inputs;  ///< as Model::predict() takes them
  Attribution attribution;
  std::string beginning = at_the_means;  ///< of the contributions: the prediction ...
};

/// The inputs of each output, the largest contribution first.
Json explanation_json(const ModelColumns& model, const RowExplanation& explanation);

/// The same for people. `width`: of tables.
std::string explanation_text(const ModelColumns& model, const RowExplanation& explanation,
                             std::size_t width = no_width_limit);

}  // namespace llmt::report
