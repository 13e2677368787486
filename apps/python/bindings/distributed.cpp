#include "llmt/distributed.hpp"

#include <nanobind/nanobind.h>
#include <nanobind/stl/optional.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/vector.h>

#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "python/bindings/arrays.hpp"
#include "python/bindings/interruptible.hpp"
#include "python/bindings/module.hpp"
#include "python/bindings/options.hpp"

namespace llmt::python {
namespace {

using distributed::State;
using distributed::Sums;

std::string_view view_of(const nb::bytes& bytes) { return {bytes.c_str(), bytes.size()}; }
nb::bytes bytes_of(const std::string& text) { return nb::bytes(text.data(), text.size()); }

nb::bytes start(std::vector<std::string> input_names, std::string output_name, Eigen::Index branch_rows,
                Eigen::Index sample_rows, Eigen::Index block_rows, bool weighted,
                std::vector<std::vector<std::string>> levels, bool may_have_codes, const Options& options) {
  const distributed::Options given{.branch_rows = branch_rows,
                                   .sample_rows = sample_rows,
                                   .block_rows = block_rows,
                                   .weighted = weighted,
                                   .levels = std::move(levels),
                                   .fit = options_of(options),
                                   .may_have_codes = may_have_codes};
  return bytes_of(distributed::start(std::move(input_names), std::move(output_name), given).to_bytes());
}

nb::bytes sums(const nb::bytes& state, const Array& inputs, const Vector& output, Eigen::Index first_block,
               int max_threads, const std::optional<Vector>& weights) {
  std::string bytes;
  {
    const nb::gil_scoped_release unlocked;
    const Eigen::VectorXd values = vector_of(output);
    const distributed::Rows rows{rows_of(inputs), values, first_block,
                                 weights ? vector_of(*weights) : Eigen::VectorXd()};
    bytes = distributed::sums(rows, State::from_bytes(view_of(state)), max_threads).to_bytes();
  }
  return bytes_of(bytes);
}

nb::bytes merge(const std::vector<nb::bytes>& parts) {
  std::string bytes;
  {
    const nb::gil_scoped_release unlocked;
    Sums all;
    for (const nb::bytes& part : parts) all = merge(std::move(all), Sums::from_bytes(view_of(part)));
    bytes = all.to_bytes();
  }
  return bytes_of(bytes);
}

nb::bytes advance(const nb::bytes& state, const nb::bytes& sums, int max_threads, const nb::object& report) {
  std::string bytes;
  interruptible(
      [&](const Progress& progress) {
        const State before = State::from_bytes(view_of(state));
        bytes = distributed::advance(before, Sums::from_bytes(view_of(sums)), progress, max_threads).to_bytes();
      },
      report);
  return bytes_of(bytes);
}

nb::dict status(const nb::bytes& bytes) {
  const State state = State::from_bytes(view_of(bytes));
  const distributed::Counts counts = state.counts();
  nb::dict result;
  result["step"] = std::string(name_of(state.step()));
  result["passes"] = counts.passes;
  result["rows"] = counts.rows;
  result["top_leaves"] = counts.top_leaves;
  result["branches"] = counts.branches;
  result["branches_done"] = counts.branches_done;
  result["rows_to_come"] = counts.rows_to_come;
  result["is_of_sample"] = counts.is_of_sample;
  result["held_out_rmse"] = counts.held_out_rmse;
  return result;
}

}  // namespace

void add_distributed(nb::module_& module) {
  module.def("distributed_start", &start, nb::arg("input_names"), nb::arg("output_name"), nb::arg("branch_rows"),
             nb::arg("sample_rows"), nb::arg("block_rows"), nb::arg("weighted"), nb::arg("levels"),
             nb::arg("may_have_codes"), nb::arg("options"));
  module.def("distributed_sums", &sums, nb::arg("state"), nb::arg("inputs"), nb::arg("output"), nb::arg("first_block"),
             nb::arg("max_threads"), nb::arg("weights").none());
  module.def("distributed_merge", &merge, nb::arg("parts"));
  module.def("distributed_advance", &advance, nb::arg("state"), nb::arg("sums"), nb::arg("max_threads"),
             nb::arg("report"));
  module.def("distributed_status", &status, nb::arg("state"));
  module.def("distributed_levels", [](const nb::bytes& state) { return State::from_bytes(view_of(state)).levels(); });
  module.def("distributed_model",
             [](const nb::bytes& state) { return State::from_bytes(view_of(state)).model_json(); });
  module.def("distributed_continues", [](const nb::bytes& state, const nb::bytes& first) {
    return State::from_bytes(view_of(state)).continues(State::from_bytes(view_of(first)));
  });
}

}  // namespace llmt::python
