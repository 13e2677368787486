#include "fit/prepared_rows.hpp"

#include <utility>

#include "data/lessons.hpp"
#include "fit/missing_weights.hpp"
#include "growth/rules/rule.hpp"

namespace llmt {

std::shared_ptr<const Training> describe_columns(std::shared_ptr<const KeptRows> kept, const SharedMatrix& inputs,
                                                 std::vector<int> categorical, const FitOptions& options, Work& work) {
  const auto by_missing = [&](const TrainingRows& all) { return weights_by_missing(all, options, work); };
  const bool orders_splits = rule_of(options.rule).splits_on_monotone_inputs;
  return std::make_shared<const Training>(
      make_training(std::move(kept), inputs, std::move(categorical), options, orders_splits, by_missing));
}

PreparedRows prepare_plain(const GivenRows& given, const FitOptions& options, Work& work) {
  const auto kept = std::make_shared<const KeptRows>(keep(given, options.folds));
  return {describe_columns(kept, kept->inputs, given.categorical, options, work), options.terms};
}

std::shared_ptr<const Training> with_terms(const std::shared_ptr<const Training>& training, LocalTerms terms,
                                           Work& work) {
  if (training->options.terms == terms) return training;
  FitOptions options = training->options;
  options.terms = terms;
  std::shared_ptr<const Training> result =
      describe_columns(training->kept, training->inputs, training->categorical, options, work);
  const std::shared_ptr<const Lessons> lessons = lessons_of(*training);
  return lessons == nullptr ? result : std::make_shared<const Training>(taught(*result, lessons));
}

}  // namespace llmt
