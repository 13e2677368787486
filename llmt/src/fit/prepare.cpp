#include "fit/prepare.hpp"

#include <fmt/format.h>

#include <memory>
#include <stdexcept>
#include <utility>
#include <vector>

#include "fit/choices/code_choice.hpp"
#include "fit/plan/check_options.hpp"
#include "fit/robust_weights.hpp"
#include "llmt/outliers.hpp"

namespace llmt {
namespace {

// Share of the work of a fit that the robust loss takes.
constexpr double share_of_loss = 0.2;

// Least squares cannot fit what the rounding of one output's error hides. Rows of weight 0 take no part.
void refuse_hidden_outputs(const GivenRows& given) {
  const Eigen::Ref<const Eigen::MatrixXd>& outputs = given.outputs.values;
  const std::vector<Eigen::Index> rows = counted_rows(given);
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

}  // namespace

PreparedRows prepare(const GivenRows& all, const FitOptions& options, Work& work) {
  check_options(options, all.inputs.values.cols());
  GivenRows given = checked(all, options);
  if (options.loss == Loss::tukey) {
    Work weighting(work, share_of_loss);
    given.loss_weights = robust_weights(given, options, weighting);
    given.weights = without_outliers(given.weights, given.loss_weights);
  }
  refuse_hidden_outputs(given);
  FitOptions of_columns = options;
  if (options.terms == LocalTerms::automatic) of_columns.terms = LocalTerms::linear;
  CodeChoice codes = choose_codes(given, of_columns, work);
  const auto kept = std::make_shared<const KeptRows>(keep(given, options.folds));
  if (kept->is_fold_given && kept->folds.empty()) {
    throw std::invalid_argument("llmt::fit: loss tukey leaves out all rows of held_out, or all others");
  }
  const bool has_codes = !codes.taken.empty();
  const SharedMatrix columns = has_codes ? shared(at_positions(codes.codes, kept->inputs.values)) : kept->inputs;
  std::vector<int> categorical = with_codes(given.categorical, codes.codes);
  return {describe_columns(kept, columns, std::move(categorical), of_columns, work), options.terms, std::move(codes),
          std::move(given.loss_weights), std::move(given.empty_levels)};
}

}  // namespace llmt
