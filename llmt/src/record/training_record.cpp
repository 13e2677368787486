#include "llmt/training_record.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numeric>
#include <stdexcept>

namespace llmt {
namespace {

[[noreturn]] void refuse_record(const std::string& problem) {
  throw std::invalid_argument("llmt::TrainingRecord: " + problem);
}

// Values of a number and how often each occurs, ascending.
InputRecord counted(std::vector<std::pair<double, Eigen::Index>> values) {
  std::ranges::sort(values);
  InputRecord record;
  for (const auto& [value, count] : values) {
    if (record.values.empty() || record.values.back() != value) {
      record.values.push_back(value);
      record.counts.push_back(0);
    }
    record.counts.back() += count;
  }
  return record;
}

// The values in the middle of each of most_recorded_values parts of the sorted rows, which have equal numbers of rows.
InputRecord thinned(const InputRecord& all) {
  const Eigen::Index rows = all.rows();
  InputRecord record;
  std::size_t at = 0;
  Eigen::Index below = all.counts.front();  // rows up to `at`
  for (Eigen::Index part = 0; part < most_recorded_values; ++part) {
    const Eigen::Index begin = part * rows / most_recorded_values;
    const Eigen::Index end = (part + 1) * rows / most_recorded_values;
    while (below <= (begin + end) / 2) below += all.counts[++at];
    if (record.values.empty() || record.values.back() != all.values[at]) {
      record.values.push_back(all.values[at]);
      record.counts.push_back(0);
    }
    record.counts.back() += end - begin;
  }
  return record;
}

void check_input(const InputRecord& record, const InputColumn& input) {
  if (record.missing < 0 || std::ranges::any_of(record.counts, [](Eigen::Index count) { return count < 0; })) {
    refuse_record(fmt::format("input \"{}\": a number of rows is negative", input.name));
  }
  if (record.empty() && record.values.empty()) return;
  const std::size_t wanted = input.is_categorical() ? input.levels.size() : record.values.size();
  if (record.counts.size() != wanted || (input.is_categorical() && !record.values.empty())) {
    refuse_record(fmt::format("input \"{}\": {} counts and {} values, {} counts are needed", input.name,
                              record.counts.size(), record.values.size(), wanted));
  }
  const auto is_finite = [](double value) { return std::isfinite(value); };
  const auto descends = [](double value, double next) { return !(value < next); };
  if (!std::ranges::all_of(record.values, is_finite) ||
      std::ranges::adjacent_find(record.values, descends) != record.values.end()) {
    refuse_record(fmt::format("input \"{}\": the values do not ascend", input.name));
  }
}

}  // namespace

Eigen::Index InputRecord::rows() const { return std::accumulate(counts.begin(), counts.end(), Eigen::Index{0}); }

InputRecord record_of(const Eigen::Ref<const Eigen::VectorXd>& values, std::size_t levels,
                      const std::vector<int>& copies) {
  const auto count_of = [&](Eigen::Index row) {
    return Eigen::Index{copies.empty() ? 1 : copies[static_cast<std::size_t>(row)]};
  };
  Eigen::Index missing = 0;
  std::vector<std::pair<double, Eigen::Index>> numbers;
  std::vector<Eigen::Index> of_level(levels, 0);
  for (Eigen::Index row = 0; row < values.size(); ++row) {
    const double value = values(row);
    if (std::isnan(value) || (levels > 0 && !(value >= 0.0 && value < static_cast<double>(levels)))) {
      missing += count_of(row);
    } else if (levels > 0) {
      of_level[static_cast<std::size_t>(value)] += count_of(row);
    } else {
      numbers.emplace_back(value, count_of(row));
    }
  }
  InputRecord record;
  if (levels > 0) {
    record.counts = std::move(of_level);
  } else if (!numbers.empty()) {
    record = counted(std::move(numbers));
    if (std::ssize(record.values) > most_recorded_values) record = thinned(record);
  }
  record.missing = missing;
  return record;
}

void check_record(const TrainingRecord& record, const std::vector<InputColumn>& inputs, std::size_t outputs) {
  if (record.empty() && record.leaves.empty()) return;
  if (record.inputs.size() != inputs.size()) {
    refuse_record(fmt::format("{} inputs of {}", record.inputs.size(), inputs.size()));
  }
  for (std::size_t j = 0; j < inputs.size(); ++j) check_input(record.inputs[j], inputs[j]);
  if (!record.leaves.empty() && record.leaves.size() != outputs) {
    refuse_record(fmt::format("leaves of {} outputs of {}", record.leaves.size(), outputs));
  }
  if (record.size_limit < 0) refuse_record("the limit of the size is negative");
  for (const std::vector<LeafRecord>& of_output : record.leaves) {
    for (const LeafRecord& leaf : of_output) {
      if (leaf.rows < 0 || !std::isfinite(leaf.mean_square) || leaf.mean_square < 0.0) {
        refuse_record("a number of rows or a mean square of a leaf is negative or not finite");
      }
    }
  }
}

}  // namespace llmt
