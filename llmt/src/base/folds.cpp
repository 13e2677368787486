#include "llmt/folds.hpp"

#include <fmt/format.h>

#include <map>
#include <stdexcept>

#include "llmt/random.hpp"

namespace llmt {
namespace {

/// Group number of every row, numbered in order of first appearance.
std::vector<std::ptrdiff_t> number_groups(std::ptrdiff_t rows, std::span<const double> labels) {
  std::vector<std::ptrdiff_t> groups(static_cast<std::size_t>(rows));
  std::map<double, std::ptrdiff_t> seen;
  for (std::size_t row = 0; row < groups.size(); ++row) {
    groups[row] = labels.empty() ? static_cast<std::ptrdiff_t>(row)
                                 : seen.emplace(labels[row], static_cast<std::ptrdiff_t>(seen.size())).first->second;
  }
  return groups;
}

}  // namespace

std::vector<Fold> make_folds(std::ptrdiff_t rows, const FoldOptions& options) {
  if (options.count < 2) {
    throw std::invalid_argument(fmt::format("llmt::make_folds: count is {}, it must be at least 2", options.count));
  }
  if (!options.groups.empty() && std::ssize(options.groups) != rows) {
    throw std::invalid_argument(
        fmt::format("llmt::make_folds: groups has {} labels for {} rows", options.groups.size(), rows));
  }
  const std::vector<std::ptrdiff_t> group_of_row = number_groups(rows, options.groups);
  std::ptrdiff_t group_count = 0;
  for (const std::ptrdiff_t group : group_of_row) {
    group_count = std::max(group_count, group + 1);
  }
  if (group_count < options.count) {
    throw std::invalid_argument(
        fmt::format("llmt::make_folds: {} folds need at least {} rows (or groups), there are {}", options.count,
                    options.count, group_count));
  }

  // Position of each group in the dealing order; consecutive positions go to the same fold, block by block.
  std::vector<std::ptrdiff_t> fold_of_group(static_cast<std::size_t>(group_count));
  Random random(options.seed);
  const std::vector<std::ptrdiff_t> shuffled =
      options.kind == FoldKind::random ? random.permutation(group_count) : std::vector<std::ptrdiff_t>{};
  for (std::ptrdiff_t position = 0; position < group_count; ++position) {
    const std::ptrdiff_t group = shuffled.empty() ? position : shuffled[static_cast<std::size_t>(position)];
    fold_of_group[static_cast<std::size_t>(group)] = position * options.count / group_count;
  }

  std::vector<Fold> folds(static_cast<std::size_t>(options.count));
  for (std::ptrdiff_t row = 0; row < rows; ++row) {
    const std::size_t group = static_cast<std::size_t>(group_of_row[static_cast<std::size_t>(row)]);
    const std::size_t own = static_cast<std::size_t>(fold_of_group[group]);
    for (std::size_t fold = 0; fold < folds.size(); ++fold) {
      (fold == own ? folds[fold].held_out : folds[fold].train).push_back(row);
    }
  }
  return folds;
}

}  // namespace llmt
