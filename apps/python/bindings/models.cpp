#include <nanobind/nanobind.h>
#include <nanobind/stl/map.h>
#include <nanobind/stl/optional.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/tuple.h>
#include <nanobind/stl/vector.h>

#include <algorithm>
#include <cstdint>
#include <map>
#include <numeric>
#include <optional>
#include <string>
#include <tuple>
#include <vector>

#include "llmt/c_source.hpp"
#include "llmt/explain.hpp"
#include "llmt/intervals.hpp"
#include "llmt/model.hpp"
#include "llmt/permutation_importance.hpp"
#include "python/bindings/arrays.hpp"
#include "python/bindings/checked.hpp"
#include "python/bindings/model_arrays.hpp"
#include "python/bindings/module.hpp"
#include "report/model/leaves.hpp"
#include "report/model/plain_source.hpp"
#include "report/model/rules.hpp"

namespace llmt::python {
namespace {

// Rows whose intervals are found, or that are explained, at a time, as predicted_rows: by models of 60 leaves an
// interval is found in 10 us, and a row is explained in 3 ms.
constexpr Eigen::Index judged_rows = 1000;
constexpr Eigen::Index explained_rows = 5;

auto predict_by_tree(const ModelWithIntervals& self, const Array& inputs, int threads) {
  return stacked<double>(inputs, self.model.num_outputs(),
                         [&](const Eigen::MatrixXd& block) { return self.model.predict(block, threads); });
}

auto standard_errors(const ModelWithIntervals& self, const Array& inputs, int threads) {
  return stacked<double>(inputs, self.model.num_outputs(),
                         [&](const Eigen::MatrixXd& block) { return self.model.standard_errors(block, threads); });
}

auto leaf_of(const ModelWithIntervals& self, const Array& inputs, int threads) {
  return stacked<int>(inputs, std::ssize(self.model.partitions()),
                      [&](const Eigen::MatrixXd& block) { return self.model.leaf_of(block, threads); });
}

auto validities(const ModelWithIntervals& self, const Array& inputs, Eigen::Index partition, int threads) {
  return stacked<double>(inputs, std::ssize(self.model.leaves(partition)), [&](const Eigen::MatrixXd& block) {
    return self.model.validities(block, partition, threads);
  });
}

// Distance and leverage.
auto extrapolation(const ModelWithIntervals& self, const Array& inputs, int threads) {
  return stacked<double>(inputs, 2, [&](const Eigen::MatrixXd& block) {
    const std::vector<Extrapolation> found = self.model.extrapolation(block, threads);
    Eigen::MatrixXd result(block.rows(), 2);
    for (Eigen::Index row = 0; row < block.rows(); ++row) {
      result(row, 0) = found[row].distance;
      result(row, 1) = found[row].leverage;
    }
    return result;
  });
}

auto intervals(const ModelWithIntervals& self, const Array& inputs, double level, int threads) {
  const Eigen::Index rows = static_cast<Eigen::Index>(inputs.shape(0));
  Bounds bounds{Eigen::MatrixXd(rows, self.model.num_outputs()), Eigen::MatrixXd(rows, self.model.num_outputs())};
  for_blocks(inputs, judged_rows, [&](Eigen::Index first, const Eigen::MatrixXd& block) {
    const Bounds part = holding(self.intervals.predict(block, level, threads), self.model.predict(block, threads));
    bounds.lower.middleRows(first, block.rows()) = part.lower;
    bounds.upper.middleRows(first, block.rows()) = part.upper;
    for (const Eigen::Index row : part.uncalibrated) bounds.uncalibrated.push_back(first + row);
  });
  return std::make_tuple(array_of<double>(std::move(bounds.lower)), array_of<double>(std::move(bounds.upper)),
                         bounds.uncalibrated);
}

auto quantiles_of(const ModelWithIntervals& self, const Array& inputs, const std::vector<double>& probabilities,
                  int threads) {
  return stacked_quantiles(inputs, self.model.num_outputs(), probabilities, [&](const Eigen::MatrixXd& block) {
    return quantiles(self, block, probabilities, threads);
  });
}

// Contributions of all rows, one matrix (rows x inputs) for each output, and the prediction at the reference.
auto attribute_rows(const ModelWithIntervals& self, const Array& inputs) {
  const Model& model = self.model;
  std::vector<Eigen::MatrixXd> contributions(
      model.num_outputs(), Eigen::MatrixXd(static_cast<Eigen::Index>(inputs.shape(0)), model.num_inputs()));
  const Eigen::VectorXd reference = reference_point(model);
  for_blocks(inputs, explained_rows, [&](Eigen::Index first, const Eigen::MatrixXd& block) {
    for (Eigen::Index row = 0; row < block.rows(); ++row) {
      const Attribution found = attribute(model, block.row(row).transpose(), reference);
      for (Eigen::Index o = 0; o < model.num_outputs(); ++o)
        contributions[o].row(first + row) = found.contributions.row(o);
    }
  });
  const Eigen::MatrixXd base = model.predict(reference.transpose());
  return std::make_tuple(arrays_of(std::move(contributions)),
                         std::vector<double>(base.reshaped().begin(), base.reshaped().end()));
}

auto importance_of(const ModelWithIntervals& self, const Array& inputs, int threads) {
  Eigen::MatrixXd shares;
  const Eigen::MatrixXd rows = rows_of(inputs);
  interruptible([&](const Progress& progress) { shares = importance(self.model, rows, threads, progress); },
                nb::none());
  return array_of<double>(std::move(shares));
}

// By how much the error on these rows grows without each input, and its standard error: outputs x inputs each.
auto permutation_importance_of(const ModelWithIntervals& self, const Array& inputs, const Array& outputs,
                               const std::optional<Vector>& weights, const PermutationOptions& options) {
  const Eigen::MatrixXd x = rows_of(inputs);
  const Eigen::MatrixXd y = rows_of(outputs);
  std::vector<std::vector<Eigen::Index>> all(1, std::vector<Eigen::Index>(static_cast<std::size_t>(x.rows())));
  std::iota(all[0].begin(), all[0].end(), Eigen::Index{0});
  PermutationImportance found;
  interruptible(
      [&](const Progress& progress) {
        found = permutation_importance({self.model}, x, y, all, weights ? vector_of(*weights) : Eigen::VectorXd(),
                                       options, progress);
      },
      nb::none());
  return std::make_tuple(array_of<double>(std::move(found.increase)),
                         array_of<double>(std::move(found.standard_error)));
}

std::tuple<std::string, std::string> c_source(const ModelWithIntervals& self, const std::string& name) {
  CSource written = to_c(self.model, name, name + ".h");
  return {std::move(written.source), std::move(written.header)};
}

}  // namespace

void add_models(nb::module_& module) {
  using Self = ModelWithIntervals;
  nb::class_<Self>(module, "Model", "A model and its prediction intervals.")
      .def(nb::new_(
               [](const std::string& text, const std::string& name) { return from_json_with_intervals(text, name); }),
           nb::arg("text"), nb::arg("name") = "model", "Reads what to_json() wrote.")
      .def("to_json", [](const Self& self) { return to_json(self.model, self.intervals); })
      .def("without_intervals", [](const Self& self) { return to_json(self.model); })
      .def_prop_ro("has_intervals", [](const Self& self) { return !self.intervals.empty(); })
      .def("inputs", [](const Self& self) { return columns_of(self.model.inputs()); })
      .def("outputs", [](const Self& self) { return targets_of(self.model.outputs()); })
      .def("used_inputs", [](const Self& self) { return used_inputs(self.model); })
      .def("predict", &predict_by_tree, nb::arg("inputs"), nb::arg("threads") = 0)
      .def("standard_errors", &standard_errors, nb::arg("inputs"), nb::arg("threads") = 0)
      .def("leaf_of", &leaf_of, nb::arg("inputs"), nb::arg("threads") = 0)
      .def("validities", &validities, nb::arg("inputs"), nb::arg("partition"), nb::arg("threads") = 0)
      .def("extrapolation", &extrapolation, nb::arg("inputs"), nb::arg("threads") = 0)
      .def("intervals", &intervals, nb::arg("inputs"), nb::arg("level"), nb::arg("threads") = 0)
      .def("quantiles", &quantiles_of, nb::arg("inputs"), nb::arg("probabilities"), nb::arg("threads") = 0)
      .def("attribute", &attribute_rows, nb::arg("inputs"))
      .def("importance", &importance_of, nb::arg("inputs"), nb::arg("threads") = 0)
      .def(
          "permutation_importance",
          [](const Self& self, const Array& inputs, const Array& outputs, const std::optional<Vector>& weights,
             int repeats, std::uint64_t seed, int threads) {
            const auto rows = static_cast<Eigen::Index>(inputs.shape(0));
            return permutation_importance_of(self, inputs, outputs, weights,
                                             {.repeats = repeats,
                                              .most_rows = std::max(rows, Eigen::Index{10}),
                                              .seed = seed,
                                              .max_threads = threads});
          },
          nb::arg("inputs"), nb::arg("outputs"), nb::arg("weights").none(), nb::arg("repeats"), nb::arg("seed"),
          nb::arg("threads") = 0)
      .def(
          "check",
          [](const Self& self, const Array& inputs, const Array& outputs,
             const std::vector<std::map<std::string, Eigen::Index>>& words, double level, std::vector<double> limits,
             const std::optional<Vector>& weights, int threads) {
            return check_rows(self, self.model.inputs(), &self.model,
                              {inputs, outputs, words, check_options(level, std::move(limits), weights, threads)});
          },
          nb::arg("inputs"), nb::arg("outputs"), nb::arg("words"), nb::arg("level"), nb::arg("limits"),
          nb::arg("weights").none(), nb::arg("threads") = 0)
      .def("to_c", &c_source, nb::arg("name"))
      .def(
          "plain_source",
          [](const Self& self, const std::string& language, const std::string& name) {
            const auto as = language == "c"        ? report::PlainLanguage::c
                            : language == "python" ? report::PlainLanguage::python
                                                   : report::PlainLanguage::sql;
            return report::plain_source(self.model, as, name, "model");
          },
          nb::arg("language"), nb::arg("name"))
      .def("leaves_json", [](const Self& self) { return report::leaves_json(self.model).dump(); })
      .def("leaves_text", [](const Self& self, const std::string& name,
                             std::size_t width) { return report::leaves_text(self.model, name, width); })
      .def("rules_text", [](const Self& self, const std::string& name, std::size_t width) {
        return report::rules_text(self.model, name, width);
      });
}

}  // namespace llmt::python
