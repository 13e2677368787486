#include "partition/local_models.hpp"

#include <cmath>

#include "base/simd.hpp"
#include "partition/clamped_product.hpp"
#include "partition/smooth_clamp.hpp"
#include "partition/tree.hpp"

namespace llmt {
namespace {

// The range of the root's residuals is widened at both ends by this fraction (docs/algorithms/guards.md, B.3).
constexpr double output_margin = 0.1;

// A row of deviations padded with zeros.
struct PaddedRow {
  const double* at;
  LLMT_INLINE Quad operator()(Eigen::Index k) const { return load_quad(at + k); }
};

// A row of deviations as it comes.
struct BareRow {
  const double* at;
  Eigen::Index size;
  LLMT_INLINE Quad operator()(Eigen::Index k) const { return load_quad(at + k, size - k); }
};

}  // namespace

void deviations_at(const std::vector<InputColumn>& inputs, const std::vector<Regressor>& regressors, const double* row,
                   double* deviations) {
  for (std::size_t k = 0; k < regressors.size(); ++k) {
    const Regressor& regressor = regressors[k];
    const std::size_t input = regressor.input;
    if (regressor.second_input >= 0) {
      const std::size_t second = regressor.second_input;
      deviations[k] = factor_at(inputs[input], row[input]) * factor_at(inputs[second], row[second]) - regressor.centre;
      continue;
    }
    deviations[k] = regressor.level < 0
                        ? row[input] - regressor.centre
                        : indicator_deviation(row[input], regressor.level,
                                              static_cast<double>(inputs[input].levels.size()), regressor.centre);
  }
}

LocalModels::LocalModels(const Partition& partition, Eigen::Index regressors)
    : outputs_(std::ssize(partition.outputs)),
      regressors_(regressors),
      stride_(padded_to_quads(regressors)),
      parents_(parents_of(partition)) {
  if (partition.residual_range.size() > 0) {
    const Eigen::VectorXd margin = output_margin * (partition.residual_range.col(1) - partition.residual_range.col(0));
    residual_range_ = partition.residual_range;
    residual_range_.col(0) -= margin;
    residual_range_.col(1) += margin;
  }
  const auto append = [&](std::vector<double>& to, const auto& values) {
    to.insert(to.end(), values.begin(), values.end());
    to.resize(to.size() + (stride_ - regressors_), 0.0);
  };
  data_.reserve(partition.nodes.size() * ((3 + outputs_) * stride_));
  for (const Node& node : partition.nodes) {
    append(data_, node.low);
    append(data_, node.high);
    append(data_, node.mean);
    for (Eigen::Index o = 0; o < outputs_; ++o) {
      append(data_, node.slope.row(o));
    }
    values_.insert(values_.end(), node.value.begin(), node.value.end());
  }
  const Eigen::MatrixXd& outer =
      partition.outer_slope.size() > 0 ? partition.outer_slope : partition.nodes.front().slope;
  for (Eigen::Index o = 0; o < outputs_; ++o) {
    append(outer_slopes_, outer.row(o));
  }
}

// Whether the row lies in the node's range. Sets `first` to the local model of the first output without guards, which
// costs little beside the check.
template <class Row>
LLMT_INLINE bool LocalModels::sum_inside(int node, const Row& row, double& first) const {
  const double* lows = low(node);
  const double* highs = high(node);
  const double* slope = slopes(node, 0);
  QuadMask inside = ~QuadMask{};
  Quad sum = {};
  for (Eigen::Index k = 0; k < stride_; k += quad) {
    const Quad d = row(k);
    inside &= (d >= load_quad(lows + k)) & (d <= load_quad(highs + k));
    sum += load_quad(slope + k) * d;
  }
  first = value(node, 0) + sum_of(sum);
  return all_of(inside);
}

template <class Row>
LLMT_INLINE double LocalModels::sum(int node, Eigen::Index output, const Row& row) const {
  const double* slope = slopes(node, output);
  Quad sum = {};
  for (Eigen::Index k = 0; k < stride_; k += quad) {
    sum += load_quad(slope + k) * row(k);
  }
  return value(node, output) + sum_of(sum);
}

// The local model (B.2) at a row that lies outside the node's range or lacks a value.
template <class Row>
LLMT_INLINE double LocalModels::guarded(int node, Eigen::Index output, const Row& row) const {
  Quad sum = {};
  for (Eigen::Index k = 0; k < stride_; k += quad) {
    const Quad d = row(k);
    const QuadMask missing = d != d;
    Quad held =
        missing ? load_quad(mean(node) + k) : smooth_clamp(d, load_quad(low(node) + k), load_quad(high(node) + k));
    sum += load_quad(slopes(node, output) + k) * held;
    QuadMask outside = ~missing & (held != d);
    int left = most_ancestors;
    for (int at = next_ancestor(parents_, node, left); at >= 0 && any_of(outside);
         at = next_ancestor(parents_, at, left)) {
      const Quad reached = outside ? smooth_clamp(d, load_quad(low(at) + k), load_quad(high(at) + k)) : held;
      sum += load_quad(slopes(at, output) + k) * (reached - held);
      held = reached;
      outside &= held != d;
    }
  }
  return value(node, output) + sum_of(sum);
}

template <class Row>
LLMT_INLINE double LocalModels::beyond_root(Eigen::Index output, const Row& row) const {
  Quad sum = {};
  for (Eigen::Index k = 0; k < stride_; k += quad) {
    const Quad d = row(k);
    const Quad beyond = d != d ? Quad{} : d - smooth_clamp(d, load_quad(low(0) + k), load_quad(high(0) + k));
    sum += load_quad(outer_slopes(output) + k) * beyond;
  }
  return sum_of(sum);
}

template <class Row>
LLMT_INLINE void LocalModels::add_row(int node, double validity, const Row& row, double* sums) const {
  double first = 0.0;
  if (sum_inside(node, row, first)) {
    sums[0] += validity * first;
    for (Eigen::Index o = 1; o < outputs_; ++o) {
      sums[o] += validity * sum(node, o, row);
    }
  } else {
    for (Eigen::Index o = 0; o < outputs_; ++o) {
      sums[o] += validity * guarded(node, o, row);
    }
  }
}

template <class Row>
LLMT_INLINE bool LocalModels::hold_row(const Row& row, double* values) const {
  double first = 0.0;
  const bool inside = sum_inside(0, row, first);
  for (Eigen::Index o = 0; o < residual_range_.rows(); ++o) {
    const double root = !inside ? guarded(0, o, row) : o == 0 ? first : sum(0, o, row);
    values[o] = root + smooth_clamp(values[o] - root, residual_range_(o, 0), residual_range_(o, 1));
  }
  return inside;
}

template <class Row>
LLMT_INLINE void LocalModels::finish_row(const Row& row, double* values) const {
  const bool inside = hold_row(row, values);
  for (Eigen::Index o = 0; !inside && o < outputs_; ++o) {
    values[o] += beyond_root(o, row);
  }
}

LLMT_FOR_EACH_INSTRUCTION_SET
void LocalModels::add(int node, double validity, const double* deviations, double* sums) const {
  add_row(node, validity, BareRow{deviations, regressors_}, sums);
}

LLMT_FOR_EACH_INSTRUCTION_SET
void LocalModels::finish(const double* deviations, double* values) const {
  finish_row(BareRow{deviations, regressors_}, values);
}

LLMT_FOR_EACH_INSTRUCTION_SET
bool LocalModels::hold(const double* deviations, double* values) const {
  return hold_row(BareRow{deviations, regressors_}, values);
}

void LocalModels::beyond(const double* deviations, double* by_regressor) const {
  for (Eigen::Index k = 0; k < regressors_; ++k) {
    const double d = deviations[k];
    by_regressor[k] = std::isnan(d) ? 0.0 : d - smooth_clamp(d, low(0)[k], high(0)[k]);
  }
}

LLMT_FOR_EACH_INSTRUCTION_SET
void LocalModels::add(int node, const RowList& list, const double* deviations, double* sums) const {
  for (Eigen::Index i = 0; i < list.count; ++i) {
    const Eigen::Index row = list.rows[i];
    add_row(node, list.validities[i], PaddedRow{deviations + row * stride_}, sums + row * outputs_);
  }
}

LLMT_FOR_EACH_INSTRUCTION_SET
void LocalModels::finish_rows(Eigen::Index rows, const double* deviations, double* values) const {
  for (Eigen::Index row = 0; row < rows; ++row) {
    finish_row(PaddedRow{deviations + row * stride_}, values + row * outputs_);
  }
}

}  // namespace llmt
