#include "check/check_inputs.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "numerics/two_samples.hpp"

namespace llmt {
namespace {

constexpr double not_known = std::numeric_limits<double>::quiet_NaN();

// Standard deviation of the values in a record.
double deviation_of(const InputRecord& record) {
  const auto rows = static_cast<double>(record.rows());
  if (record.values.empty() || rows == 0.0) return not_known;
  double sum = 0.0;
  for (std::size_t k = 0; k < record.values.size(); ++k)
    sum += record.values[k] * static_cast<double>(record.counts[k]);
  double squares = 0.0;
  for (std::size_t k = 0; k < record.values.size(); ++k) {
    const double deviation = record.values[k] - sum / rows;
    squares += deviation * deviation * static_cast<double>(record.counts[k]);
  }
  return std::sqrt(squares / rows);
}

double share(Eigen::Index part, Eigen::Index all) {
  return all == 0 ? 0.0 : static_cast<double>(part) / static_cast<double>(all);
}

// Whether the value of a category is none that training had.
bool is_unknown(const InputColumn& column, double given, double position) {
  if (!column.codes.empty() && !std::isnan(given)) return !std::ranges::binary_search(column.codes, given);
  const auto levels = static_cast<double>(column.levels.size());
  return !std::isnan(position) && !(position >= 0.0 && position < levels && position == std::floor(position));
}

CheckedInput check_numbers(const InputColumn& column, const Eigen::Ref<const Eigen::VectorXd>& values,
                           const InputRecord& record) {
  CheckedInput found;
  found.training_mean = column.centre;
  std::vector<double> present;
  double sum = 0.0;
  for (const double value : values) {
    if (std::isnan(value)) continue;
    present.push_back(value);
    sum += value;
    found.below += value < column.low ? 1 : 0;
    found.above += value > column.high ? 1 : 0;
  }
  const Eigen::Index count = std::ssize(present);
  found.missing = values.size() - count;
  found.mean = count == 0 ? not_known : sum / static_cast<double>(count);
  found.shift = (found.mean - found.training_mean) / deviation_of(record);
  if (!std::isfinite(found.shift)) found.shift = not_known;
  if (record.empty()) {
    found.probability = not_known;
    return found;
  }
  const Eigen::Index known = record.rows();
  found.probability = std::min({same_numbers_probability({record.values, record.counts}, std::move(present)),
                                beyond_largest_probability(found.below, count, known),
                                beyond_largest_probability(found.above, count, known)}) *
                      3.0;
  return found;
}

CheckedInput check_categories(const InputColumn& column, const Eigen::Ref<const Eigen::VectorXd>& given,
                              const Eigen::Ref<const Eigen::VectorXd>& positions, const InputRecord& record) {
  CheckedInput found;
  found.mean = found.training_mean = found.shift = not_known;
  std::vector<Eigen::Index> counts(column.levels.size(), 0);
  for (Eigen::Index row = 0; row < given.size(); ++row) {
    if (is_unknown(column, given(row), positions(row))) {
      ++found.unknown;
    } else if (std::isnan(positions(row))) {
      ++found.missing;
    } else {
      ++counts[static_cast<std::size_t>(positions(row))];
    }
  }
  found.probability = record.empty() ? not_known : same_shares_probability(record.counts, counts);
  return found;
}

}  // namespace

std::vector<CheckedInput> check_inputs(const std::vector<InputColumn>& columns, const std::vector<bool>& used,
                                       const Eigen::Ref<const Eigen::MatrixXd>& inputs, const Eigen::MatrixXd& at,
                                       const TrainingRecord& record) {
  const InputRecord nothing;
  std::vector<CheckedInput> result;
  for (std::size_t j = 0; j < columns.size(); ++j) {
    if (!used[j]) continue;
    const auto k = static_cast<Eigen::Index>(j);
    const InputRecord& known = record.empty() ? nothing : record.inputs[j];
    CheckedInput found = columns[j].is_categorical() ? check_categories(columns[j], inputs.col(k), at.col(k), known)
                                                     : check_numbers(columns[j], at.col(k), known);
    found.input = j;
    found.name = columns[j].name;
    found.missing_share = share(found.missing, inputs.rows());
    if (!known.empty()) {
      const Eigen::Index rows = known.rows() + known.missing;
      found.training_missing_share = share(known.missing, rows);
      if (found.missing + known.missing > 0) {
        found.probability = 2.0 * std::min(found.probability,
                                           same_share_probability(known.missing, rows, found.missing, inputs.rows()));
      }
      found.probability = std::min(1.0, found.probability);
    }
    result.push_back(std::move(found));
  }
  return result;
}

}  // namespace llmt
