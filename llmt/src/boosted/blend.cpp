#include "boosted/blend.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <optional>
#include <string>
#include <utility>

#include "boosted/linear_start.hpp"
#include "boosted/one_tree.hpp"

namespace llmt {
namespace {

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

// A variant in all folds.
struct Folds {
  std::vector<double> rounds;                      // that were best in each
  std::vector<std::vector<Eigen::VectorXd>> path;  // residuals of its held-out rows, by rounds

  double mean_rounds(std::size_t without) const {
    double sum = 0.0;
    for (std::size_t k = 0; k < rounds.size(); ++k) sum += k == without ? 0.0 : rounds[k];
    return sum / static_cast<double>(rounds.size() - (without < rounds.size() ? 1 : 0));
  }

  // With as many rounds as the other folds ask for, since its own would flatter.
  const Eigen::VectorXd& residuals(std::size_t fold) const {
    const auto asked = static_cast<std::size_t>(std::round(mean_rounds(fold)));
    return path[fold][std::min(asked, path[fold].size() - 1)];
  }
};

constexpr std::size_t no_fold = std::numeric_limits<std::size_t>::max();

class BlendFit {
 public:
  BlendFit(const BoostingData& data, const Eigen::VectorXd& output, Random& random)
      : data_(data), output_(output), random_(random) {
    all_.resize(output.size());
    std::iota(all_.begin(), all_.end(), 0);
  }

  Folds in_folds(const Variant& variant, Work& work) {
    Folds folds;
    for (const HoldOut& rows : data_.hold_outs) {
      Work part(work, work.left() / static_cast<double>(data_.hold_outs.size() - folds.rounds.size()));
      RoundOptions options = variant.rounds;
      options.keep_path = true;
      const Rounds rounds = boost(data_.rows, left_of(start_of(variant, rows.train)), rows.train, rows.held_out, {},
                                  options, random_, part);
      folds.rounds.push_back(static_cast<double>(rounds.trees.size()));
      folds.path.push_back(rounds.path);
    }
    return folds;
  }

  SumPart on_all(const Variant& variant, double rounds, Work& work) {
    SumPart part{.rate = variant.rounds.rate, .rounds = {}, .start = start_of(variant, all_)};
    RoundOptions options = variant.rounds;
    options.most_rounds = static_cast<int>(std::ceil(more_trees * std::round(rounds)));
    part.rounds = boost(data_.rows, left_of(part.start), all_, {}, {}, options, random_, work);
    return part;
  }

 private:
  std::vector<BoostedTree> start_of(const Variant& variant, const std::vector<int>& train) const {
    return variant.has_start ? linear_start(data_.rows, output_, train) : std::vector<BoostedTree>();
  }
  Eigen::VectorXd left_of(const std::vector<BoostedTree>& start) const {
    return output_ - values_of(start, data_.rows);
  }

  const BoostingData& data_;
  const Eigen::VectorXd& output_;
  Random& random_;
  std::vector<int> all_;
};

std::vector<int> all_of(Eigen::Index count) {
  std::vector<int> all(count);
  std::iota(all.begin(), all.end(), 0);
  return all;
}

double rmse_of(const Eigen::VectorXd& residuals, const Eigen::VectorXd& weights) {
  return std::sqrt(residuals.cwiseAbs2().dot(weights) / weights.sum());
}

double train_rmse_of(const std::vector<SumPart>& parts, const Eigen::VectorXd& weights) {
  Eigen::VectorXd residuals = Eigen::VectorXd::Zero(weights.size());
  for (const SumPart& part : parts) residuals += part.share * part.rounds.residuals;
  return rmse_of(residuals, weights);
}

constexpr const char* name_of_tree = "one tree";

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

Blend blend(const BoostingData& data, const Eigen::VectorXd& output, const RoundOptions& usual, bool is_rate_given,
            Random& random, Work& work) {
  Work growing(work, 0.3);
  const std::optional<OneTree> tree = one_tree(data, output, usual.max_threads, growing);
  const std::vector<Variant> variants = variants_of(usual, is_rate_given, tree.has_value());
  BlendFit fit(data, output, random);
  std::vector<Folds> folds;
  Eigen::MatrixXd residuals(output.size(), std::ssize(variants) + (tree ? 1 : 0));
  Blend result;
  Work searching(work, 0.7 * work.left());
  for (const Variant& variant : variants) {
    Work part(searching, searching.left() / static_cast<double>(variants.size() - folds.size()));
    folds.push_back(fit.in_folds(variant, part));
    auto column = residuals.col(std::ssize(folds) - 1);
    for (std::size_t k = 0; k < data.hold_outs.size(); ++k)
      column(data.hold_outs[k].held_out) = folds.back().residuals(k);
    result.variants.push_back({.name = variant.name, .rmse = rmse_of(column, data.rows.weights)});
  }
  if (tree) {
    residuals.rightCols(1) = tree->residuals;
    result.variants.push_back({.name = name_of_tree, .rmse = rmse_of(tree->residuals, data.rows.weights)});
  }
  result.residuals.resize(output.size());
  for (const HoldOut& rows : data.hold_outs) {  // with the shares that the other folds ask for
    const Eigen::VectorXd shares = shares_of(residuals, data.rows.weights, rows.train);
    result.residuals(rows.held_out) = residuals(rows.held_out, Eigen::all) * shares;
  }
  result.rmse = rmse_of(result.residuals, data.rows.weights);
  const Eigen::VectorXd shares = shares_of(residuals, data.rows.weights, all_of(output.size()));
  for (std::size_t k = 0; k < result.variants.size(); ++k) {
    Work part(work, work.left() / static_cast<double>(result.variants.size() - k));
    const double share = shares(static_cast<Eigen::Index>(k));
    if (share == 0.0) continue;
    result.variants[k].share = share;
    result.parts.push_back(k < variants.size() ? fit.on_all(variants[k], folds[k].mean_rounds(no_fold), part)
                                               : part_of(tree->tree, output, data.rows));
    result.parts.back().share = share;
  }
  result.train_rmse = train_rmse_of(result.parts, data.rows.weights);
  return result;
}

Blend with_one_tree(const BoostingData& data, const Eigen::VectorXd& output, NamedSum sum,
                    const Eigen::VectorXd& residuals, std::span<const GrowthRule> rules, int max_threads, Work& work) {
  const HoldOut& rows = data.hold_outs.front();
  const Eigen::VectorXd weights = data.rows.weights(rows.held_out);
  Blend result{.parts = {}, .variants = {}, .residuals = residuals, .rmse = rmse_of(residuals, weights)};
  result.variants.push_back({sum.name, result.rmse, 1.0});
  result.parts.push_back(std::move(sum.sum));
  result.train_rmse = train_rmse_of(result.parts, data.rows.weights);
  Work trying(work, 0.2);
  const auto tried = try_tree(data, output, rows, rules, max_threads, trying);
  if (!tried) return result;
  result.variants.push_back({name_of_tree, rmse_of(tried->residuals, weights), 0.0});
  if (result.variants.back().rmse >= result.rmse) return result;
  Work growing(work, work.left());
  const std::optional<BoostedTree> tree = tree_of_all(data, output, *tried, growing);
  if (!tree) return result;
  Eigen::MatrixXd both(weights.size(), 2);
  both << residuals, tried->residuals;
  const Eigen::VectorXd shares = shares_of(both, weights, all_of(weights.size()));
  result.residuals = both * shares;
  result.rmse = rmse_of(result.residuals, weights);
  result.parts.push_back(part_of(*tree, output, data.rows));
  for (Eigen::Index k = 0; k < 2; ++k) result.variants[k].share = result.parts[k].share = shares(k);
  std::erase_if(result.parts, [](const SumPart& part) { return part.share == 0.0; });
  result.train_rmse = train_rmse_of(result.parts, data.rows.weights);
  return result;
}

}  // namespace llmt
