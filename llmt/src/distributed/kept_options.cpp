// Options of a fit as a state keeps them.
#include <fmt/format.h>

#include <algorithm>
#include <set>
#include <stdexcept>

#include "distributed/state.hpp"

namespace llmt::distributed {

FitOptions branch_options(const KeptOptions& kept, int max_threads) {
  FitOptions options;
  options.max_leaves = kept.max_leaves;
  options.min_leaf_samples = kept.min_leaf_samples;
  options.significance = kept.significance;
  options.pruning = static_cast<Pruning>(kept.pruning);
  options.validity = static_cast<ValidityChoice>(kept.validity);
  options.sparse = static_cast<SparseChoice>(kept.sparse);
  options.folds = {static_cast<int>(kept.folds), static_cast<FoldKind>(kept.fold_kind), kept.seed};
  options.intervals = kept.intervals != 0;
  options.max_threads = max_threads;
  options.expert.estimation = static_cast<Estimation>(kept.estimation);
  options.expert.widths = kept.widths;
  options.expert.jumps = kept.jumps;
  options.expert.ridges = kept.ridges;
  options.expert.shrinkages = kept.shrinkages;
  return options;
}

KeptOptions kept_options(const Options& options) {
  const FitOptions& fit = options.fit;
  const auto refuse = [](bool asked, const char* option, const char* instead) {
    if (asked) {
      throw std::invalid_argument(
          fmt::format("llmt::distributed::start: {} is not possible beyond one memory; {}", option, instead));
    }
  };
  const auto require_at_least = [](Eigen::Index least, Eigen::Index value, const char* name) {
    if (value >= least) return;
    throw std::invalid_argument(
        fmt::format("llmt::distributed::start: {} is {}, it must be at least {}", name, value, least));
  };
  require_at_least(100, options.sample_rows, "sample_rows");
  require_at_least(100, options.branch_rows, "branch_rows");
  require_at_least(1, options.block_rows, "block_rows");
  refuse(fit.rule != GrowthRule::rd, "the growth rule", "take rd, or fit a sample that fits into memory");
  refuse(fit.expert.search == SplitSearch::exact, "exact search", "the top of the tree is searched by bins");
  refuse(fit.terms != LocalTerms::linear, "a quadratic local model", "take linear ones, or products as columns");
  refuse(fit.loss != Loss::squared, "Tukey's loss", "take the squared loss; medians over all rows are no sums");
  refuse(fit.validity == ValidityChoice::gaussian, "validity gaussian", "take crisp, blend or automatic");
  refuse(std::ranges::any_of(fit.trends, [](Trend trend) { return trend != Trend::any; }), "a trend",
         "fit a sample that fits into memory");
  refuse(!fit.split_inputs.empty(), "a list of split_inputs", "leave columns out of the table");
  refuse(!fit.regression_inputs.empty(), "a list of regression_inputs", "leave columns out of the table");
  KeptOptions kept;
  kept.branch_rows = std::max(options.branch_rows, options.sample_rows);
  kept.sample_rows = options.sample_rows;
  kept.block_rows = options.block_rows;
  kept.max_leaves = fit.max_leaves;
  kept.min_leaf_samples = fit.min_leaf_samples;
  kept.significance = fit.significance;
  kept.pruning = static_cast<Eigen::Index>(fit.pruning);
  kept.validity = static_cast<Eigen::Index>(fit.validity);
  kept.sparse = static_cast<Eigen::Index>(fit.sparse);
  kept.estimation = static_cast<Eigen::Index>(fit.expert.estimation);
  kept.folds = fit.folds.count;
  kept.fold_kind = static_cast<Eigen::Index>(fit.folds.kind);
  kept.seed = fit.folds.seed;
  kept.intervals = fit.intervals ? 1 : 0;
  kept.weighted = options.weighted ? 1 : 0;
  kept.widths = fit.expert.widths;
  kept.jumps = fit.expert.jumps;
  kept.ridges = fit.expert.ridges;
  kept.shrinkages = fit.expert.shrinkages;
  return kept;
}

// Names of categories, of every input.
std::vector<std::vector<Text>> kept_levels(const std::vector<std::vector<std::string>>& levels,
                                           const std::vector<Text>& inputs) {
  std::vector<std::vector<Text>> kept(inputs.size());
  if (levels.empty()) return kept;
  if (levels.size() != inputs.size()) {
    throw std::invalid_argument(fmt::format("llmt::distributed::start: levels has {} entries, there are {} inputs",
                                            levels.size(), inputs.size()));
  }
  for (std::size_t j = 0; j < levels.size(); ++j) {
    const std::string input = to_string(inputs[j]);
    if (levels[j].size() > most_levels) {
      throw std::invalid_argument(fmt::format(
          "llmt::distributed::start: input \"{}\" has {} categories, {} are possible beyond one memory; join "
          "rare ones, or leave the column out",
          input, levels[j].size(), most_levels));
    }
    if (std::set<std::string>(levels[j].begin(), levels[j].end()).size() < levels[j].size()) {
      throw std::invalid_argument(
          fmt::format("llmt::distributed::start: two categories of input \"{}\" have the same name", input));
    }
    for (const std::string& level : levels[j]) kept[j].push_back(to_text(level));
  }
  return kept;
}

}  // namespace llmt::distributed
