// Options of a fit as a state keeps them.
#include <fmt/format.h>

#include <algorithm>
#include <set>
#include <stdexcept>

#include "distributed/kept_options.hpp"
#include "distributed/state.hpp"

namespace llmt::distributed {

FitOptions branch_options(const KeptOptions& kept, int max_threads) {
  FitOptions options = from_kept<FitOptions>({kept.fit.data(), kept.fit.size()});
  options.max_threads = max_threads;
  return options;
}

KeptOptions kept_options(const Options& options) {
  const auto require_at_least = [](Eigen::Index least, Eigen::Index value, const char* name) {
    if (value >= least) return;
    throw std::invalid_argument(
        fmt::format("llmt::distributed::start: {} is {}, it must be at least {}", name, value, least));
  };
  require_at_least(100, options.sample_rows, "sample_rows");
  require_at_least(100, options.branch_rows, "branch_rows");
  require_at_least(1, options.block_rows, "block_rows");
  return {.branch_rows = std::max(options.branch_rows, options.sample_rows),
          .sample_rows = options.sample_rows,
          .block_rows = options.block_rows,
          .weighted = options.weighted ? 1 : 0,
          .may_have_codes = options.may_have_codes ? 1 : 0,
          .fit = to_text(kept(options.fit))};
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
