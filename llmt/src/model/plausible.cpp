// Whether a model's numbers are such as a fit or a stream makes. Whoever reads a file of unknown origin relies on this:
// a centre or a range far outside of the training extent would turn predictions into any number, without an error.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "model/model_checks.hpp"

namespace llmt {
namespace {

// Numbers may lie outside of a range by these parts of its length and of its largest magnitude. Both are rounding: a
// centre is a mean of up to 2^31 numbers, whose sum is exact to 2^31 * 2^-53 = 2.4e-7 of the largest deviation; and
// deviations are differences of numbers that are exact to 1.1e-16 each. Files that people write have rounded numbers.
constexpr double slack_of_length = 1e-6;
constexpr double slack_of_magnitude = 1e-9;

// Counts above 2^53 are not whole numbers to who reads them as doubles.
constexpr Eigen::Index most_samples = Eigen::Index{1} << 53;

double slack_of(double low, double high) {
  return slack_of_length * (high - low) + slack_of_magnitude * std::max(std::abs(low), std::abs(high));
}

// False where one of the numbers has overflowed.
bool is_outside(double value, double low, double high, double slack) {
  return value < low - slack || value > high + slack;
}

// The values of a regressor in training, not yet as deviations.
RegressorRange values_of(const Regressor& regressor, const std::vector<InputColumn>& inputs) {
  if (regressor.level >= 0) return {0.0, 1.0};
  const InputColumn& input = inputs[regressor.input];
  if (regressor.second_input < 0) return {input.low, input.high};
  const InputColumn& second = inputs[regressor.second_input];
  const double a = input.low - input.centre;
  const double b = input.high - input.centre;
  const double c = second.low - second.centre;
  const double d = second.high - second.centre;
  return {std::min({a * c, a * d, b * c, b * d}), std::max({a * c, a * d, b * c, b * d})};
}

void check_ranges(const Node& node, const ModelPart& part, const std::vector<RegressorRange>& regressors) {
  for (std::size_t k = 0; k < regressors.size(); ++k) {
    const RegressorRange& range = regressors[k];
    const double slack = slack_of(range.low, range.high);
    const auto check = [&](const char* name, double value) {
      if (is_outside(value, range.low, range.high, slack)) {
        throw ModelFault(part, fmt::format("{} of regressor {} is {}, outside of the training extent {} ... {}", name,
                                           k, value, range.low, range.high));
      }
    };
    check("mean", node.mean(k));
    check("low", node.low(k));
    check("high", node.high(k));
  }
}

void check_samples(const Partition& partition, Eigen::Index index) {
  for (Eigen::Index i = 0; i < std::ssize(partition.nodes); ++i) {
    const Node& node = partition.nodes[i];
    if (node.samples > most_samples) {
      throw ModelFault({"partition", index, i}, fmt::format("samples {} is above 2^53", node.samples));
    }
    for (const int child : {node.left, node.right}) {
      // Their sum may be above the parent's: in a stream, whose counts an alarm for a change sets back.
      if (child >= 0 && partition.nodes[child].samples > node.samples) {
        throw ModelFault({"partition", index, child}, fmt::format("samples {} is above that of its parent, {}",
                                                                  partition.nodes[child].samples, node.samples));
      }
    }
  }
}

// The residuals of the root's model lie between the smallest output minus the largest value of the root's model and the
// largest output minus its smallest value. Where signs of slopes are asked for, or one leaf is sparse, the root's model
// has changed a little since; therefore the length of these bounds on both sides. A single linear model that is
// followed within its own range is not held, if the range of residuals contains 0.
void check_residual_range(const Partition& partition, Eigen::Index index, const std::vector<RegressorRange>& regressors,
                          const std::vector<OutputColumn>& outputs) {
  const Node& root = partition.nodes.front();
  for (Eigen::Index o = 0; o < partition.residual_range.rows(); ++o) {
    const double least = partition.residual_range(o, 0);
    const double most = partition.residual_range(o, 1);
    if (root.is_leaf() && least <= 0.0 && most >= 0.0) continue;
    double smallest = root.value(o);
    double largest = root.value(o);
    for (std::size_t k = 0; k < regressors.size(); ++k) {
      const auto [first, last] =
          std::minmax({root.slope(o, k) * regressors[k].low, root.slope(o, k) * regressors[k].high});
      smallest += first;
      largest += last;
    }
    const OutputColumn& output = outputs[partition.outputs[o]];
    const double low = output.low - largest;
    const double high = output.high - smallest;
    const double slack = (high - low) + slack_of(low, high);
    if (is_outside(least, low, high, slack) || is_outside(most, low, high, slack)) {
      throw ModelFault({"partition", index},
                       fmt::format("residual_range {} ... {} of output {} does not go with the range of the output and "
                                   "the root's model, which leave {} ... {}",
                                   least, most, partition.outputs[o], low, high));
    }
  }
}

void check_range_of_predictions(const Partition& partition, Eigen::Index index,
                                const std::vector<OutputColumn>& outputs) {
  for (Eigen::Index o = 0; o < partition.output_range.rows(); ++o) {
    const double low = partition.output_range(o, 0);
    const double high = partition.output_range(o, 1);
    if (std::isinf(low) && std::isinf(high)) continue;  // not clamped
    const OutputColumn& output = outputs[partition.outputs[o]];
    const double slack = slack_of(output.low, output.high);
    if (is_outside(low, output.low, output.high, slack) || is_outside(high, output.low, output.high, slack)) {
      throw ModelFault({"partition", index},
                       fmt::format("output_range {} ... {} of output {} lies outside of its training range {} ... {}",
                                   low, high, partition.outputs[o], output.low, output.high));
    }
  }
}

}  // namespace

std::vector<RegressorRange> check_centres(const std::vector<InputColumn>& inputs,
                                          const std::vector<Regressor>& regressors) {
  const auto check = [](const ModelPart& part, double centre, double low, double high) {
    if (is_outside(centre, low, high, slack_of(low, high))) {
      throw ModelFault(part, fmt::format("centre {} lies outside of the training extent {} ... {}", centre, low, high));
    }
  };
  for (Eigen::Index i = 0; i < std::ssize(inputs); ++i) {
    check({"input", i}, inputs[i].centre, inputs[i].low, inputs[i].high);
  }
  std::vector<RegressorRange> ranges;
  for (Eigen::Index k = 0; k < std::ssize(regressors); ++k) {
    const double centre = regressors[k].centre;
    const auto [low, high] = values_of(regressors[k], inputs);
    check({"regressor", k}, centre, low, high);
    // Rounding of the values themselves stays in the deviations.
    const double rounding = slack_of_magnitude * std::max(std::abs(low), std::abs(high));
    ranges.push_back({low - centre - rounding, high - centre + rounding});
  }
  return ranges;
}

void check_plausible(const Partition& partition, Eigen::Index index, const std::vector<RegressorRange>& regressors,
                     const std::vector<OutputColumn>& outputs) {
  for (Eigen::Index i = 0; i < std::ssize(partition.nodes); ++i) {
    check_ranges(partition.nodes[i], {"partition", index, i}, regressors);
  }
  check_samples(partition, index);
  check_residual_range(partition, index, regressors, outputs);
  check_range_of_predictions(partition, index, outputs);
}

}  // namespace llmt
