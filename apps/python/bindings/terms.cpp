#include <fmt/format.h>
#include <nanobind/nanobind.h>
#include <nanobind/stl/optional.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/tuple.h>
#include <nanobind/stl/vector.h>

#include <algorithm>
#include <memory>
#include <optional>
#include <stdexcept>
#include <string>
#include <tuple>
#include <vector>

#include "llmt/discovery/simulation.hpp"
#include "python/bindings/arrays.hpp"
#include "python/bindings/interruptible.hpp"
#include "python/bindings/module.hpp"
#include "report/terms/terms_summary.hpp"

namespace llmt::python {
namespace {

using report::Json;

// (name, formula, function of rows of inputs).
using OwnTerm = std::tuple<std::string, std::string, nb::callable>;

// The data that a search and a later prediction both need. Callables of Python are called with the interpreter's lock
// on the thread that called; between them the lock is free.
struct Question {
  discovery::Inputs inputs;   ///< at which the terms are made
  Eigen::MatrixXd simulated;  ///< there, n x d, at the start of the parameters
  std::vector<std::string> outputs;
  discovery::Simulation simulation;
  std::vector<discovery::ModelTerm> terms;
  std::vector<discovery::UntestableCause> untestable;
  std::vector<std::string> only;  ///< families of the library, see of_families()
  std::vector<std::string> without;
};

// The result of a callable for rows of inputs, as a matrix; `what` names the callable in messages.
Eigen::MatrixXd called(const nb::callable& function, const Eigen::MatrixXd& inputs, const nb::object& values,
                       const std::string& what) {
  const nb::object given =
      values.is_valid() ? function(array_of<double>(inputs), values) : function(array_of<double>(inputs));
  Array array;
  if (!nb::try_cast(given, array)) {
    throw nb::type_error(
        fmt::format("{}: {} is no array of numbers of two dimensions", what, nb::repr(given).c_str()).c_str());
  }
  return rows_of(array);
}

// A callable that C++ may copy without the interpreter's lock.
using Callable = std::shared_ptr<const nb::callable>;

discovery::ModelTerm term_of(const OwnTerm& own) {
  const auto& [name, formula, function] = own;
  discovery::ModelTerm term;
  term.family = name;
  term.formula = formula;
  term.coefficients = {"coefficient"};
  term.per = "(" + formula + ")";
  term.columns = [function = Callable(std::make_shared<nb::callable>(function)), name = name](
                     const discovery::Rows& rows, const Eigen::VectorXd&) {
    const nb::gil_scoped_acquire locked;
    return called(*function, rows.inputs, {}, name);
  };
  return term;
}

discovery::Parameter parameter_of(const nb::dict& given) {
  const auto number = [&](const char* key) { return nb::cast<double>(given[key]); };
  const auto optional = [&](const char* key) { return nb::cast<std::optional<double>>(given[key]); };
  return {.name = nb::cast<std::string>(given["name"]),
          .unit = nb::cast<std::string>(given["unit"]),
          .value = number("value"),
          .scale = number("scale"),
          .free = nb::cast<bool>(given["free"]),
          .prior_sigma = optional("prior_sigma"),
          .prior_value = optional("prior_value")};
}

// The library's terms, and one's own in their place where they are the same. `in_time`: with those of inner states,
// which are of rows that follow each other.
std::vector<discovery::ModelTerm> terms_of(const Question& question, const std::vector<OwnTerm>& own_terms,
                                           bool own_terms_only, bool in_time,
                                           std::vector<discovery::UntestableCause>& untestable) {
  std::vector<discovery::ModelTerm> library =
      in_time ? report::library_terms(question.inputs, question.simulated, question.outputs, untestable)
              : discovery::standard_terms(question.inputs, &untestable);
  library = discovery::of_families(std::move(library), question.only, question.without);
  if (own_terms.empty()) return library;
  std::vector<discovery::ModelTerm> own;
  for (const OwnTerm& given : own_terms) {
    const std::string& name = std::get<0>(given);
    if (std::ranges::find(library, name, &discovery::ModelTerm::family) != library.end()) {
      throw std::invalid_argument(fmt::format("terms: \"{}\" is the name of a built-in term", name));
    }
    own.push_back(term_of(given));
  }
  return report::with_own_terms(std::move(library), std::move(own), own_terms_only,
                                discovery::rows_of(question.inputs, question.simulated.col(0)));
}

// `predict` is a callable or None: the simulation is known by its outputs alone then, at the rows of `tabulated`.
void set_simulation(Question& question, const nb::object& predict, const nb::list& parameters, bool offset, bool scale,
                    const Eigen::MatrixXd& tabulated) {
  if (predict.is_none()) {
    question.simulation = discovery::tabulated(tabulated, question.outputs, offset, scale);
    return;
  }
  for (const nb::handle parameter : parameters) {
    question.simulation.parameters.push_back(parameter_of(nb::cast<nb::dict>(parameter)));
  }
  question.simulation.predict = [function = Callable(std::make_shared<nb::callable>(nb::cast<nb::callable>(predict)))](
                                    const Eigen::MatrixXd& inputs, const Eigen::VectorXd& values) {
    const nb::gil_scoped_acquire locked;
    return called(*function, inputs, nb::cast(std::vector<double>(values.begin(), values.end())), "simulate");
  };
}

// `jacobian` is a callable or None. It gives n rows, the derivatives by all parameters of each output beside each
// other: output 0 by parameter 0, 1, ..., then output 1. Without one, differences of a simulation that is a callable:
// a call of Python takes longer than a search.
discovery::OutputDerivatives derivatives_of(const nb::object& jacobian, const nb::object& predict,
                                            const Question& question) {
  if (jacobian.is_none()) {
    if (predict.is_none() || question.simulation.parameters.empty()) return {};
    return discovery::central_differences(question.simulation);
  }
  const Eigen::Index d = std::ssize(question.outputs);
  const Eigen::Index p = std::ssize(question.simulation.parameters);
  return [function = Callable(std::make_shared<nb::callable>(nb::cast<nb::callable>(jacobian))), d, p](
             const Eigen::MatrixXd& inputs, const Eigen::VectorXd& values) {
    const nb::gil_scoped_acquire locked;
    const Eigen::MatrixXd all =
        called(*function, inputs, nb::cast(std::vector<double>(values.begin(), values.end())), "jacobian");
    std::vector<Eigen::MatrixXd> by(static_cast<std::size_t>(p), Eigen::MatrixXd(all.rows(), d));
    for (Eigen::Index o = 0; o < d; ++o) {
      for (Eigen::Index k = 0; k < p; ++k) by[static_cast<std::size_t>(k)].col(o) = all.col(o * p + k);
    }
    return by;
  };
}

Question question_of(const Array& inputs, std::vector<std::string> names, std::string order, const Array& simulated,
                     std::vector<std::string> outputs, std::vector<std::string> only,
                     std::vector<std::string> without) {
  return {.inputs = {std::move(names), rows_of(inputs), std::move(order)},
          .simulated = rows_of(simulated),
          .outputs = std::move(outputs),
          .simulation = {},
          .terms = {},
          .untestable = {},
          .only = std::move(only),
          .without = std::move(without)};
}

// The part of a result that corrected() needs.
std::string state_of(const discovery::Missing& missing) {
  Json found = Json::array();
  for (const discovery::FoundTerm& term : missing.found) {
    found.push_back({{"term", term.term},
                     {"output", term.output_index},
                     {"coefficients", std::vector<double>(term.coefficients.begin(), term.coefficients.end())},
                     {"constants", std::vector<double>(term.constants.begin(), term.constants.end())}});
  }
  Json values = Json::array();
  for (const discovery::Parameter& parameter : missing.parameters) values.push_back(parameter.value);
  const Eigen::VectorXd& bands = missing.zero_bands;
  return Json({{"found", found}, {"values", values}, {"zero_bands", std::vector<double>(bands.begin(), bands.end())}})
      .dump();
}

discovery::Missing missing_of(const std::string& state, const Question& question) {
  const Json json = Json::parse(state);
  discovery::Missing missing;
  for (const Json& entry : json["found"]) {
    const auto vector = [&](const char* key) {
      const auto numbers = entry[key].get<std::vector<double>>();
      return Eigen::VectorXd(Eigen::Map<const Eigen::VectorXd>(numbers.data(), std::ssize(numbers)));
    };
    discovery::FoundTerm& term = missing.found.emplace_back();
    term.term = entry["term"].get<std::size_t>();
    if (term.term >= question.terms.size()) {
      throw std::invalid_argument(
          "an inner state was found: it depends on the rows before and after, not on a row alone");
    }
    term.output_index = entry["output"].get<Eigen::Index>();
    term.coefficients = vector("coefficients");
    term.constants = vector("constants");
  }
  missing.parameters = question.simulation.parameters;
  for (std::size_t k = 0; k < missing.parameters.size(); ++k) missing.parameters[k].value = json["values"][k];
  const auto bands = json["zero_bands"].get<std::vector<double>>();
  missing.zero_bands = Eigen::Map<const Eigen::VectorXd>(bands.data(), std::ssize(bands));
  for (const std::string& output : question.outputs) missing.gaps.push_back({.output = output});
  return missing;
}

// The lock is free while the library works.
template <class Work>
void unlocked(const Work& work) {
  const nb::gil_scoped_release free;
  work();
}

nb::dict find_missing(const Array& inputs, const std::vector<std::string>& input_names, const std::string& order,
                      const std::vector<std::string>& only, const std::vector<std::string>& without,
                      const std::vector<double>& instants, const std::vector<Eigen::Index>& runs,
                      const std::vector<double>& input_noise, const std::vector<double>& output_noise, double cutoff,
                      const Array& simulated, const Array& measured, const std::vector<std::string>& output_names,
                      const nb::object& predict, const nb::object& jacobian, const nb::list& parameters, bool offset,
                      bool scale, const std::vector<OwnTerm>& own_terms, bool own_terms_only, double held_out,
                      std::uint64_t seed, const std::string& simulated_name, const std::string& measured_name,
                      const nb::object& report) {
  Question question = question_of(inputs, input_names, order, simulated, output_names, only, without);
  question.inputs.instants = Eigen::Map<const Eigen::VectorXd>(instants.data(), std::ssize(instants));
  question.inputs.runs = runs;
  question.inputs.noise = Eigen::Map<const Eigen::VectorXd>(input_noise.data(), std::ssize(input_noise));
  question.inputs.cutoff = cutoff;
  set_simulation(question, predict, parameters, offset, scale, question.simulated);
  const discovery::MeasuredOutputs outputs{
      output_names, rows_of(measured),
      Eigen::Map<const Eigen::VectorXd>(output_noise.data(), std::ssize(output_noise))};
  report::TermsSummary summary{.simulated = simulated_name,
                               .measured = measured_name,
                               .corrected = "",
                               .inputs = input_names,
                               .seed = seed,
                               .rows = question.simulated.rows(),
                               .missing = {},
                               .outlier_lines = {},
                               .regions = {},
                               .ranges = report::ranges_of(question.inputs),
                               .order = order,
                               .counted = "row",
                               .failing_lines = {},
                               .time = instants.empty() ? "" : "time"};
  discovery::MissingOptions options{.held_out_share = held_out, .seed = seed};
  options.progress = [&report](const ProgressReport& said) {
    const nb::gil_scoped_acquire locked;
    check_signals();
    if (!report.is_none()) report(said.done, said.total, said.step);
    return true;
  };
  question.terms = terms_of(question, own_terms, own_terms_only, true, question.untestable);
  const discovery::OutputDerivatives derivatives = derivatives_of(jacobian, predict, question);
  unlocked([&] {
    summary.missing =
        derivatives ? discovery::find_missing_in_steps(question.simulation, derivatives, question.inputs, outputs,
                                                       question.terms, options)
                    : discovery::find_missing(question.simulation, question.inputs, outputs, question.terms, options);
    summary.regions = report::gap_regions(question.inputs, outputs, summary.missing);
  });
  discovery::Missing& missing = summary.missing;
  for (const discovery::UntestableCause& entry : question.untestable) missing.not_testable.push_back(entry);
  summary.outlier_lines = missing.outliers;
  summary.failing_lines = missing.failing_rows;
  nb::dict result;
  result["text"] = report::terms_text(summary);
  result["json"] = report::terms_json(summary).dump(-1, ' ', false, Json::error_handler_t::replace);
  result["state"] = state_of(missing);
  result["before"] = array_of<double>(missing.before);
  result["corrected"] = array_of<double>(missing.corrected);
  result["held_out"] = missing.held_out;
  return result;
}

// The corrected simulation at other inputs; `tabulated`: its outputs there, if they alone are known.
auto corrected(const Array& inputs, const std::vector<std::string>& input_names, const std::string& order,
               const std::vector<std::string>& only, const std::vector<std::string>& without, const Array& simulated,
               const std::vector<std::string>& output_names, const nb::object& predict, const nb::list& parameters,
               bool offset, bool scale, const std::vector<OwnTerm>& own_terms, bool own_terms_only,
               const std::string& state, const Array& elsewhere, const std::optional<Array>& tabulated) {
  Question question = question_of(inputs, input_names, order, simulated, output_names, only, without);
  const Eigen::MatrixXd there = tabulated ? Eigen::MatrixXd(rows_of(*tabulated)) : Eigen::MatrixXd();
  set_simulation(question, predict, parameters, offset, scale, there);
  const discovery::Inputs places{input_names, rows_of(elsewhere), order};
  Eigen::MatrixXd result;
  question.terms = terms_of(question, own_terms, own_terms_only, false, question.untestable);
  const discovery::Missing missing = missing_of(state, question);
  unlocked([&] { result = discovery::corrected(question.simulation, missing, question.terms, places); });
  return array_of<double>(std::move(result));
}

}  // namespace

void add_terms(nb::module_& module) {
  using nb::arg;
  module.def("find_missing", &find_missing, nb::kw_only(), arg("inputs"), arg("input_names"), arg("order"), arg("only"),
             arg("without"), arg("instants"), arg("runs"), arg("input_noise"), arg("output_noise"), arg("cutoff"),
             arg("simulated"), arg("measured"), arg("output_names"), arg("predict").none(), arg("jacobian").none(),
             arg("parameters"), arg("offset"), arg("scale"), arg("terms"), arg("own_terms_only"), arg("held_out"),
             arg("seed"), arg("simulated_name"), arg("measured_name"), arg("report").none());
  module.def("corrected", &corrected, nb::kw_only(), arg("inputs"), arg("input_names"), arg("order"), arg("only"),
             arg("without"), arg("simulated"), arg("output_names"), arg("predict").none(), arg("parameters"),
             arg("offset"), arg("scale"), arg("terms"), arg("own_terms_only"), arg("state"), arg("elsewhere"),
             arg("tabulated").none());
}

}  // namespace llmt::python
