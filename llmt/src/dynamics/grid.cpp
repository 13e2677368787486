#include "dynamics/grid.hpp"

#include <algorithm>

#include "dynamics/polynomial.hpp"

namespace llmt {
namespace {

// In units of the squares of the outputs' changes from row to row.
constexpr double ridges[] = {1e-6, 1e-3, 3e-2, 0.3};
constexpr double tree_ridges[] = {1e-3, 3e-2};
constexpr double probe_ridge = 1e-3;

Eigen::Index columns_in(const Lags& lags) { return std::ssize(columns_of(lags)); }

// Rows enough for the parameters, and not so many of these that an estimate on runs takes minutes.
bool fits(double parameters, Eigen::Index rows) {
  constexpr double most_parameters = 150.0;
  return parameters <= most_parameters && 6.0 * parameters <= static_cast<double>(rows);
}

bool polynomial_fits(const Lags& lags, int degree, Eigen::Index rows) {
  return fits(number_of_terms(columns_in(lags), degree), rows);
}

std::vector<GrowthRule> rules_of(const DynamicOptions& options) {
  if (options.rest == RestLearner::tree) return {options.rule};
  return {GrowthRule::hilomot, GrowthRule::lolimot, GrowthRule::rd};
}

ModelStructure tree_candidate(const Lags& lags, GrowthRule rule, Eigen::Index leaves, int degree, bool on_runs,
                              double ridge = 0.0) {
  return {.lags = lags,
          .degree = degree,
          .ridge = ridge,
          .rest = RestKind::tree,
          .rule = rule,
          .leaves = leaves,
          .on_runs = on_runs};
}

ModelStructure polynomial_candidate(const Lags& lags, int degree, double ridge, bool on_runs) {
  return {.lags = lags, .degree = degree, .ridge = ridge, .on_runs = on_runs};
}

bool takes_trees(const DynamicOptions& options) {
  return options.rest == RestLearner::automatic || options.rest == RestLearner::tree;
}

}  // namespace

Lags simple_lags(const std::vector<int>& delays, Eigen::Index outputs, int past, int count) {
  Lags lags{std::vector<std::vector<int>>(outputs), std::vector<std::vector<int>>(delays.size())};
  for (std::vector<int>& list : lags.outputs) {
    for (int lag = 1; lag <= past; ++lag) list.push_back(lag);
  }
  for (std::size_t i = 0; i < delays.size(); ++i) {
    for (int k = 0; k < count && delays[i] >= 0; ++k) lags.inputs[i].push_back(delays[i] + k);
  }
  return lags;
}

std::vector<Lags> lag_candidates(const std::vector<int>& delays, Eigen::Index outputs, Eigen::Index rows) {
  struct Shape {
    int past;
    int count;
  };
  // Short ones for systems of first to fourth order, and long pasts of inputs, which stand in for a state that the
  // outputs do not show.
  constexpr Shape shapes[] = {{1, 1}, {1, 2}, {2, 1}, {2, 2},  {2, 3},  {3, 1}, {3, 2},  {3, 3},  {2, 5},  {3, 5},
                              {4, 4}, {5, 5}, {1, 8}, {1, 16}, {1, 24}, {3, 8}, {3, 24}, {2, 16}, {0, 16}, {0, 30}};
  const bool has_inputs = std::ranges::any_of(delays, [](int delay) { return delay >= 0; });
  std::vector<Lags> result;
  for (const Shape& shape : shapes) {
    if (!has_inputs && (shape.past == 0 || shape.count > 1)) continue;
    Lags lags = simple_lags(delays, outputs, shape.past, shape.count);
    if (20 * columns_in(lags) > rows || columns_in(lags) > 60) continue;
    result.push_back(std::move(lags));
  }
  return result;
}

std::vector<ModelStructure> probes(const Lags& lags, const DynamicOptions& options, Eigen::Index rows) {
  const bool on_runs = options.horizon != 1;
  std::vector<ModelStructure> candidates = {polynomial_candidate(lags, 1, 0.0, on_runs)};
  for (const int degree : {2, 3}) {
    if (polynomial_fits(lags, degree, rows)) {
      candidates.push_back(polynomial_candidate(lags, degree, probe_ridge, on_runs));
    }
  }
  if (takes_trees(options) && fits(2.0 * static_cast<double>(columns_in(lags) + 1), rows)) {
    const GrowthRule rule = rules_of(options).front();
    candidates.push_back(tree_candidate(lags, rule, 2, 0, false));
    if (on_runs) candidates.push_back(tree_candidate(lags, rule, 2, 1, true, probe_ridge));
  }
  return candidates;
}

std::vector<ModelStructure> all_candidates(const Lags& lags, const DynamicOptions& options, Eigen::Index rows) {
  const bool may_run = options.horizon != 1;
  std::vector<ModelStructure> candidates;
  const auto add = [&](const ModelStructure& candidate) {
    if (may_run || !candidate.on_runs) candidates.push_back(candidate);
  };
  add(polynomial_candidate(lags, 1, 0.0, false));
  add(polynomial_candidate(lags, 1, 0.0, true));
  if (options.rest == RestLearner::sum) {
    add({.lags = lags, .degree = 1, .rest = RestKind::sum});
    return candidates;
  }
  if (options.rest == RestLearner::readable) {
    add({.lags = lags, .degree = 0, .rest = RestKind::readable});
    return candidates;
  }
  for (const int degree : {2, 3}) {
    if (!polynomial_fits(lags, degree, rows)) continue;
    add(polynomial_candidate(lags, degree, 0.0, false));
    for (const double ridge : ridges) add(polynomial_candidate(lags, degree, ridge, true));
  }
  if (!takes_trees(options)) return candidates;
  for (const GrowthRule rule : rules_of(options)) {
    for (Eigen::Index leaves = 2; leaves <= options.max_leaves; leaves += leaves < 4 ? 1 : leaves) {
      if (!fits(static_cast<double>(leaves * (columns_in(lags) + 1)), rows)) continue;
      for (const int degree : {0, 1}) {
        add(tree_candidate(lags, rule, leaves, degree, false));
        for (const double ridge : tree_ridges) add(tree_candidate(lags, rule, leaves, degree, true, ridge));
      }
    }
  }
  return candidates;
}

}  // namespace llmt
