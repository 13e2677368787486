#include "llmt/explain.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "base/checks.hpp"
#include "base/parallel.hpp"
#include "explain/line_attribution.hpp"
#include "model/codes.hpp"
#include "partition/evaluator.hpp"

namespace llmt {
namespace {

std::vector<Evaluator> evaluators_of(const Model& model) {
  std::vector<Evaluator> evaluators;
  for (const Partition& partition : model.partitions()) {
    evaluators.emplace_back(partition, model.inputs(), std::ssize(model.regressors()));
  }
  return evaluators;
}

Attribution attribute_with(const Model& model, const std::vector<Evaluator>& evaluators,
                           const Eigen::Ref<const Eigen::VectorXd>& point,
                           const Eigen::Ref<const Eigen::VectorXd>& reference, const Precision& precision) {
  Attribution result{Eigen::VectorXd(model.num_outputs()), Eigen::VectorXd(model.num_outputs()),
                     Eigen::MatrixXd(model.num_outputs(), model.num_inputs())};
  const Eigen::VectorXd to = at_positions(model.inputs(), point.transpose()).transpose();
  const Eigen::VectorXd from = at_positions(model.inputs(), reference.transpose()).transpose();
  for (std::size_t p = 0; p < evaluators.size(); ++p) {
    const Partition& partition = model.partitions()[p];
    const LineAttribution part = attribute_along_line(model, partition, evaluators[p], to, from, precision);
    result.prediction(partition.outputs) = part.prediction;
    result.reference(partition.outputs) = part.reference;
    result.contributions(partition.outputs, Eigen::all) = part.contributions;
  }
  return result;
}

void check_point(const char* argument, const Model& model, const Eigen::Ref<const Eigen::VectorXd>& point) {
  if (point.size() != model.num_inputs()) {
    throw std::invalid_argument(fmt::format("llmt::attribute: {} has {} entries, the model has {} inputs", argument,
                                            point.size(), model.num_inputs()));
  }
  check_finite_or_missing("llmt::attribute", argument, point);
}

}  // namespace

Eigen::VectorXd reference_point(const Model& model) {
  Eigen::VectorXd reference(model.num_inputs());
  std::transform(model.inputs().begin(), model.inputs().end(), reference.begin(), [](const InputColumn& input) {
    if (input.has_empty_level() && input.codes.empty()) return no_level;
    return input.is_categorical() ? std::numeric_limits<double>::quiet_NaN() : input.centre;
  });
  return reference;
}

Attribution attribute(const Model& model, const Eigen::Ref<const Eigen::VectorXd>& point,
                      const Eigen::Ref<const Eigen::VectorXd>& reference) {
  check_point("point", model, point);
  check_point("reference", model, reference);
  return attribute_with(model, evaluators_of(model), point, reference, fine);
}

Attribution attribute(const Model& model, const Eigen::Ref<const Eigen::VectorXd>& point) {
  return attribute(model, point, reference_point(model));
}

Eigen::MatrixXd importance(const Model& model, const Eigen::Ref<const Eigen::MatrixXd>& inputs, int max_threads,
                           const Progress& progress) {
  if (inputs.rows() < 1 || inputs.cols() != model.num_inputs()) {
    throw std::invalid_argument(
        fmt::format("llmt::importance: inputs is {} x {}, it must have a row and the model's {} inputs", inputs.rows(),
                    inputs.cols(), model.num_inputs()));
  }
  check_finite_or_missing("llmt::importance", "inputs", inputs);
  const std::vector<Evaluator> evaluators = evaluators_of(model);
  const Eigen::VectorXd reference = reference_point(model);
  const Eigen::Index count = std::min(inputs.rows(), importance_rows);
  std::vector<Eigen::MatrixXd> of_row(count);
  Work work(progress);
  parallel_for(count, max_threads, [&](Eigen::Index k) {
    const Eigen::VectorXd point = inputs.row(k * inputs.rows() / count).transpose();
    of_row[k] = attribute_with(model, evaluators, point, reference, coarse).contributions.cwiseAbs();
    work.did(1.0 / static_cast<double>(count));
  });
  Eigen::MatrixXd sum = Eigen::MatrixXd::Zero(model.num_outputs(), model.num_inputs());
  for (const Eigen::MatrixXd& contributions : of_row) {
    sum += contributions;
  }
  for (Eigen::Index o = 0; o < sum.rows(); ++o) {
    const OutputColumn& output = model.outputs()[o];
    const double rounding = 1e-14 * std::max(std::abs(output.low), std::abs(output.high));
    const double total = sum.row(o).sum();
    sum.row(o) *= total > rounding * static_cast<double>(count) ? 1.0 / total : 0.0;
  }
  work.finish();
  return sum;
}

}  // namespace llmt
