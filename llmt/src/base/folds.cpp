#include "llmt/folds.hpp"

#include <fmt/format.h>

#include <map>
#include <stdexcept>

#include "llmt/random.hpp"

namespace llmt {
namespace {

// Group number of every row, numbered in order of first appearance.
std::vector<Eigen::Index> number_groups(Eigen::Index rows, std::span<const double> labels) {
  std::vector<Eigen::Index> groups(rows);
  std::map<double, Eigen::Index> seen;
  for (Eigen::Index row = 0; row < rows; ++row) {
    groups[row] = labels.empty() ? row : seen.emplace(labels[row], std::ssize(seen)).first->second;
  }
  return groups;
}

}  // namespace

std::vector<Fold> make_folds(Eigen::Index rows, const FoldOptions& options, std::span<const double> groups) {
  if (options.count < 2) {
    throw std::invalid_argument(fmt::format("llmt::make_folds: count is {}, it must be at least 2", options.count));
  }
  if (!groups.empty() && std::ssize(groups) != rows) {
    throw std::invalid_argument(fmt::format("llmt::make_folds: groups has {} labels for {} rows", groups.size(), rows));
  }
  const std::vector<Eigen::Index> group_of_row = number_groups(rows, groups);
  Eigen::Index group_count = 0;
  for (const Eigen::Index group : group_of_row) {
    group_count = std::max(group_count, group + 1);
  }
  if (group_count < options.count) {
    throw std::invalid_argument(
        fmt::format("llmt::make_folds: {} folds need at least {} rows (or groups), there are {}", options.count,
                    options.count, group_count));
  }

  // Position of each group in the dealing order; consecutive positions go to the same fold, block by block.
  std::vector<Eigen::Index> fold_of_group(group_count);
  Random random(options.seed);
  const std::vector<Eigen::Index> shuffled =
      options.kind == FoldKind::random ? random.permutation(group_count) : std::vector<Eigen::Index>{};
  for (Eigen::Index position = 0; position < group_count; ++position) {
    const Eigen::Index group = shuffled.empty() ? position : shuffled[position];
    fold_of_group[group] = position * options.count / group_count;
  }

  std::vector<Fold> folds(options.count);
  for (Eigen::Index row = 0; row < rows; ++row) {
    const std::size_t group = group_of_row[row];
    const std::size_t own = fold_of_group[group];
    for (std::size_t fold = 0; fold < folds.size(); ++fold) {
      (fold == own ? folds[fold].held_out : folds[fold].train).push_back(row);
    }
  }
  return folds;
}

}  // namespace llmt
