#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <set>

#include "data/equal_rows.hpp"
#include "data/given_rows.hpp"
#include "data/regressors.hpp"
#include "growth/rules/rule.hpp"
#include "llmt/compare.hpp"

namespace llmt {
namespace {

// Joint estimates of leaves that overlap everywhere cost the square of their number, as do logistic gates.
constexpr Eigen::Index most_overlapping_leaves = 50;

// Where the methods of the rules stand: those with crisp leaves before the Gaussians and the blend.
bool is_crisp(const Rule& rule) {
  return rule.overlapping == ValidityKind::blend || rule.overlapping == ValidityKind::crisp;
}

class Methods {
 public:
  explicit Methods(const FitOptions& base) : plain_(base) {
    plain_.intervals = false;
    plain_.pruning = Pruning::last_splits;
    plain_.validity = ValidityChoice::crisp;
    plain_.terms = LocalTerms::linear;
    plain_.sparse = SparseChoice::never;
    overlapping_leaves_ =
        base.max_leaves > 0 ? std::min(base.max_leaves, most_overlapping_leaves) : most_overlapping_leaves;
  }

  template <class Change>
  void add(std::string_view name, const Change& change) {
    methods_.push_back({std::string(name), plain_});
    change(methods_.back().options);
  }

  void add_rules(bool crisp) {
    for (const Choice<GrowthRule>& choice : choices<GrowthRule>()) {
      const Rule& rule = rule_of(choice.value);
      if (rule.usual_method.empty() || is_crisp(rule) != crisp) continue;
      add(rule.usual_method, [&](FitOptions& options) {
        options.rule = choice.value;
        set_for(rule, options);
      });
    }
  }

  void add_gaussians() {
    add("Gaussians, as grown", [&](FitOptions& options) {
      options.validity = ValidityChoice::gaussian;
      options.expert.estimation = Estimation::as_grown;
      options.max_leaves = overlapping_leaves_;
    });
    add("Gaussians, re-estimated", [&](FitOptions& options) {
      options.validity = ValidityChoice::gaussian;
      options.expert.widths = {1.0 / 3.0, 2.0 / 3.0};
      options.max_leaves = overlapping_leaves_;
    });
  }

  std::vector<Method> take() { return std::move(methods_); }

 private:
  void set_for(const Rule& rule, FitOptions& options) const {
    if (rule.has_own_models) {
      options.folds.count = 0;  // its pruning decides
      options.expert.shrinkages = {};
    }
    if (is_crisp(rule)) return;
    options.max_leaves = overlapping_leaves_;
    // As in the literature: LOLIMOT estimates locally.
    if (rule.overlapping == ValidityKind::gaussian) options.expert.estimation = Estimation::as_grown;
    if (rule.overlapping == ValidityKind::logistic) options.validity = ValidityChoice::automatic;
  }

  FitOptions plain_;
  Eigen::Index overlapping_leaves_ = 0;
  std::vector<Method> methods_;
};

std::vector<Method> methods_of(const FitOptions& base, Eigen::Index numbers) {
  Methods methods(base);
  methods.add("least squares", [](FitOptions& options) {
    options.max_leaves = 1;
    options.folds.count = 0;
  });
  methods.add_rules(true);
  methods.add_gaussians();
  methods.add("blend, joint", [](FitOptions& options) { options.validity = ValidityChoice::blend; });
  methods.add_rules(false);
  if (numbers > 0 && numbers <= most_inputs_of_products) {
    methods.add("crisp tree, quadratic leaves", [](FitOptions& options) { options.terms = LocalTerms::quadratic; });
  }
  if (base.pruning == Pruning::weakest_link) {
    methods.add("crisp tree, RD, pruned", [](FitOptions& options) { options.pruning = Pruning::weakest_link; });
    methods.add("blend, joint, pruned", [](FitOptions& options) {
      options.pruning = Pruning::weakest_link;
      options.validity = ValidityChoice::blend;
    });
  }
  return methods.take();
}

// Different labels of rows; no labels: all rows differ.
template <class Label>
std::size_t count_different(const std::vector<Label>& labels, std::size_t rows) {
  return labels.empty() ? rows : std::set<Label>(labels.begin(), labels.end()).size();
}

}  // namespace

std::vector<Method> usual_methods(const FitOptions& base) { return methods_of(base, 0); }

std::vector<Method> usual_methods(const FitOptions& base, const TrainingData& data) {
  return methods_of(base, count_numeric_inputs(data.inputs.cols(), given_rows(data).categorical, base));
}

Method boosted_method(const FitOptions& base) {
  Method method{.name = "sum of trees", .options = base, .boosted = BoostOptions{}};
  method.boosted->seed = base.folds.seed;
  method.boosted->max_threads = base.max_threads;
  return method;
}

std::string why_not_boosted(const FitOptions& base, const TrainingData& data) {
  if (base.loss == Loss::tukey) return "--loss tukey, which leaves rows out";
  const GivenRows given = given_rows(data);
  std::vector<Eigen::Index> rows;
  for (Eigen::Index row = 0; row < given.inputs.values.rows(); ++row) {
    if (given.weights.size() == 0 || given.weights(row) > 0.0) rows.push_back(row);
  }
  // Two folds leave half of the rows, of which boosting holds fifths out, whole groups of them.
  const RowNumbers numbers = number_rows(given.inputs.values, given.outputs.values, rows);
  if (constexpr std::size_t fewest = 4 * fewest_boosted_rows; count_different(numbers.by_all, rows.size()) < fewest) {
    return fmt::format("fewer than {} different rows", fewest);
  }
  constexpr std::size_t fewest_groups = 10;
  const std::size_t groups = given.groups.empty() ? count_different(numbers.by_inputs, rows.size())
                                                  : count_different(given.groups, rows.size());
  if (groups < fewest_groups) {
    return fmt::format("fewer than {} groups of rows, or of rows with different inputs", fewest_groups);
  }
  return "";
}

}  // namespace llmt
