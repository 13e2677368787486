// Sums of trees.
#include <nanobind/nanobind.h>
#include <nanobind/stl/map.h>
#include <nanobind/stl/optional.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/tuple.h>
#include <nanobind/stl/unique_ptr.h>
#include <nanobind/stl/vector.h>

#include <algorithm>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <tuple>
#include <vector>

#include "llmt/boosted.hpp"
#include "llmt/boosted_explain.hpp"
#include "llmt/c_source.hpp"
#include "llmt/time_limit.hpp"
#include "python/bindings/checked.hpp"
#include "python/bindings/interruptible.hpp"
#include "python/bindings/model_arrays.hpp"
#include "python/bindings/module.hpp"
#include "python/bindings/options.hpp"
#include "python/bindings/rows.hpp"
#include "report/fit/boosted_summary.hpp"
#include "report/model/boosted_inspection.hpp"

namespace llmt::python {
namespace {

// A sum and, where a time limit was given, what it did.
struct BoostedFit {
  BoostResult result;
  std::optional<TimeLimit> time;
};

std::unique_ptr<BoostedFit> boost_table(const Array& inputs, const Array& outputs, const Options& options,
                                        std::vector<std::string> input_names, std::vector<std::string> output_names,
                                        std::vector<std::vector<std::string>> levels,
                                        const std::optional<Vector>& weights, const std::optional<Vector>& groups,
                                        std::vector<Eigen::Index> held_out, double time_limit,
                                        const nb::object& report) {
  TrainingData data = training_data_of(inputs, outputs, weights, groups);
  data.held_out = std::move(held_out);
  data.levels = std::move(levels);
  data.input_names = std::move(input_names);
  data.output_names = std::move(output_names);
  const BoostOptions boost = boost_options_of(options);
  std::unique_ptr<BoostedFit> fitted;
  interruptible(
      [&](const Progress& progress) {
        if (time_limit == 0.0) {
          fitted = std::make_unique<BoostedFit>(fit_boosted(data, boost, progress), std::nullopt);
          return;
        }
        TimedSum timed = fit_boosted_within(time_limit, data, boost, progress);
        fitted = std::make_unique<BoostedFit>(std::move(timed.result), timed.time);
      },
      report);
  return fitted;
}

auto predict_by_sum(const BoostedModel& self, const Array& inputs, int threads) {
  return stacked<double>(inputs, self.num_outputs(),
                         [&](const Eigen::MatrixXd& block) { return self.predict(block, threads); });
}

// Lower and upper ends; no row is apart, as those of trees that lack an input are.
auto intervals_of_sum(const BoostedModel& self, const Array& inputs, double level, int threads) {
  const Eigen::Index rows = static_cast<Eigen::Index>(inputs.shape(0));
  Bounds bounds{Eigen::MatrixXd(rows, self.num_outputs()), Eigen::MatrixXd(rows, self.num_outputs())};
  for_blocks(inputs, predicted_rows, [&](Eigen::Index first, const Eigen::MatrixXd& block) {
    const Bounds part = self.intervals(block, level, threads);
    bounds.lower.middleRows(first, block.rows()) = part.lower;
    bounds.upper.middleRows(first, block.rows()) = part.upper;
    for (const Eigen::Index row : incomplete_rows(self, block)) bounds.uncalibrated.push_back(first + row);
  });
  return std::make_tuple(array_of<double>(std::move(bounds.lower)), array_of<double>(std::move(bounds.upper)),
                         std::move(bounds.uncalibrated));
}

auto quantiles_of_sum(const BoostedModel& self, const Array& inputs, const std::vector<double>& probabilities,
                      int threads) {
  return stacked_quantiles(inputs, self.num_outputs(), probabilities, [&](const Eigen::MatrixXd& block) {
    return quantiles(self, block, probabilities, threads);
  });
}

// How far rows lie outside of the training ranges; one column, where trees have a second one.
auto extrapolation_of_sum(const BoostedModel& self, const Array& inputs) {
  return stacked<double>(inputs, 1, [&](const Eigen::MatrixXd& block) -> Eigen::MatrixXd {
    const std::vector<double> distance = distance_outside(self, block);
    return Eigen::Map<const Eigen::VectorXd>(distance.data(), std::ssize(distance));
  });
}

// Contributions of all rows, one matrix (rows x inputs) for each output, and the mean prediction of the background.
auto attribute_to_sum(const BoostedModel& self, const Array& inputs, const Array& background, int threads) {
  const Eigen::MatrixXd rows = rows_of(inputs);
  const Eigen::MatrixXd compared = rows_of(background);
  Attributions found;
  interruptible([&](const Progress& progress) { found = attribute_rows(self, rows, compared, threads, progress); },
                nb::none());
  const Eigen::VectorXd& reference = found.reference;
  return std::make_tuple(arrays_of(std::move(found.contributions)),
                         std::vector<double>(reference.begin(), reference.end()));
}

auto importance_in_sum(const BoostedModel& self, const Array& inputs, int threads) {
  const Eigen::MatrixXd rows = rows_of(inputs);
  Eigen::MatrixXd shares;
  interruptible([&](const Progress& progress) { shares = importance(self, rows, threads, progress); }, nb::none());
  return array_of<double>(std::move(shares));
}

auto partial_dependence_of(const BoostedModel& self, const Array& inputs, Eigen::Index input, const Vector& values,
                           int threads) {
  const Eigen::MatrixXd rows = rows_of(inputs);
  const Eigen::VectorXd at = vector_of(values);
  Eigen::MatrixXd means;
  interruptible([&](const Progress& progress) { means = partial_dependence(self, rows, input, at, threads, progress); },
                nb::none());
  return array_of<double>(std::move(means));
}

std::tuple<std::string, std::string> c_source_of_sum(const BoostedModel& self, const std::string& name) {
  CSource written = to_c(self, name, name + ".h");
  return {std::move(written.source), std::move(written.header)};
}

std::vector<Eigen::Index> trees_of(const BoostedModel& self) {
  std::vector<Eigen::Index> trees;
  for (const BoostedSum& sum : self.sums()) trees.push_back(std::ssize(sum.trees));
  return trees;
}

}  // namespace

void add_boosted(nb::module_& module) {
  using Self = BoostedModel;
  nb::class_<Self>(module, "BoostedModel", "A sum of trees for each output.")
      .def(nb::new_([](const std::string& text, const std::string& name) { return boosted_from_json(text, name); }),
           nb::arg("text"), nb::arg("name") = "model", "Reads what to_json() wrote.")
      .def("to_json", [](const Self& self) { return to_json(self); })
      .def_prop_ro("has_intervals", [](const Self& self) { return self.has_intervals(); })
      .def("inputs", [](const Self& self) { return columns_of(self.inputs()); })
      .def("outputs", [](const Self& self) { return targets_of(self.outputs()); })
      .def("used_inputs", [](const Self& self) { return used_inputs(self); })
      .def("trees", &trees_of)
      .def("size",
           [](const Self& self) {
             const BoostedSize size = size_of(self);
             return std::make_tuple(size.trees, size.leaves, size.parameters);
           })
      .def("predict", &predict_by_sum, nb::arg("inputs"), nb::arg("threads") = 0)
      .def(
          "extrapolation",
          [](const Self& self, const Array& inputs, int) { return extrapolation_of_sum(self, inputs); },
          nb::arg("inputs"), nb::arg("threads") = 0)
      .def("intervals", &intervals_of_sum, nb::arg("inputs"), nb::arg("level"), nb::arg("threads") = 0)
      .def("quantiles", &quantiles_of_sum, nb::arg("inputs"), nb::arg("probabilities"), nb::arg("threads") = 0)
      .def("attribute", &attribute_to_sum, nb::arg("inputs"), nb::arg("background"), nb::arg("threads") = 0)
      .def("importance", &importance_in_sum, nb::arg("inputs"), nb::arg("threads") = 0)
      .def("partial_dependence", &partial_dependence_of, nb::arg("inputs"), nb::arg("input"), nb::arg("values"),
           nb::arg("threads") = 0)
      .def(
          "check",
          [](const Self& self, const Array& inputs, const Array& outputs,
             const std::vector<std::map<std::string, Eigen::Index>>& words, double level, std::vector<double> limits,
             const std::optional<Vector>& weights, int threads) {
            return check_rows(self, self.inputs(), nullptr,
                              {inputs, outputs, words, check_options(level, std::move(limits), weights, threads)});
          },
          nb::arg("inputs"), nb::arg("outputs"), nb::arg("words"), nb::arg("level"), nb::arg("limits"),
          nb::arg("weights").none(), nb::arg("threads") = 0)
      .def("to_c", &c_source_of_sum, nb::arg("name"))
      .def("text", [](const Self& self, const std::string& name, std::size_t width) {
        return report::boosted_inspection_text(self, name, width);
      });
  nb::class_<BoostedFit>(module, "BoostFit", "A boosted fit with all that reports need of it.")
      .def("model", [](const BoostedFit& self) { return self.result.model; })
      .def("summary",
           [](const BoostedFit& self, const std::string& data) {
             return report::boosted_json({.data = data, .output = "", .time = self.time}, self.result).dump();
           })
      .def("text", [](const BoostedFit& self, const std::string& data, std::size_t width) {
        return report::boosted_text({.data = data, .output = "", .time = self.time}, self.result, width);
      });
  module.def("boost", &boost_table, nb::arg("inputs"), nb::arg("outputs"), nb::arg("options"), nb::kw_only(),
             nb::arg("input_names"), nb::arg("output_names"), nb::arg("levels"), nb::arg("weights") = nb::none(),
             nb::arg("groups") = nb::none(), nb::arg("held_out") = std::vector<Eigen::Index>(),
             nb::arg("time_limit") = 0.0, nb::arg("report") = nb::none());
}

}  // namespace llmt::python
