#include "report/model/explanation.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numeric>
#include <utility>
#include <vector>

namespace llmt::report {
namespace {

// Inputs, the largest magnitude first; equal ones in the order of the columns.
std::vector<std::size_t> by_size(const Eigen::VectorXd& values) {
  std::vector<std::size_t> order(values.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::ranges::stable_sort(order,
                           [&](std::size_t a, std::size_t b) { return std::abs(values(a)) > std::abs(values(b)); });
  return order;
}

// A value of an input: a number, a word, or null where it is missing.
Json input_json(const InputColumn& input, double value) {
  if (std::isnan(value)) return nullptr;
  if (input.is_categorical() && input.codes.empty()) {
    return value >= 0.0 ? Json(input.shown_level(static_cast<std::size_t>(value))) : Json(nullptr);
  }
  return value;
}

std::string input_text(const InputColumn& input, double value) {
  const Json json = input_json(input, value);
  return json.is_null() ? "missing" : json.is_string() ? json.get<std::string>() : number(value);
}

}  // namespace

Json explanation_json(const ModelColumns& model, const TableExplanation& explanation) {
  Json json = {{"model", explanation.model},
               {"data", explanation.data},
               {"rows", explanation.rows},
               {"rows_used", explanation.rows_used},
               {"targets", Json::array()}};
  for (Eigen::Index o = 0; o < std::ssize(model.outputs); ++o) {
    Json entries = Json::array();
    for (const std::size_t j : by_size(explanation.shares.row(o))) {
      entries.push_back({{"input", model.inputs[j].name}, {"importance", explanation.shares(o, j)}});
    }
    json["targets"].push_back({{"name", model.outputs[o].name}, {"importance", std::move(entries)}});
  }
  return json;
}

std::string explanation_text(const ModelColumns& model, const TableExplanation& explanation, std::size_t width) {
  std::string text =
      fmt::format("{}: importance over {} of {} rows\n", explanation.data, explanation.rows_used, explanation.rows);
  for (Eigen::Index o = 0; o < std::ssize(model.outputs); ++o) {
    Table table({"input", "importance"});
    for (const std::size_t j : by_size(explanation.shares.row(o))) {
      table.add({model.inputs[j].name, fmt::format("{:.3f}", explanation.shares(o, j))});
    }
    text += fmt::format("\n{}\n{}", model.outputs[o].name, table.text(width));
  }
  return text + wrapped(fmt::format("\nMean share of each input in how far predictions lie from the one {}.\n",
                                    explanation.beginning),
                        width);
}

Json explanation_json(const ModelColumns& model, const RowExplanation& explanation) {
  const Attribution& attribution = explanation.attribution;
  Json json = {
      {"model", explanation.model}, {"data", explanation.data}, {"row", explanation.row}, {"targets", Json::array()}};
  for (Eigen::Index o = 0; o < std::ssize(model.outputs); ++o) {
    Json entries = Json::array();
    for (const std::size_t j : by_size(attribution.contributions.row(o))) {
      const InputColumn& input = model.inputs[j];
      entries.push_back({{"input", input.name},
                         {"value", input_json(input, explanation.inputs(j))},
                         {"contribution", attribution.contributions(o, j)}});
    }
    json["targets"].push_back({{"name", model.outputs[o].name},
                               {"prediction", attribution.prediction(o)},
                               {"reference", attribution.reference(o)},
                               {"contributions", std::move(entries)}});
  }
  return json;
}

std::string explanation_text(const ModelColumns& model, const RowExplanation& explanation, std::size_t width) {
  const Attribution& attribution = explanation.attribution;
  std::string text =
      fmt::format("{}: row {}, line {} of the file\n", explanation.data, explanation.row, explanation.line);
  for (Eigen::Index o = 0; o < std::ssize(model.outputs); ++o) {
    Table table({"input", "value", "contribution"});
    for (const std::size_t j : by_size(attribution.contributions.row(o))) {
      const InputColumn& input = model.inputs[j];
      table.add({input.name, input_text(input, explanation.inputs(j)), number(attribution.contributions(o, j))});
    }
    const std::string prediction = number(attribution.prediction(o), 6);
    const std::string reference = number(attribution.reference(o), 6);
    const double sum = attribution.contributions.row(o).sum();
    text += fmt::format("\n{}: {} here, {} {}\n{}", model.outputs[o].name, prediction, reference, explanation.beginning,
                        table.text(width));
    text += fmt::format("The contributions add up: {} {} {} = {}\n", reference, sum < 0.0 ? "-" : "+",
                        number(std::abs(sum), 6), prediction);
  }
  return text;
}

}  // namespace llmt::report
