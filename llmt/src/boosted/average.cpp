#include "boosted/average.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>

#include "boosted/linear_start.hpp"
#include "boosted/one_tree.hpp"

namespace llmt {
namespace {

constexpr const char* name_of_tree = "one tree";

struct Variant {
  std::string name;
  RoundOptions rounds;
  bool has_start = false;
};

// One tree knows of linear models; without it a variant starts from one.
std::vector<Variant> variants_of(const RoundOptions& usual, bool is_rate_given, bool has_tree) {
  RoundOptions soft = usual;
  soft.tree.softness = usual_softness;
  if (!is_rate_given) soft.rate = soft_rate;
  std::vector<Variant> variants = {{"symmetric", usual}, {"soft", soft}};
  if (!has_tree) variants.push_back({"soft from a linear model", soft, true});
  return variants;
}

SumPart boosted(const BoostingData& data, const Eigen::VectorXd& output, const Variant& variant, const HoldOut& rows,
                Random& random, Work& work) {
  SumPart part{.rate = variant.rounds.rate};
  if (variant.has_start) part.start = linear_start(data.rows, output, rows.train);
  part.rounds = boost(data.rows, output - values_of(part.start, data.rows), rows.train, rows.held_out, {},
                      variant.rounds, random, work);
  return part;
}

// A variant in all folds.
struct Folds {
  std::vector<double> rounds;                      // that were best in each
  std::vector<std::vector<Eigen::VectorXd>> path;  // residuals of its held-out rows, by rounds

  double mean_rounds(std::optional<std::size_t> without = {}) const {
    double sum = 0.0;
    for (std::size_t k = 0; k < rounds.size(); ++k) sum += k == without ? 0.0 : rounds[k];
    return sum / static_cast<double>(rounds.size() - (without ? 1 : 0));
  }

  // With as many rounds as the other folds ask for, since its own would flatter.
  const Eigen::VectorXd& residuals(std::size_t fold) const {
    const auto asked = static_cast<std::size_t>(std::round(mean_rounds(fold)));
    return path[fold][std::min(asked, path[fold].size() - 1)];
  }
};

Folds in_folds(const BoostingData& data, const Eigen::VectorXd& output, Variant variant, Random& random, Work& work) {
  variant.rounds.keep_path = true;
  Folds folds;
  for (const HoldOut& rows : data.hold_outs) {
    Work part(work, work.left() / static_cast<double>(data.hold_outs.size() - folds.rounds.size()));
    Rounds rounds = boosted(data, output, variant, rows, random, part).rounds;
    folds.rounds.push_back(static_cast<double>(rounds.trees.size()));
    folds.path.push_back(std::move(rounds.path));
  }
  return folds;
}

SumPart on_all(const BoostingData& data, const Eigen::VectorXd& output, Variant variant, double rounds, Random& random,
               Work& work) {
  variant.rounds.most_rounds = static_cast<int>(std::ceil(more_trees * std::round(rounds)));
  return boosted(data, output, variant, {all_rows(output.size()), {}}, random, work);
}

double train_rmse_of(const std::vector<SumPart>& parts, const Eigen::VectorXd& weights) {
  Eigen::VectorXd residuals = Eigen::VectorXd::Zero(weights.size());
  for (const SumPart& part : parts) residuals += part.share * part.rounds.residuals;
  return rmse_of(residuals, weights);
}

}  // namespace

Eigen::VectorXd shares_of(const Eigen::MatrixXd& residuals, const Eigen::VectorXd& weights,
                          const std::vector<int>& rows) {
  const Eigen::Index count = residuals.cols();
  const Eigen::MatrixXd e = residuals(rows, Eigen::all);
  const Eigen::VectorXd w = weights(rows);
  Eigen::MatrixXd products = e.transpose() * w.asDiagonal() * e / w.sum();
  const double smallest = products.diagonal().minCoeff();
  if (!(smallest > 0.0)) {  // variants without error
    const Eigen::VectorXd exact = (products.diagonal().array() <= 0.0).cast<double>();
    return exact / exact.sum();
  }
  products.diagonal().array() += smallest / std::sqrt(static_cast<double>(rows.size()));
  // Of a set of variants the best shares are a = P^-1 1 / (1'P^-1 1), with the value 1 / (1'P^-1 1). The best set whose
  // shares are not negative has the smallest value.
  Eigen::VectorXd best = Eigen::VectorXd::Zero(count);
  double most = 0.0;
  for (unsigned set = 1; set < 1U << count; ++set) {
    std::vector<Eigen::Index> in;
    for (Eigen::Index k = 0; k < count; ++k) {
      if ((set >> k & 1U) != 0) in.push_back(k);
    }
    const Eigen::VectorXd shares = products(in, in).llt().solve(Eigen::VectorXd::Ones(std::ssize(in)));
    if (shares.minCoeff() < 0.0 || shares.sum() <= most) continue;
    most = shares.sum();
    best.setZero();
    best(in) = shares / most;
  }
  return best;
}

Average average(const BoostingData& data, const Eigen::VectorXd& output, const RoundOptions& usual, bool is_rate_given,
                Random& random, Work& work) {
  Work growing(work, 0.3);
  const std::optional<OneTree> tree = one_tree(data, output, usual.max_threads, growing);
  const std::vector<Variant> variants = variants_of(usual, is_rate_given, tree.has_value());
  const Eigen::VectorXd& weights = data.rows.weights;
  std::vector<Folds> folds;
  Eigen::MatrixXd residuals(output.size(), std::ssize(variants) + (tree ? 1 : 0));
  Average result;
  Work searching(work, 0.7 * work.left());
  for (const Variant& variant : variants) {
    Work part(searching, searching.left() / static_cast<double>(variants.size() - folds.size()));
    auto column = residuals.col(std::ssize(folds));
    folds.push_back(in_folds(data, output, variant, random, part));
    for (std::size_t k = 0; k < data.hold_outs.size(); ++k)
      column(data.hold_outs[k].held_out) = folds.back().residuals(k);
    result.variants.push_back({variant.name, rmse_of(column, weights)});
  }
  if (tree) {
    residuals.rightCols(1) = tree->residuals;
    result.variants.push_back({name_of_tree, rmse_of(tree->residuals, weights)});
  }
  result.residuals.resize(output.size());
  for (const HoldOut& rows : data.hold_outs) {  // with the shares that the other folds ask for
    const Eigen::VectorXd shares = shares_of(residuals, weights, rows.train);
    result.residuals(rows.held_out) = residuals(rows.held_out, Eigen::all) * shares;
  }
  result.rmse = rmse_of(result.residuals, weights);
  const Eigen::VectorXd shares = shares_of(residuals, weights, all_rows(output.size()));
  for (std::size_t k = 0; k < result.variants.size(); ++k) {
    Work part(work, work.left() / static_cast<double>(result.variants.size() - k));
    const double share = shares(static_cast<Eigen::Index>(k));
    if (share == 0.0) continue;
    result.variants[k].share = share;
    result.parts.push_back(k < variants.size() ? on_all(data, output, variants[k], folds[k].mean_rounds(), random, part)
                                               : part_of(tree->tree, output, data.rows));
    result.parts.back().share = share;
  }
  result.train_rmse = train_rmse_of(result.parts, weights);
  return result;
}

Average with_one_tree(const BoostingData& data, const Eigen::VectorXd& output, Average sum, int max_threads,
                      Work& work) {
  const HoldOut& rows = data.hold_outs.front();
  const Eigen::VectorXd weights = data.rows.weights(rows.held_out);
  Work trying(work, 0.2);
  const auto tried = try_tree(data, output, rows, data.regime.rules_of_tree, max_threads, trying);
  if (!tried) return sum;
  sum.variants.push_back({name_of_tree, rmse_of(tried->residuals, weights)});
  if (sum.variants.back().rmse >= sum.rmse) return sum;
  Work growing(work, work.left());
  const std::optional<BoostedTree> tree = tree_of_all(data, output, *tried, growing);
  if (!tree) return sum;
  Eigen::MatrixXd both(weights.size(), 2);
  both << sum.residuals, tried->residuals;
  const Eigen::VectorXd shares = shares_of(both, weights, all_rows(weights.size()));
  sum.residuals = both * shares;
  sum.rmse = rmse_of(sum.residuals, weights);
  sum.parts.push_back(part_of(*tree, output, data.rows));
  for (Eigen::Index k = 0; k < 2; ++k) {
    sum.parts[k].share = shares(k);
    sum.variants.end()[k - 2].share = shares(k);
  }
  if (shares(1) > 0.0) sum.tree = tried->options;
  std::erase_if(sum.parts, [](const SumPart& part) { return part.share == 0.0; });
  sum.train_rmse = train_rmse_of(sum.parts, data.rows.weights);
  return sum;
}

}  // namespace llmt
