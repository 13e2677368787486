// Models of systems that move.
#include <nanobind/nanobind.h>
#include <nanobind/stl/complex.h>
#include <nanobind/stl/optional.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/tuple.h>
#include <nanobind/stl/unique_ptr.h>
#include <nanobind/stl/vector.h>

#include <algorithm>
#include <cmath>
#include <complex>
#include <memory>
#include <optional>
#include <string>
#include <tuple>
#include <vector>

#include "llmt/dynamic_analysis.hpp"
#include "llmt/dynamic_source.hpp"
#include "llmt/fit_dynamic.hpp"
#include "llmt/run_band.hpp"
#include "llmt/simulator.hpp"
#include "llmt/static_curve.hpp"
#include "python/bindings/arrays.hpp"
#include "python/bindings/interruptible.hpp"
#include "python/bindings/module.hpp"
#include "report/dynamic/dynamic_report.hpp"
#include "report/dynamic/local_words.hpp"

namespace llmt::python {
namespace {

struct FittedSystem {
  Series series;
  std::optional<DynamicFit> fit = {};  // always there where Python sees it
  Eigen::Index horizon = 0;
};

Series series_from(const Array& inputs, const Array& outputs, std::vector<std::string> input_names,
                   std::vector<std::string> output_names, std::vector<Eigen::Index> records, double sample_time,
                   std::string time_unit) {
  Series series;
  series.inputs = rows_of(inputs);
  series.outputs = rows_of(outputs);
  series.input_names = std::move(input_names);
  series.output_names = std::move(output_names);
  series.record_begins = std::move(records);
  series.sample_time = sample_time;
  series.time_unit = std::move(time_unit);
  return series;
}

std::unique_ptr<FittedSystem> fit_system(const Array& inputs, const Array& outputs,
                                         std::vector<std::string> input_names, std::vector<std::string> output_names,
                                         std::vector<Eigen::Index> records, double sample_time, std::string time_unit,
                                         const std::string& lags, const std::string& delay, Eigen::Index horizon,
                                         const std::string& rest, int threads, const nb::object& report) {
  auto fitted = std::make_unique<FittedSystem>();
  fitted->series = series_from(inputs, outputs, std::move(input_names), std::move(output_names), std::move(records),
                               sample_time, std::move(time_unit));
  fitted->horizon = horizon;
  check_series(fitted->series);
  DynamicOptions options;
  options.horizon = horizon;
  options.max_threads = threads;
  if (lags != "auto") options.lags = parse_lags(lags, fitted->series.input_names, fitted->series.output_names);
  if (delay == "auto") {
    options.delays.assign(fitted->series.input_names.size(), find_delay);
  } else if (!delay.empty()) {
    options.delays = parse_delays(delay, fitted->series.input_names, options.lags ? 0 : find_delay);
  }
  if (rest == "none") {
    options.rest = RestLearner::none;
  } else if (rest == "sum") {
    options.rest = RestLearner::sum;
  } else if (rest == "readable") {
    options.rest = RestLearner::readable;
  } else if (rest != "auto") {
    options.rest = RestLearner::tree;
    options.rule = parse<GrowthRule>(rest);
  }
  interruptible([&](const Progress& progress) { fitted->fit = fit_dynamic(fitted->series, options, progress); },
                report);
  return fitted;
}

auto run_system(const DynamicModel& self, const Array& inputs, const Array& initial) {
  Run run = simulate(self, rows_of(inputs), rows_of(initial));
  return std::make_tuple(array_of<double>(std::move(run.outputs)), run.left_at, run.outside_at);
}

// The ends of the band about the run.
auto band_of_run(const DynamicModel& self, const Array& inputs, const Array& initial, double level) {
  Bounds bounds = run_bounds(self, simulate(self, rows_of(inputs), rows_of(initial)), level);
  return std::make_tuple(array_of<double>(std::move(bounds.lower)), array_of<double>(std::move(bounds.upper)));
}

auto states_of_rest(const DynamicModel& self, Eigen::Index input, Eigen::Index points) {
  const StaticCurve curve = static_curve(self, input, points);
  const Eigen::Index count = std::ssize(curve.points);
  Eigen::MatrixXd inputs(count, 1);
  Eigen::MatrixXd outputs(count, self.num_outputs());
  std::vector<bool> stable;
  std::vector<bool> inside;
  std::vector<bool> at_stop;
  for (Eigen::Index k = 0; k < count; ++k) {
    const RestPoint& point = curve.points[k];
    inputs(k, 0) = point.input;
    outputs.row(k) = point.outputs.transpose();
    stable.push_back(point.is_stable);
    inside.push_back(point.is_inside);
    at_stop.push_back(point.is_at_stop);
  }
  return std::make_tuple(array_of<double>(std::move(inputs)), array_of<double>(std::move(outputs)), stable, inside,
                         at_stop, curve.none);
}

// Predictions of the next row from measured ones; the first rows, which have no past, are NaN.
auto next_rows_of(const DynamicModel& self, const Array& inputs, const Array& outputs) {
  const Eigen::MatrixXd u = rows_of(inputs);
  const Eigen::MatrixXd y = rows_of(outputs);
  const Eigen::Index given = std::max<Eigen::Index>(self.memory(), 1);
  Eigen::MatrixXd predicted = Eigen::MatrixXd::Constant(y.rows(), y.cols(), std::nan(""));
  if (y.rows() > given) {
    Simulator simulator(self);
    simulator.start(u.topRows(given), y.topRows(given));
    for (Eigen::Index row = given; row < y.rows(); ++row) {
      predicted.row(row) = simulator.step(u.row(row).transpose(), y.row(row).transpose()).transpose();
    }
  }
  return array_of<double>(std::move(predicted));
}

std::vector<std::tuple<std::string, std::vector<std::complex<double>>>> poles_of(const DynamicModel& self) {
  std::vector<std::tuple<std::string, std::vector<std::complex<double>>>> all;
  for (const LocalDynamics& local : local_dynamics(self)) {
    std::vector<std::complex<double>> poles;
    for (const Pole& pole : local.poles) poles.push_back(pole.z);
    all.emplace_back(local.where, std::move(poles));
  }
  return all;
}

std::vector<std::string> signal_names(const std::vector<Signal>& signals) {
  std::vector<std::string> result;
  for (const Signal& signal : signals) result.push_back(signal.name);
  return result;
}

}  // namespace

void add_dynamics(nb::module_& module) {
  nb::class_<DynamicModel>(module, "DynamicModel")
      .def_static(
          "load",
          [](const nb::bytes& path) {
            return load_dynamic({path.c_str(), path.size()});
          },
          nb::arg("path"))
      .def_static("parse", &dynamic_from_json, nb::arg("text"), nb::arg("name"))
      .def("to_json", [](const DynamicModel& self) { return to_json(self); })
      .def("memory", &DynamicModel::memory)
      .def("sample_time", [](const DynamicModel& self) { return self.parts().sample_time; })
      .def("is_stable", [](const DynamicModel& self) { return self.parts().is_stable; })
      .def("inputs", [](const DynamicModel& self) { return signal_names(self.parts().inputs); })
      .def("outputs", [](const DynamicModel& self) { return signal_names(self.parts().outputs); })
      .def("lags",
           [](const DynamicModel& self) {
             return text_of(self.parts().lags, signal_names(self.parts().inputs), signal_names(self.parts().outputs));
           })
      .def("simulate", &run_system, nb::arg("inputs"), nb::arg("initial"))
      .def("predict", &next_rows_of, nb::arg("inputs"), nb::arg("outputs"))
      .def("band", &band_of_run, nb::arg("inputs"), nb::arg("initial"), nb::arg("level"))
      .def("has_band", [](const DynamicModel& self) { return !self.parts().band.outputs.empty(); })
      .def("local_models", [](const DynamicModel& self) { return report::local_json(self).dump(); })
      .def("static_curve", &states_of_rest, nb::arg("input"), nb::arg("points"))
      .def("poles", &poles_of)
      .def(
          "c_source",
          [](const DynamicModel& self, const std::string& name) {
            CSource written = to_c(self, name, name + ".h");
            return std::make_tuple(std::move(written.source), std::move(written.header));
          },
          nb::arg("name"));
  nb::class_<FittedSystem>(module, "FittedSystem")
      .def("model", [](const FittedSystem& self) { return self.fit->model; })
      .def("simulated", [](const FittedSystem& self) { return array_of<double>(self.fit->simulated); })
      .def("held_out", [](const FittedSystem& self) { return array_of<double>(self.fit->held_out); })
      .def(
          "summary",
          [](const FittedSystem& self, const std::string& data) {
            return report::dynamic_json({data, "", self.series, *self.fit, self.horizon}).dump();
          },
          nb::arg("data"))
      .def(
          "text",
          [](const FittedSystem& self, const std::string& data, std::size_t width) {
            return report::dynamic_text({data, "", self.series, *self.fit, self.horizon}, width);
          },
          nb::arg("data"), nb::arg("width"));
  module.def("fit_system", &fit_system, nb::arg("inputs"), nb::arg("outputs"), nb::arg("input_names"),
             nb::arg("output_names"), nb::arg("records"), nb::arg("sample_time"), nb::arg("time_unit"), nb::arg("lags"),
             nb::arg("delay"), nb::arg("horizon"), nb::arg("rest"), nb::arg("threads"), nb::arg("report").none());
}

}  // namespace llmt::python
