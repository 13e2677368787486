#include "fit/prepare.hpp"

#include <fmt/format.h>

#include <memory>
#include <stdexcept>
#include <utility>
#include <vector>

#include "fit/check_options.hpp"
#include "fit/code_choice.hpp"
#include "fit/missing_weights.hpp"
#include "fit/robust_weights.hpp"
#include "growth/rules/rule.hpp"
#include "llmt/fit.hpp"
#include "llmt/outliers.hpp"

namespace llmt {
namespace {

// Of the work of a fit with the robust loss.
constexpr double share_of_loss = 0.2;

// Least squares cannot fit what the rounding of one output's error hides. Rows of weight 0 take no part.
void refuse_hidden_outputs(const GivenRows& given) {
  const Eigen::Ref<const Eigen::MatrixXd>& outputs = given.outputs.values;
  std::vector<Eigen::Index> rows;
  for (Eigen::Index row = 0; row < outputs.rows(); ++row) {
    if (given.weights.size() == 0 || given.weights(row) > 0.0) rows.push_back(row);
  }
  for (Eigen::Index o = 0; o < outputs.cols(); ++o) {
    const Eigen::VectorXd values = outputs.col(o)(rows);
    const DominantRows dominant = dominant_rows(values);
    if (!dominant.hide_the_others) continue;
    throw std::invalid_argument(fmt::format(
        "llmt::fit: outputs({}, {}) is {}, beside which the other values differ by less than its rounding error; "
        "leave that row out, or set loss to tukey",
        rows[dominant.rows.front()], o, values(dominant.rows.front())));
  }
}

std::shared_ptr<const Training> described(std::shared_ptr<const KeptRows> kept, const SharedMatrix& inputs,
                                          const FitOptions& options, Work& work) {
  const auto by_missing = [&](const TrainingRows& all) { return weights_by_missing(all, options, work); };
  const bool orders_splits = rule_of(options.rule).splits_on_monotone_inputs;
  return std::make_shared<const Training>(make_training(std::move(kept), inputs, options, orders_splits, by_missing));
}

// The options by which columns are described: rows are elsewhere.
FitOptions without_rows(FitOptions options) {
  options.weights = {};
  options.folds.groups = {};
  options.progress = {};
  return options;
}

}  // namespace

PreparedRows prepare(const Eigen::Ref<const Eigen::MatrixXd>& inputs, const Eigen::Ref<const Eigen::MatrixXd>& outputs,
                     const FitOptions& options, Work& work) {
  check_options(options, inputs.cols());
  GivenRows given = given_rows(inputs, outputs, options);
  if (options.loss == Loss::tukey) {
    Work weighting(work, share_of_loss);
    given.loss_weights = robust_weights(given, options, weighting);
    given.weights = without_outliers(given.weights, given.loss_weights);
  }
  refuse_hidden_outputs(given);
  FitOptions of_columns = without_rows(options);
  if (options.terms == LocalTerms::automatic) of_columns.terms = LocalTerms::linear;
  CodeChoice codes = choose_codes(given, of_columns, work);
  const auto kept = std::make_shared<const KeptRows>(keep(given, options.folds));
  const bool has_codes = !codes.taken.empty();
  const SharedMatrix columns = has_codes ? shared(at_positions(codes.codes, kept->inputs.values)) : kept->inputs;
  if (has_codes) of_columns = with_categories(codes.codes, std::move(of_columns));
  return {described(kept, columns, of_columns, work), options.terms, std::move(codes), std::move(given.loss_weights)};
}

PreparedRows prepare_plain(const GivenRows& given, const FitOptions& options, Work& work) {
  const auto kept = std::make_shared<const KeptRows>(keep(given, options.folds));
  return {described(kept, kept->inputs, without_rows(options), work), options.terms};
}

std::shared_ptr<const Training> with_terms(const std::shared_ptr<const Training>& training, LocalTerms terms,
                                           Work& work) {
  if (training->options.terms == terms) return training;
  FitOptions options = training->options;
  options.terms = terms;
  return described(training->kept, training->inputs, options, work);
}

struct PreparedFit::Parts {
  Parts(TrainingData given, const FitOptions& options, Work& work)
      : data(std::move(given)), rows(prepare(data.inputs, data.outputs, options, work)) {}

  TrainingData data;
  PreparedRows rows;  // view the data
};

PreparedFit::PreparedFit(TrainingData data, const FitOptions& options, const Progress& progress) {
  Work work(progress);
  parts_ = std::make_shared<const Parts>(std::move(data), options, work);
  work.finish();
}

const TrainingData& PreparedFit::data() const { return parts_->data; }

const PreparedRows& PreparedFit::rows() const { return parts_->rows; }

}  // namespace llmt
