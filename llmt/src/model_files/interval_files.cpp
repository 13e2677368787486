// Intervals in the text of their model.
#include <fmt/format.h>

#include <algorithm>
#include <iterator>
#include <stdexcept>
#include <utility>

#include "llmt/files.hpp"
#include "llmt/intervals.hpp"
#include "llmt/limits.hpp"
#include "model/interval_checks.hpp"
#include "model_files/model_json.hpp"
#include "model_files/spread_files.hpp"

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

// `json`: a fold, or one of its parts.
HeldOutPart part_from(const JsonReader& json, std::size_t model) {
  HeldOutPart part{.model = model, .residuals = residuals_from(json.member("residuals")), .incomplete = {}};
  part.incomplete =
      json.has(of_incomplete) ? residuals_from(json.member(of_incomplete)) : Eigen::MatrixXd(0, part.residuals.cols());
  if (json.has("disagreement")) part.disagreement = json.member("disagreement").list<double>();
  if (!json.has("spread")) return part;
  for (const JsonReader& spread : json.member("spread").elements()) part.spreads.push_back(spread_from(spread));
  return part;
}

Json json_of(const HeldOutPart& part) {
  Json json = {{"residuals", lists_of(part.residuals)}};
  if (part.incomplete.rows() > 0) json[of_incomplete] = lists_of(part.incomplete);
  if (!part.disagreement.empty()) json["disagreement"] = part.disagreement;
  for (const Spread& spread : part.spreads) json["spread"].push_back(json_of(spread));
  return json;
}

Intervals intervals_from(const JsonReader& folds, std::vector<Gap> gaps, TrainingRecord record, const Model& model) {
  std::vector<Model> models;
  std::vector<HeldOutPart> parts;
  for (const JsonReader& fold : folds.elements()) {
    if (fold.has("parts")) {
      const std::vector<JsonReader> of_fold = fold.member("parts").elements();
      for (const JsonReader& part : of_fold) parts.push_back(part_from(part, models.size()));
    } else {
      parts.push_back(part_from(fold, models.size()));
    }
    models.push_back(model_from(fold.member("model")));
  }
  try {
    Intervals intervals(std::move(models), std::move(parts), std::move(gaps), std::move(record));
    check_belong(intervals.models(), model);
    return intervals;
  } catch (const std::invalid_argument& error) {
    folds.fail(error.what());
  }
}

// Whether a fold is written as programs before spreads read it. Those find no residuals where it is not.
bool is_plain(const std::vector<HeldOutPart>& of_fold) {
  return of_fold.size() == 1 && of_fold.front().spreads.empty() && of_fold.front().disagreement.empty();
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
    std::vector<HeldOutPart> of_fold;
    std::ranges::copy_if(intervals.parts(), std::back_inserter(of_fold),
                         [&](const HeldOutPart& part) { return part.model == k; });
    Json fold = is_plain(of_fold) ? json_of(of_fold.front()) : Json();
    if (!is_plain(of_fold)) {
      for (const HeldOutPart& part : of_fold) fold["parts"].push_back(json_of(part));
    }
    fold["model"] = json_of(intervals.models()[k]);
    json["intervals"].push_back(std::move(fold));
  }
  if (!intervals.gaps().empty()) json["gaps"] = json_of(intervals.gaps());
  if (!intervals.record().empty()) json["training"] = json_of(intervals.record());
  return model_text(json);
}

ModelWithIntervals from_json_with_intervals(const std::string& text, const std::string& name) {
  const JsonDocument document = parse_json(text, name, most(Limit::model_values));
  const Json& json = document.value();
  const JsonReader root(json, name);
  Model model = model_from(root);
  Intervals intervals;
  if (root.has("intervals")) {
    intervals = intervals_from(root.member("intervals"), gaps_from(root), record_from(root), model);
  }
  return {std::move(model), std::move(intervals)};
}

void save(const Model& model, const Intervals& intervals, const std::string& path) {
  write_file(path, to_json(model, intervals));
}

ModelWithIntervals load_with_intervals(const std::string& path) {
  return from_json_with_intervals(read_file(path, model_limit), path);
}

}  // namespace llmt
