// Fits of small tables: they end, their predictions are finite, and the local models of a crisp tree of linear models
// without shrinkage are in-sample never worse than least squares.
#include "llmt/fit.hpp"

#include <stdexcept>

#include "fuzz/table.hpp"
#include "llmt/outliers.hpp"
#include "oracles/oracles.hpp"

namespace fuzz_fit {
namespace {

llmt::FitOptions options_of(fuzz::Bytes& bytes, const fuzz::Table& table, Eigen::VectorXd& weights) {
  using llmt::GrowthRule;
  using llmt::ValidityChoice;
  static const std::vector<GrowthRule> rules = {GrowthRule::rd, GrowthRule::rd,      GrowthRule::retis,  GrowthRule::ra,
                                                GrowthRule::m5, GrowthRule::lolimot, GrowthRule::hilomot};
  llmt::FitOptions options;
  options.rule = bytes.one_of(rules);
  options.max_leaves = bytes.below(6);
  options.min_leaf_samples = bytes.below(5);
  if (bytes.coin()) options.significance = 1.0;
  if (bytes.coin()) options.folds.count = bytes.coin() ? 2 : 0;
  if (bytes.byte() % 4 == 0) options.validity = bytes.coin() ? ValidityChoice::crisp : ValidityChoice::blend;
  if (bytes.byte() % 4 == 0) options.terms = llmt::LocalTerms::quadratic;
  if (bytes.byte() % 4 == 0) options.sparse = llmt::SparseChoice::always;
  if (bytes.byte() % 4 == 0) options.pruning = llmt::Pruning::weakest_link;
  options.shared_partition = bytes.coin();
  if (bytes.byte() % 4 == 0) {
    weights = Eigen::VectorXd::Ones(table.inputs.rows());
    for (double& weight : weights) weight = bytes.below(4);
  }
  options.max_threads = 1;
  return options;
}

// Options that the rule does not have, and tables that are too small, are refused; both are said.
void any_fit(fuzz::Bytes& bytes) {
  const fuzz::Table table = fuzz::table_of(bytes, 40, 3, 1 + bytes.below(2), true);
  Eigen::VectorXd weights;
  const llmt::FitOptions options = options_of(bytes, table, weights);
  try {
    const llmt::FitResult result =
        llmt::fit({.inputs = table.inputs, .outputs = table.outputs, .weights = weights}, options);
    fuzz::require(result.model.predict(table.inputs, 1).allFinite(), "predictions are finite");
    const std::string json = llmt::to_json(result.model);
    fuzz::require(llmt::to_json(llmt::from_json(json)) == json, "a model survives writing");
  } catch (const std::invalid_argument& error) {
    fuzz::require(error.what()[0] != '\0', "a refusal says why");
  }
}

// In-sample, of the local models as they stand. The guards (docs/algorithms/guards.md) hold them back at single
// outermost rows, so that predictions may be worse than least squares there.
double rss_of(const llmt::Model& model, const fuzz::Table& table) {
  const Eigen::MatrixXi leaf_of = model.leaf_of(table.inputs, 1);
  const std::vector<llmt::Leaf> leaves = model.leaves(0);
  double rss = 0.0;
  for (Eigen::Index i = 0; i < table.inputs.rows(); ++i) {
    const llmt::Node& node = model.partitions().front().nodes[leaves[leaf_of(i, 0)].node];
    double residual = table.outputs(i, 0) - node.value(0);
    for (std::size_t k = 0; k < model.regressors().size(); ++k) {
      const llmt::Regressor& regressor = model.regressors()[k];
      residual -= node.slope(0, k) * (table.inputs(i, regressor.input) - regressor.centre);
    }
    rss += residual * residual;
  }
  return rss;
}

void not_worse_than_least_squares(fuzz::Bytes& bytes) {
  const fuzz::Table table = fuzz::table_of(bytes, 60, 3, 1, false);
  llmt::FitOptions options;
  options.max_leaves = 1 + bytes.below(5);
  options.min_leaf_samples = 1 + bytes.below(8);
  options.significance = 1.0;
  options.validity = llmt::ValidityChoice::crisp;
  options.folds.count = 0;
  options.expert.shrinkages = {0.0};
  options.max_threads = 1;
  const llmt::DominantRows dominant = llmt::dominant_rows(table.outputs.col(0));
  if (dominant.hide_the_others) return;  // refused
  const llmt::FitResult result = llmt::fit(table.inputs, table.outputs, options);
  const double rss = rss_of(result.model, table);
  const auto straight = static_cast<double>(oracle::rss(table.inputs, table.outputs));
  const double squares = table.outputs.squaredNorm();
  // Rounding: of the least squares themselves, and of the sums of squares.
  fuzz::require(
      rss <= straight * (1.0 + 1e-6) + 1e-10 * squares,
      fmt::format("the tree's {} is not above {} of least squares, {} of the outputs", rss, straight, squares));
}

}  // namespace

FUZZ_TARGET(fit) {
  fuzz::Bytes bytes(data, size);
  if (bytes.coin()) {
    any_fit(bytes);
  } else {
    not_worse_than_least_squares(bytes);
  }
  return 0;
}

}  // namespace fuzz_fit
