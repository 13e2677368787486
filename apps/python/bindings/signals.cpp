#include <nanobind/nanobind.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/vector.h>

#include <stdexcept>
#include <string>
#include <vector>

#include "llmt/discovery/signals.hpp"
#include "python/bindings/arrays.hpp"
#include "python/bindings/module.hpp"
#include "report/signals/signals_summary.hpp"

namespace llmt::python {
namespace {

// `runs`: names of the runs, one a row, or empty.
nb::dict signals(const Vector& time, const Array& positions, const Array& torques, std::vector<std::string> runs,
                 const std::string& time_name, std::vector<std::string> position_names,
                 std::vector<std::string> torque_names, const std::string& group, std::vector<std::string> kept,
                 double cutoff, std::vector<double> standstill, Eigen::Index every, bool independent) {
  report::SignalsSummary summary;
  summary.log = "log";
  summary.counted = "row";
  summary.cutoff = cutoff;
  summary.columns = {time_name, std::move(position_names), std::move(torque_names), group, std::move(kept)};
  report::signal_names(summary.columns, true);  // refuses names before the log is filtered
  const discovery::Log log{vector_of(time), rows_of(positions), rows_of(torques), std::move(runs)};
  summary.rows = log.time.size();
  try {
    const nb::gil_scoped_release free;
    summary.signals = discovery::signals(log, {cutoff, std::move(standstill), every, independent});
  } catch (const discovery::LogError& error) {
    throw std::invalid_argument(error.row() < 0 ? std::string("log: ") + error.what()
                                                : "log, row " + std::to_string(error.row()) + ": " + error.what());
  }
  for (const discovery::Stretch& stretch : summary.signals.stretches) {
    summary.firsts.push_back(stretch.first);
    summary.lasts.push_back(stretch.last);
  }
  nb::dict result;
  result["text"] = report::signals_text(summary);
  result["json"] = report::signals_json(summary).dump(-1, ' ', false, report::Json::error_handler_t::replace);
  result["names"] = report::signal_names(summary.columns, summary.signals.dense);
  result["values"] = array_of<double>(report::signal_values(summary.signals));
  const Eigen::VectorXd constants = report::signal_constants(summary);
  result["constants"] = std::vector<double>(constants.begin(), constants.end());
  result["rows"] = summary.signals.rows;
  return result;
}

}  // namespace

void add_signals(nb::module_& module) {
  using nb::arg;
  module.def("signals", &signals, nb::kw_only(), arg("time"), arg("positions"), arg("torques"), arg("runs"),
             arg("time_name"), arg("position_names"), arg("torque_names"), arg("group"), arg("kept"), arg("cutoff"),
             arg("standstill"), arg("every"), arg("independent"));
}

}  // namespace llmt::python
