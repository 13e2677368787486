// Small tables of any numbers, drawn from the bytes of an input.
#pragma once

#include <Eigen/Core>
#include <cmath>
#include <limits>

#include "fuzz/fuzz.hpp"

namespace fuzz {

struct Table {
  Eigen::MatrixXd inputs;
  Eigen::MatrixXd outputs;
  bool has_missing = false;
};

/// What a column is made of: few values or many, all equal, large offsets, large and small scales, another column
/// again.
inline void fill(Eigen::MatrixXd& values, Eigen::Index column, Bytes& bytes) {
  const int kind = bytes.below(8);
  const double offset = bytes.byte() % 4 == 0 ? 1e6 : 0.0;
  static const std::vector<double> scales = {1.0, 1.0, 1.0, 1e-8, 1e8, 1e-30, 1e30, 1e100};
  const double scale = bytes.one_of(scales);
  for (Eigen::Index i = 0; i < values.rows(); ++i) {
    double value = bytes.ordinary();
    if (kind == 0) value = 3.0;
    if (kind == 1) value = std::round(value / 64.0);
    if (kind == 2) value = static_cast<double>(i);
    if (kind == 3 && column > 0) value = values(i, column - 1) / scale;
    values(i, column) = scale * (value + offset);
  }
}

/// `outputs` columns of outputs. Values of inputs are missing only if `missing`.
inline Table table_of(Bytes& bytes, Eigen::Index most_rows, Eigen::Index most_inputs, Eigen::Index outputs,
                      bool missing) {
  const Eigen::Index rows = 1 + bytes.below(static_cast<int>(most_rows));
  Table table{Eigen::MatrixXd(rows, 1 + bytes.below(static_cast<int>(most_inputs))), Eigen::MatrixXd(rows, outputs)};
  for (Eigen::Index j = 0; j < table.inputs.cols(); ++j) fill(table.inputs, j, bytes);
  for (Eigen::Index o = 0; o < outputs; ++o) {
    fill(table.outputs, o, bytes);
    // Outputs that depend on the inputs, so that there is something to split for.
    if (bytes.coin()) table.outputs.col(o) = table.outputs.col(o) * 0.01 + table.inputs.col(0).cwiseAbs();
  }
  for (int k = missing ? bytes.below(8) : 0; k > 0; --k) {
    table.inputs(bytes.below(256) % rows, bytes.below(256) % table.inputs.cols()) =
        std::numeric_limits<double>::quiet_NaN();
    table.has_missing = true;
  }
  return table;
}

}  // namespace fuzz
