// Intervals in the text of a model: a text whose model and intervals are both accepted gives bounds for every output.
#include <limits>
#include <stdexcept>

#include "fuzz/fitted_models.hpp"
#include "fuzz/json_mutator.hpp"
#include "llmt/intervals.hpp"

namespace fuzz_intervals {
namespace {

const std::vector<std::string> words = {"",          "x1",     "y",     "model",  "residuals", "residuals_incomplete",
                                        "intervals", "format", "parts", "spread", "nodes",     "levels"};

}  // namespace

FUZZ_TARGET(intervals) {
  fuzz::Bytes bytes(data, size);
  fuzz::Json json = fuzz::Json::parse(bytes.one_of(fuzz::fitted_models()));
  // Folds of the model, or of another one, or of both.
  const fuzz::Json model = bytes.byte() % 4 == 0 ? fuzz::Json::parse(bytes.one_of(fuzz::fitted_models())) : json;
  const fuzz::Json other = bytes.byte() % 4 == 0 ? fuzz::Json::parse(bytes.one_of(fuzz::fitted_models())) : model;
  fuzz::Json residuals = fuzz::Json::array();
  for (std::size_t o = 0; o < model["outputs"].size(); ++o) residuals.push_back({0.5, 0.1, 0.2, 0.4, 0.3, 0.6});
  json["intervals"] = {{{"residuals", residuals}, {"model", model}},
                       {{"residuals", residuals}, {"model", other}, {"residuals_incomplete", residuals}}};
  if (bytes.coin()) {
    fuzz::Json spread = {{"nodes", {{0, 0.5, 1, 1, 2}, {0.5}, {2.0}}}, {"levels", fuzz::Json::array()}};
    for (const auto& input : model["inputs"]) {
      const std::size_t levels = input.contains("levels") ? input["levels"].size() : 0;
      spread["levels"].push_back(std::vector<double>(levels > 0 ? levels + 1 : 0, 0.25));
    }
    fuzz::Json part = {{"residuals", residuals}, {"spread", fuzz::Json::array()}};
    for (std::size_t o = 0; o < residuals.size(); ++o) part["spread"].push_back(spread);
    json["intervals"][0] = {{"parts", {part, part}}, {"model", model}};
  }
  if (bytes.coin()) fuzz::mutate(json["intervals"], bytes, words);
  if (bytes.byte() % 4 == 0) fuzz::mutate(json, bytes, words);
  const std::string text = json.dump(-1, ' ', false, fuzz::Json::error_handler_t::replace);
  try {
    const auto [read, intervals] = llmt::from_json_with_intervals(text, "m");
    const std::string written = llmt::to_json(read, intervals);
    const auto [again, its_intervals] = llmt::from_json_with_intervals(written);
    fuzz::require(llmt::to_json(again, its_intervals) == written, "a model with intervals survives writing");
    if (intervals.empty()) return 0;
    Eigen::MatrixXd x = Eigen::MatrixXd::Constant(3, read.num_inputs(), 0.25);
    x.row(1).setConstant(std::numeric_limits<double>::quiet_NaN());
    Eigen::Index rows = 0;
    for (const llmt::HeldOutPart& part : intervals.parts()) rows += part.residuals.rows() + part.incomplete.rows();
    if (rows < 9) return 0;  // too few for the level
    const llmt::Bounds bounds = intervals.predict(x, 0.9, 1);
    fuzz::require(bounds.lower.cols() == read.num_outputs(), "there are bounds for every output");
  } catch (const std::runtime_error& error) {
    fuzz::require(std::string(error.what()).starts_with("m: "), fmt::format("'{}' names the file", error.what()));
  }
  return 0;
}

}  // namespace fuzz_intervals
