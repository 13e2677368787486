#include "report/terms/found_terms.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <stdexcept>

#include "expressions/expression.hpp"
#include "llmt/discovery/search.hpp"
#include "llmt/discovery/terms.hpp"
#include "report/text/text.hpp"

namespace llmt::report {
namespace {

constexpr const char* history[] = {"previous", "rate", "direction"};

bool is_history(const FoundTerms::Term& term) {
  return std::ranges::find(history, term.family) != std::end(history) && !term.location.empty();
}

std::size_t output_place(const FoundTerms& found, const std::string& name) {
  const auto place = std::ranges::find(found.outputs, name, &FoundTerms::Output::name);
  if (place == found.outputs.end()) {
    throw std::runtime_error(fmt::format("{}: \"{}\" is none of its outputs", found.file, name));
  }
  return static_cast<std::size_t>(place - found.outputs.begin());
}

void read_parameter(const Json& json, FoundTerms& found) {
  const std::string name = json.at("parts").at(0).get<std::string>();
  const double change = json.at("change").get<double>();
  for (FoundTerms::Output& output : found.outputs) {
    if (name == output.name + ".offset") {
      output.offset += change;
      return;
    }
    if (name == output.name + ".scale") {
      output.scale += change;
      return;
    }
  }
  found.changes.push_back({name, json.at("unit").get<std::string>(), change,
                           json.at("parts").size() == 1 ? json.at("value") : Json(nullptr)});
}

void read_terms(const Json& json, FoundTerms& found) {
  const auto text_of = [](const Json& value) { return value.is_null() ? std::string() : value.get<std::string>(); };
  for (const Json& effect : json.at("effects")) {
    FoundTerms::Term term;
    term.family = effect.at("name").get<std::string>();
    term.location = effect.at("location").get<std::string>();
    term.title = term.location.empty() ? term.family : term.family + " of " + term.location;
    term.output = output_place(found, effect.at("output").get<std::string>());
    term.expression = text_of(effect.at("expression"));
    for (const Json& parameter : effect.at("parameters")) {
      term.values.push_back(parameter.at("value").get<double>());
    }
    if (term.values.empty()) throw std::runtime_error(fmt::format("{}: {} has no values", found.file, term.title));
    term.is_inner_state = effect.contains("inner_state") && term.expression.empty();
    found.terms.push_back(std::move(term));
  }
  for (const Json& shape : json.at("unknown_all")) {
    if (!shape.contains("expression")) continue;  // what nothing explains
    FoundTerms::Term term;
    term.title = shape.at("kind").get<std::string>();
    term.output = output_place(found, shape.at("acts_on").get<std::string>());
    term.expression = text_of(shape.at("expression"));
    found.terms.push_back(std::move(term));
  }
}

// Words become part of code: only those that this program makes are taken.
void check_words(const FoundTerms& found) {
  std::vector<std::string> names = found.input_names();
  std::vector<std::string> words;
  for (const FoundTerms::Input& input : found.inputs) words.push_back(input.word);
  for (const FoundTerms::Output& output : found.outputs) {
    names.push_back(output.name);
    words.push_back(output.word);
  }
  const std::vector<std::string> expected = words_for(names);
  for (std::size_t k = 0; k < words.size(); ++k) {
    if (words[k] != expected[k]) {
      throw std::runtime_error(
          fmt::format("{}: the word of \"{}\" is \"{}\", must be \"{}\"", found.file, names[k], words[k], expected[k]));
    }
  }
}

// Terms of the past need times as those of the search.
void check_times(const FoundTerms& found, const FoundTerms::Term& term, const discovery::Inputs& inputs) {
  if (inputs.instants.size() == 0) {
    if (found.time.empty()) return;  // neither had the search
    throw std::runtime_error(
        fmt::format("{}: the term {} depends on when the rows were taken, which is not given", found.file, term.title));
  }
  const discovery::Rows rows = discovery::rows_of(inputs, Eigen::VectorXd::Zero(inputs.values.rows()));
  std::vector<double> steps;
  for (std::size_t k = 1; k < rows.sequence.size(); ++k) {
    const Eigen::Index one = rows.sequence[k - 1];
    const Eigen::Index next = rows.sequence[k];
    if (!inputs.runs.empty() && inputs.runs[one] != inputs.runs[next]) continue;
    steps.push_back(inputs.instants(next) - inputs.instants(one));
    if (steps.back() > 0.0) continue;
    throw std::runtime_error(
        fmt::format("{}: the term {} depends on when the rows were taken, but data rows {} and {} have the time {}; "
                    "rows of a run are taken one after the other",
                    found.file, term.title, one + 1, next + 1, inputs.instants(next)));
  }
  if (steps.empty() || !(found.step > 0.0)) return;
  std::ranges::nth_element(steps, steps.begin() + std::ssize(steps) / 2);
  const double step = steps[steps.size() / 2];
  constexpr double another_unit = 50.0;
  if (step > another_unit * found.step || found.step > another_unit * step) {
    throw std::runtime_error(
        fmt::format("{}: the term {} was found in rows that are {} apart; these are {} apart: times must have the unit "
                    "of the search",
                    found.file, term.title, number(found.step, 3), number(step, 3)));
  }
}

// Values of a term of the past at all rows. `outputs`: without terms.
Eigen::VectorXd inner_state(const FoundTerms& found, const FoundTerms::Term& term, const discovery::Inputs& inputs,
                            const Eigen::MatrixXd& outputs) {
  check_times(found, term, inputs);
  const std::vector<std::string> names = found.output_names();
  for (const discovery::ModelTerm& known : discovery::inner_state_terms(inputs, outputs, names)) {
    const auto coefficients = known.whole ? 0 : std::ssize(known.coefficients);
    const auto constants = std::ssize(known.constants);
    const bool is_this = known.family == term.family && known.location == term.location &&
                         known.output == names[term.output] && std::ssize(term.values) == coefficients + constants;
    if (!is_this) continue;
    const Eigen::VectorXd base = outputs.col(static_cast<Eigen::Index>(term.output));
    const Eigen::Map<const Eigen::VectorXd> values(term.values.data(), coefficients + constants);
    const Eigen::MatrixXd columns = known.columns(discovery::rows_of(inputs, base), values.tail(constants));
    return known.whole ? Eigen::VectorXd(columns.rowwise().sum())
                       : Eigen::VectorXd(columns * values.head(coefficients));
  }
  throw std::runtime_error(
      fmt::format("{}: the term {} depends on the past and cannot be computed at these rows: it needs 60 rows or more, "
                  "the times of which tell derivatives",
                  found.file, term.title));
}

// Values of a term at all rows. `outputs`: without terms.
Eigen::VectorXd values_of(const FoundTerms& found, const FoundTerms::Term& term, const discovery::Inputs& inputs,
                          const Eigen::MatrixXd& outputs) {
  const Eigen::VectorXd base = outputs.col(static_cast<Eigen::Index>(term.output));
  if (term.is_inner_state) return inner_state(found, term, inputs, outputs);
  if (term.expression.empty()) {
    if (!is_history(term)) {
      throw std::runtime_error(fmt::format("{}: the term {} has no expression", found.file, term.title));
    }
    for (const discovery::ModelTerm& known : discovery::row_before_terms(inputs, term.location)) {
      if (known.family == term.family) {
        return term.values.front() * known.columns(discovery::rows_of(inputs, base), {}).col(0);
      }
    }
  }
  Expression expression(term.expression, {{"pi", std::numbers::pi}});
  const FoundTerms::Output& output = found.outputs[term.output];
  std::vector<Eigen::Index> places;
  for (const std::string& name : expression.names()) {
    const auto input = std::ranges::find_if(
        found.inputs, [&](const FoundTerms::Input& i) { return i.word == name || i.name == name; });
    if (input == found.inputs.end() && name != output.word && name != output.name) {
      throw std::runtime_error(
          fmt::format("{}: the term {} depends on \"{}\", which is no input", found.file, term.title, name));
    }
    places.push_back(input - found.inputs.begin());
  }
  const auto value_of = [&](Eigen::Index i, Eigen::Index place) {
    if (place == inputs.values.cols()) return base(i);
    const double value = inputs.values(i, place);
    return found.is_held ? std::clamp(value, found.inputs[place].low, found.inputs[place].high) : value;
  };
  Eigen::VectorXd values(base.size());
  std::vector<double> variables(places.size());
  for (Eigen::Index i = 0; i < values.size(); ++i) {
    for (std::size_t k = 0; k < places.size(); ++k) variables[k] = value_of(i, places[k]);
    values(i) = expression.value(variables);
  }
  return values;
}

}  // namespace

std::vector<std::string> FoundTerms::input_names() const {
  std::vector<std::string> names;
  for (const Input& input : inputs) names.push_back(input.name);
  return names;
}

std::vector<std::string> FoundTerms::output_names() const {
  std::vector<std::string> names;
  for (const Output& output : outputs) names.push_back(output.name);
  return names;
}

bool FoundTerms::needs_time() const { return std::ranges::any_of(terms, &Term::is_inner_state); }

FoundTerms found_terms(const std::string& json, const std::string& file) {
  Json parsed;
  try {
    parsed = Json::parse(json);
  } catch (const Json::exception& error) {
    throw std::runtime_error(fmt::format("{}: {}", file, error.what()));
  }
  return found_terms(parsed, file);
}

FoundTerms found_terms(const Json& json, const std::string& file) {
  FoundTerms found;
  found.file = file;
  try {
    for (const Json& input : json.at("inputs")) {
      found.inputs.push_back({input.at("name").get<std::string>(), input.at("word").get<std::string>(),
                              input.at("low").get<double>(), input.at("high").get<double>(),
                              input.value("zero_band", 0.0)});
    }
    for (const Json& output : json.at("outputs")) {
      found.outputs.push_back({output.at("name").get<std::string>(), output.at("word").get<std::string>()});
      FoundTerms::Output& own = found.outputs.back();
      own.terms_low = output.value("terms_low", own.terms_low);
      own.terms_high = output.value("terms_high", own.terms_high);
    }
    check_words(found);
    if (found.outputs.empty()) throw std::runtime_error(fmt::format("{}: there are no outputs", file));
    found.order = json.at("order").get<std::string>();
    if (json.contains("time")) {
      found.time = json["time"].value("column", "");
      found.group = json["time"].value("group", "");
      found.step = json["time"].value("step", 0.0);
    }
    if (json.value("may_be_applied", true)) {
      for (const Json& parameter : json.at("parameters")) read_parameter(parameter, found);
      read_terms(json, found);
      found.is_held = json.value("verdict", "") == discovery::to_string(discovery::Answer::unknown);
    } else {
      found.refused = json.at("verdict").get<std::string>();
    }
  } catch (const Json::exception& error) {
    throw std::runtime_error(fmt::format("{} is not what llmt discover --json prints: {}", file, error.what()));
  }
  return found;
}

Eigen::MatrixXd apply(const FoundTerms& found, const Eigen::MatrixXd& inputs, const Eigen::MatrixXd& simulated,
                      const std::map<std::string, Eigen::MatrixXd>& derivatives, const RowTimes& times) {
  discovery::Inputs named{found.input_names(), inputs, found.order, times.instants, times.runs};
  for (std::size_t j = 0; j < found.inputs.size(); ++j) {
    for (double& value : named.values.col(static_cast<Eigen::Index>(j))) {
      if (std::abs(value) < found.inputs[j].zero_band) value = 0.0;
    }
  }
  Eigen::MatrixXd base = simulated;
  for (std::size_t o = 0; o < found.outputs.size(); ++o) {
    const auto column = static_cast<Eigen::Index>(o);
    base.col(column) = (found.outputs[o].offset + found.outputs[o].scale * simulated.col(column).array()).matrix();
  }
  for (const FoundTerms::Change& change : found.changes) {
    const auto by = derivatives.find(change.parameter);
    if (by != derivatives.end()) base += change.change * by->second;
  }
  Eigen::MatrixXd added = Eigen::MatrixXd::Zero(base.rows(), base.cols());
  for (const FoundTerms::Term& term : found.terms) {
    const auto column = static_cast<Eigen::Index>(term.output);
    Eigen::VectorXd values;
    try {
      values = values_of(found, term, named, base);
    } catch (const ExpressionError& error) {
      throw std::runtime_error(fmt::format("{}: the term {}: {}", found.file, term.title, error.what()));
    }
    for (Eigen::Index i = 0; i < values.size(); ++i) {
      if (!std::isfinite(values(i))) {
        throw std::runtime_error(
            fmt::format("{}: the term {} is not finite at data row {}", found.file, term.title, i + 1));
      }
    }
    added.col(column) += values;
  }
  for (std::size_t o = 0; o < found.outputs.size(); ++o) {
    const auto column = static_cast<Eigen::Index>(o);
    added.col(column) = added.col(column).cwiseMax(found.outputs[o].terms_low).cwiseMin(found.outputs[o].terms_high);
  }
  return base + added;
}

std::vector<std::string> outside_sentences(const FoundTerms& found, const Eigen::MatrixXd& inputs) {
  std::vector<std::string> sentences;
  for (std::size_t j = 0; j < found.inputs.size(); ++j) {
    const FoundTerms::Input& input = found.inputs[j];
    const auto column = inputs.col(static_cast<Eigen::Index>(j)).array();
    const Eigen::Index outside = (column < input.low || column > input.high).count();
    if (outside == 0) continue;
    sentences.push_back(fmt::format("{} of {} values of {} lie outside of {} ... {}, where the terms were found",
                                    outside, column.size(), input.name, number(input.low), number(input.high)));
  }
  return sentences;
}

}  // namespace llmt::report
