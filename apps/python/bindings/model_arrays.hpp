/// \file
/// What the bindings of trees and of sums of trees share.
#pragma once

#include <nanobind/nanobind.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/vector.h>

#include <algorithm>
#include <functional>
#include <string>
#include <utility>
#include <vector>

#include "llmt/partition.hpp"
#include "python/bindings/arrays.hpp"
#include "python/bindings/interruptible.hpp"

namespace llmt::python {

/// Rows that are copied and predicted at a time; signals are looked for in between. By a model of 60 leaves a row is
/// predicted in about 1 us, so that a block takes 10 ms, and less than a second on a busy machine.
inline constexpr Eigen::Index predicted_rows = 10000;

/// Calls `use(first, block)` for blocks of rows, without the interpreter's lock.
inline void for_blocks(const Array& inputs, Eigen::Index rows_at_a_time,
                       const std::function<void(Eigen::Index first, const Eigen::MatrixXd& block)>& use) {
  const Rows rows = rows_of(inputs);
  Eigen::Index first = 0;
  do {
    const Eigen::Index count = std::min(rows_at_a_time, rows.rows() - first);
    {
      const nb::gil_scoped_release unlocked;
      use(first, rows.middleRows(first, count));
    }
    check_signals();
    first += count;
  } while (first < rows.rows());
}

template <class Scalar>
using Matrix = Eigen::Matrix<Scalar, Eigen::Dynamic, Eigen::Dynamic>;

/// The blocks' results below each other.
template <class Scalar>
nb::ndarray<nb::numpy, Scalar, nb::ndim<2>> stacked(
    const Array& inputs, Eigen::Index columns, const std::function<Matrix<Scalar>(const Eigen::MatrixXd& block)>& of) {
  Matrix<Scalar> result(static_cast<Eigen::Index>(inputs.shape(0)), columns);
  for_blocks(inputs, predicted_rows, [&](Eigen::Index first, const Eigen::MatrixXd& block) {
    result.middleRows(first, block.rows()) = of(block);
  });
  return array_of<Scalar>(std::move(result));
}

/// An array for each matrix.
inline auto arrays_of(std::vector<Eigen::MatrixXd> matrices) {
  std::vector<nb::ndarray<nb::numpy, double, nb::ndim<2>>> arrays;
  for (Eigen::MatrixXd& matrix : matrices) arrays.push_back(array_of<double>(std::move(matrix)));
  return arrays;
}

/// Quantiles of all rows, one matrix (rows x probabilities) for each output. `of`: those of a block.
inline auto stacked_quantiles(const Array& inputs, Eigen::Index outputs, const std::vector<double>& probabilities,
                              const std::function<std::vector<Eigen::MatrixXd>(const Eigen::MatrixXd& block)>& of) {
  const auto rows = static_cast<Eigen::Index>(inputs.shape(0));
  std::vector<Eigen::MatrixXd> all(static_cast<std::size_t>(outputs), Eigen::MatrixXd(rows, std::ssize(probabilities)));
  for_blocks(inputs, predicted_rows, [&](Eigen::Index first, const Eigen::MatrixXd& block) {
    const std::vector<Eigen::MatrixXd> part = of(block);
    for (std::size_t o = 0; o < all.size(); ++o) all[o].middleRows(first, block.rows()) = part[o];
  });
  return arrays_of(std::move(all));
}

/// What is known of the inputs.
inline nb::typed<nb::list, nb::typed<nb::dict, nb::str, nb::any>> columns_of(const std::vector<InputColumn>& inputs) {
  nb::typed<nb::list, nb::typed<nb::dict, nb::str, nb::any>> columns;
  for (const InputColumn& input : inputs) {
    nb::dict column;
    column["name"] = input.name;
    column["low"] = input.low;
    column["high"] = input.high;
    column["centre"] = input.centre;
    column["levels"] = input.levels;
    column["codes"] = input.codes;
    columns.append(column);
  }
  return columns;
}

inline std::vector<std::string> targets_of(const std::vector<OutputColumn>& outputs) {
  std::vector<std::string> names;
  for (const OutputColumn& output : outputs) names.push_back(output.name);
  return names;
}

}  // namespace llmt::python
