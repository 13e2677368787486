#include "data/fold_rows.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <stdexcept>

namespace llmt {

std::vector<Fold> selection_folds(Eigen::Index rows, FoldOptions options, std::span<const double> labels) {
  if (options.count == 0) return {};
  if (options.count < 2) {
    throw std::invalid_argument(fmt::format("llmt::fit: folds.count is {}, it must be 0 or at least 2", options.count));
  }
  std::vector<double> distinct(labels.begin(), labels.end());
  std::ranges::sort(distinct);
  distinct.erase(std::unique(distinct.begin(), distinct.end()), distinct.end());
  const Eigen::Index groups = labels.empty() ? rows : std::ssize(distinct);
  options.count = static_cast<int>(std::min<Eigen::Index>(options.count, groups));
  if (options.count < 2) return {};
  std::vector<Fold> folds = make_folds(rows, options, labels);
  if (rows >= single_hold_out_rows) {
    folds.resize(1);
  }
  return folds;
}

std::vector<FoldRows> deal(const Table& table, const Table& measured, const std::vector<Fold>& folds, int max_threads) {
  std::vector<FoldRows> result;
  for (const Fold& fold : folds) {
    TrainingRows training = training_rows(table, {fold.train.begin(), fold.train.end()}, max_threads);
    TrainingRows held_out = query_rows(measured, {fold.held_out.begin(), fold.held_out.end()}, training);
    result.push_back({std::move(training), std::move(held_out)});
  }
  return result;
}

}  // namespace llmt
