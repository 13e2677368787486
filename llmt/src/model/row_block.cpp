#include "model/row_block.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "base/simd.hpp"
#include "model/held_product.hpp"
#include "model/local_models.hpp"

namespace llmt {
namespace {

struct Oddities {
  bool missing;
  bool infinite;
};

LLMT_FOR_EACH_INSTRUCTION_SET
Oddities oddities_of(const double* values, Eigen::Index size) {
  // Counting, unlike stopping at the first one, is done several values at a time.
  Eigen::Index missing = 0;
  Eigen::Index infinite = 0;
  for (Eigen::Index i = 0; i < size; ++i) {
    missing += values[i] != values[i] ? 1 : 0;
    infinite += std::abs(values[i]) > std::numeric_limits<double>::max() ? 1 : 0;
  }
  return {missing > 0, infinite > 0};
}

void set_deviations(const Eigen::Ref<const Eigen::MatrixXd>& inputs, const std::vector<InputColumn>& columns,
                    const std::vector<Regressor>& regressors, Eigen::Index stride, double* deviations) {
  constexpr Eigen::Index tile = 16;  // rows that stay in the first cache while their columns come in
  for (Eigen::Index begin = 0; begin < inputs.rows(); begin += tile) {
    const Eigen::Index end = std::min(inputs.rows(), begin + tile);
    for (std::size_t k = 0; k < regressors.size(); ++k) {
      const Regressor& regressor = regressors[k];
      const double* x = inputs.col(regressor.input).data();
      const double centre = regressor.centre;
      double* out = deviations + k;
      if (regressor.second_input >= 0) {
        const InputColumn& first = columns[regressor.input];
        const InputColumn& second = columns[regressor.second_input];
        const double* z = inputs.col(regressor.second_input).data();
        for (Eigen::Index row = begin; row < end; ++row) {
          out[row * stride] = factor_at(first, x[row]) * factor_at(second, z[row]) - centre;
        }
      } else if (regressor.level < 0) {
        for (Eigen::Index row = begin; row < end; ++row) {
          out[row * stride] = x[row] - centre;
        }
      } else {
        const std::size_t levels = columns[regressor.input].levels.size();
        for (Eigen::Index row = begin; row < end; ++row) {
          out[row * stride] = indicator_deviation(x[row], regressor.level, static_cast<double>(levels), centre);
        }
      }
    }
  }
}

}  // namespace

Eigen::Index rows_of_block(Eigen::Index inputs, Eigen::Index regressors, Eigen::Index depth) {
  constexpr Eigen::Index cached = 49152;  // doubles
  constexpr Eigen::Index most_waiting = 1 << 20;
  return std::min(std::clamp<Eigen::Index>(cached / (inputs + padded_to_quads(regressors)), 256, 4096),
                  std::max<Eigen::Index>(most_waiting / (depth + 1), 1));
}

RowBlock make_row_block(const Eigen::Ref<const Eigen::MatrixXd>& inputs, const std::vector<InputColumn>& columns,
                        const std::vector<Regressor>& regressors) {
  const Eigen::Index rows = inputs.rows();
  RowBlock block{.inputs = inputs, .stride = padded_to_quads(std::ssize(regressors))};
  for (const auto column : inputs.colwise()) {
    const Oddities oddities = oddities_of(column.data(), rows);
    block.has_missing.push_back(oddities.missing);
    block.has_infinite = block.has_infinite || oddities.infinite;
  }
  block.deviations.resize(rows * block.stride);
  set_deviations(inputs, columns, regressors, block.stride, block.deviations.data());
  return block;
}

}  // namespace llmt
