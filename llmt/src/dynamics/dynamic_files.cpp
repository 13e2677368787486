// Models of systems that move as JSON: docs/file-formats.md.
#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <utility>

#include "llmt/dynamic_model.hpp"
#include "llmt/files.hpp"
#include "llmt/limits.hpp"
#include "model_files/model_json.hpp"

namespace llmt {
namespace {

constexpr const char* stable = "stable";
constexpr const char* unstable = "unstable";
constexpr const char* goes_on = "polynomial";
constexpr const char* goes_on_held = "linear";
constexpr const char* predicted_change = "change";
constexpr const char* predicted_value = "value";

Json json_of(const Signal& signal, const std::vector<int>& lags, bool adds_up = false) {
  Json json = {
      {"name", signal.name}, {"unit", signal.unit}, {"low", signal.low}, {"high", signal.high}, {"lags", lags}};
  if (adds_up) json["predicted"] = predicted_change;
  if (std::isfinite(signal.lower_stop)) json["lower_stop"] = signal.lower_stop;
  if (std::isfinite(signal.upper_stop)) json["upper_stop"] = signal.upper_stop;
  return json;
}

Json json_of(const Polynomial& polynomial, const std::vector<std::string>& names) {
  Json json = {{"beyond_range", polynomial.is_held ? goes_on_held : goes_on}};
  json["regressors"] = Json::array();
  for (Eigen::Index j = 0; j < polynomial.centre.size(); ++j) {
    json["regressors"].push_back({{"name", names[j]},
                                  {"centre", polynomial.centre(j)},
                                  {"scale", polynomial.scale(j)},
                                  {"low", polynomial.low(j)},
                                  {"high", polynomial.high(j)}});
  }
  json["terms"] = Json::array();
  for (std::size_t k = 0; k < polynomial.terms.size(); ++k) {
    const Eigen::VectorXd column = polynomial.coefficients.col(static_cast<Eigen::Index>(k));
    json["terms"].push_back(
        {{"factors", polynomial.terms[k]}, {"coefficients", std::vector<double>(column.begin(), column.end())}});
  }
  return json;
}

std::vector<std::string> names_in(const std::vector<Signal>& signals) {
  std::vector<std::string> names;
  for (const Signal& signal : signals) names.push_back(signal.name);
  return names;
}

// One of two words.
bool is_first(const JsonReader& json, const char* first, const char* second) {
  const std::string word = json.as<std::string>();
  if (word != first && word != second)
    json.fail(fmt::format("\"{}\" is not known: {} and {} are", word, first, second));
  return word == first;
}

Signal signal_from(const JsonReader& json, bool is_output, std::vector<std::vector<int>>& lags) {
  Signal signal{json.member("name").as<std::string>()};
  signal.unit = json.as("unit", std::string());
  signal.low = json.member("low").as<double>();
  signal.high = json.member("high").as<double>();
  if (is_output) {
    signal.lower_stop = json.as("lower_stop", signal.lower_stop);
    signal.upper_stop = json.as("upper_stop", signal.upper_stop);
  }
  lags.push_back(json.member("lags").list<int>());
  return signal;
}

Polynomial polynomial_from(const JsonReader& json, Eigen::Index outputs) {
  Polynomial polynomial;
  polynomial.is_held = is_first(json.member("beyond_range"), goes_on_held, goes_on);
  const std::vector<JsonReader> regressors = json.member("regressors").elements();
  for (Eigen::VectorXd* values : {&polynomial.centre, &polynomial.scale, &polynomial.low, &polynomial.high}) {
    values->resize(std::ssize(regressors));
  }
  for (Eigen::Index j = 0; j < std::ssize(regressors); ++j) {
    polynomial.centre(j) = regressors[j].member("centre").as<double>();
    polynomial.scale(j) = regressors[j].member("scale").as<double>();
    polynomial.low(j) = regressors[j].member("low").as<double>();
    polynomial.high(j) = regressors[j].member("high").as<double>();
  }
  const std::vector<JsonReader> terms = json.member("terms").elements();
  polynomial.coefficients.resize(outputs, std::ssize(terms));
  for (Eigen::Index k = 0; k < std::ssize(terms); ++k) {
    polynomial.terms.push_back(terms[k].member("factors").list<int>());
    polynomial.coefficients.col(k) = terms[k].member("coefficients").vector(outputs);
  }
  return polynomial;
}

Json json_of(const RunBand& band) {
  Json json = {{"longest", band.longest}, {"outputs", Json::array()}};
  for (const std::vector<HeldOutErrors>& lists : band.outputs) {
    Json of_output = Json::array();
    for (const HeldOutErrors& list : lists) of_output.push_back({{"rows", list.rows}, {"errors", list.errors}});
    json["outputs"].push_back(std::move(of_output));
  }
  return json;
}

RunBand band_from(const JsonReader& json) {
  RunBand band;
  band.longest = json.member("longest").as<Eigen::Index>();
  for (const JsonReader& of_output : json.member("outputs").elements()) {
    std::vector<HeldOutErrors>& lists = band.outputs.emplace_back();
    for (const JsonReader& list : of_output.elements()) {
      lists.push_back({list.member("rows").as<double>(), list.member("errors").list<double>()});
    }
  }
  return band;
}

DynamicModel dynamic_from(const JsonReader& root) {
  if (!is_dynamic_model(root)) {
    root.fail(fmt::format("not a model of a system that moves: \"format\" is not \"{}\"; llmt fit --lags makes one",
                          dynamic_format_name));
  }
  if (const int version = root.member("version").as<int>(); version != dynamic_format_version) {
    root.fail(fmt::format("version {} of the format cannot be read, this program knows version {}", version,
                          dynamic_format_version));
  }
  DynamicParts parts;
  parts.sample_time = root.member("sample_time").as<double>();
  parts.time_unit = root.member("time_unit").as<std::string>();
  parts.is_stable = is_first(root.member("held_out_runs"), stable, unstable);
  for (const JsonReader& input : root.member("inputs").elements()) {
    parts.inputs.push_back(signal_from(input, false, parts.lags.inputs));
  }
  for (const JsonReader& output : root.member("outputs").elements()) {
    parts.outputs.push_back(signal_from(output, true, parts.lags.outputs));
    if (!output.has("predicted") || !is_first(output.member("predicted"), predicted_change, predicted_value)) continue;
    parts.lags.adds_up.resize(root.member("outputs").elements().size());
    parts.lags.adds_up[parts.outputs.size() - 1] = true;
  }
  parts.polynomial = polynomial_from(root.member("polynomial"), std::ssize(parts.outputs));
  if (root.has("held_out_errors")) parts.band = band_from(root.member("held_out_errors"));
  if (root.has("tree") && root.has("sum")) root.fail("a model has a tree or a sum of trees, not both");
  if (root.has("tree")) parts.rest = model_from(root.member("tree"));
  if (root.has("sum")) parts.rest = boosted_model_from(root.member("sum"));
  try {
    return DynamicModel(std::move(parts));
  } catch (const std::invalid_argument& error) {
    root.fail(error.what());
  }
}

}  // namespace

std::string to_json(const DynamicModel& model) {
  const DynamicParts& parts = model.parts();
  Json json = {{"format", dynamic_format_name},
               {"version", dynamic_format_version},
               {"sample_time", parts.sample_time},
               {"time_unit", parts.time_unit},
               {"held_out_runs", parts.is_stable ? stable : unstable}};
  json["inputs"] = Json::array();
  for (std::size_t i = 0; i < parts.inputs.size(); ++i) {
    json["inputs"].push_back(json_of(parts.inputs[i], parts.lags.inputs[i]));
  }
  json["outputs"] = Json::array();
  for (std::size_t o = 0; o < parts.outputs.size(); ++o) {
    json["outputs"].push_back(
        json_of(parts.outputs[o], parts.lags.outputs[o], adds_up(parts.lags, static_cast<Eigen::Index>(o))));
  }
  json["polynomial"] =
      json_of(parts.polynomial, column_names(model.columns(), names_in(parts.inputs), names_in(parts.outputs)));
  if (const auto* tree = std::get_if<Model>(&parts.rest)) json["tree"] = json_of(*tree);
  if (const auto* sum = std::get_if<BoostedModel>(&parts.rest)) json["sum"] = json_of(*sum);
  if (!parts.band.outputs.empty()) json["held_out_errors"] = json_of(parts.band);
  return model_text(json);
}

DynamicModel dynamic_from_json(const std::string& text, const std::string& name) {
  const JsonDocument document = parse_json(text, name, most(Limit::model_values));
  return dynamic_from({document.value(), name});
}

void save(const DynamicModel& model, const std::string& path) { write_file(path, to_json(model)); }

DynamicModel load_dynamic(const std::string& path) { return dynamic_from_json(read_file(path, model_limit), path); }

}  // namespace llmt
