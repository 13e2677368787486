// Intervals in the text of their model.
#include <fmt/format.h>

#include <stdexcept>

#include "llmt/files.hpp"
#include "llmt/intervals.hpp"
#include "llmt/limits.hpp"
#include "model/interval_checks.hpp"
#include "model_files/model_json.hpp"

namespace llmt {
namespace {

constexpr const char* of_incomplete = "residuals_incomplete";

// Residuals, one list an output in the file.
Eigen::MatrixXd residuals_from(const JsonReader& json) {
  const std::vector<JsonReader> of_output = json.elements();
  const Eigen::Index rows = of_output.empty() ? 0 : of_output.front().size();
  Eigen::MatrixXd residuals(rows, std::ssize(of_output));
  for (Eigen::Index o = 0; o < residuals.cols(); ++o) {
    residuals.col(o) = of_output[o].vector(rows);
  }
  return residuals;
}

Json lists_of(const Eigen::MatrixXd& residuals) {
  Json json = Json::array();
  for (const auto& column : residuals.colwise()) json.push_back(std::vector<double>(column.begin(), column.end()));
  return json;
}

Intervals intervals_from(const JsonReader& folds, const Model& model) {
  std::vector<Model> models;
  std::vector<Eigen::MatrixXd> residuals;
  std::vector<Eigen::MatrixXd> incomplete;
  for (const JsonReader& fold : folds.elements()) {
    models.push_back(model_from(fold.member("model")));
    residuals.push_back(residuals_from(fold.member("residuals")));
    incomplete.push_back(fold.has(of_incomplete) ? residuals_from(fold.member(of_incomplete))
                                                 : Eigen::MatrixXd(0, residuals.back().cols()));
  }
  try {
    Intervals intervals(std::move(models), std::move(residuals), std::move(incomplete));
    check_belong(intervals.models(), model);
    return intervals;
  } catch (const std::invalid_argument& error) {
    folds.fail(error.what());
  }
}

}  // namespace

std::string to_json(const Model& model, const Intervals& intervals) {
  try {
    check_belong(intervals.models(), model);
  } catch (const std::invalid_argument& error) {
    throw std::invalid_argument(fmt::format("llmt::to_json: {}", error.what()));
  }
  if (intervals.empty()) return to_json(model);
  Json json = json_of(model);
  json["intervals"] = Json::array();
  for (std::size_t k = 0; k < intervals.models().size(); ++k) {
    Json fold = {{"residuals", lists_of(intervals.residuals()[k])}, {"model", json_of(intervals.models()[k])}};
    if (const Eigen::MatrixXd& incomplete = intervals.incomplete_residuals()[k]; incomplete.rows() > 0) {
      fold[of_incomplete] = lists_of(incomplete);
    }
    json["intervals"].push_back(std::move(fold));
  }
  return model_text(json);
}

ModelWithIntervals from_json_with_intervals(const std::string& text, const std::string& name) {
  const JsonDocument document = parse_json(text, name, most(Limit::model_values));
  const Json& json = document.value();
  const JsonReader root(json, name);
  Model model = model_from(root);
  Intervals intervals;
  if (root.has("intervals")) intervals = intervals_from(root.member("intervals"), model);
  return {std::move(model), std::move(intervals)};
}

void save(const Model& model, const Intervals& intervals, const std::string& path) {
  write_file(path, to_json(model, intervals));
}

ModelWithIntervals load_with_intervals(const std::string& path) {
  return from_json_with_intervals(read_file(path, model_limit), path);
}

}  // namespace llmt
