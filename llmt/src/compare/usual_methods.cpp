#include <algorithm>

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

}  // namespace

std::vector<Method> usual_methods(const FitOptions& base) { return methods_of(base, 0); }

std::vector<Method> usual_methods(const FitOptions& base, const TrainingData& data) {
  return methods_of(base, count_numeric_inputs(data.inputs.cols(), given_rows(data).categorical, base));
}

}  // namespace llmt
