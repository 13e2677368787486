#include "llmt/boosted_explain.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <memory>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "base/checks.hpp"
#include "base/parallel.hpp"
#include "explain/coalitions.hpp"
#include "explain/tree_game.hpp"
#include "llmt/limits.hpp"

namespace llmt {
namespace {

void check_table(const std::string& function, const std::string& argument, const BoostedModel& model,
                 const Eigen::Ref<const Eigen::MatrixXd>& rows) {
  if (rows.rows() < 1 || rows.cols() != model.num_inputs()) {
    throw std::invalid_argument(fmt::format("{}: {} is {} x {}, it must have a row and the model's {} inputs", function,
                                            argument, rows.rows(), rows.cols(), model.num_inputs()));
  }
  check_finite_or_missing(function.c_str(), argument.c_str(), rows);
}

// How the contributions to one output are found.
struct Game {
  std::vector<const GameRule*> rules = {};         // for each tree the one that integrates its games
  std::shared_ptr<const BoostedModel> alone = {};  // the sum by itself: all coalitions of `inputs` are asked for
  std::vector<int> inputs = {};
};

// A split on a direction depends on all of its inputs, which a walk through a tree would try one by one, in every tree.
Game game_of(const BoostedModel& model, std::size_t output, std::map<int, GameRule>& rules) {
  const BoostedSum& sum = model.sums()[output];
  Game game;
  const auto is_of_many = [](const BoostedFeature& feature) { return feature.inputs.size() > 2; };
  if (std::ranges::any_of(sum.features, is_of_many)) {
    auto alone = model.sums().size() == 1  // models of many trees are large: no copy of one
                     ? std::shared_ptr<const BoostedModel>(std::shared_ptr<void>(), &model)
                     : std::make_shared<const BoostedModel>(model.inputs(), std::vector{model.outputs()[output]},
                                                            model.deviations(), std::vector{sum});
    const std::vector<bool> used = used_inputs(*alone);
    if (std::ranges::count(used, true) <= most_in_coalitions) {
      for (int input = 0; input < std::ssize(used); ++input) {
        if (used[input]) game.inputs.push_back(input);
      }
      game.alone = std::move(alone);
      return game;
    }
  }
  for (const BoostedTree& tree : sum.trees) {
    const int order = order_for(tree, sum.features);
    game.rules.push_back(&rules.try_emplace(order, order).first->second);
  }
  return game;
}

[[noreturn]] void refuse(std::size_t output, std::size_t tree) {
  throw std::invalid_argument(fmt::format(
      "llmt::attribute: sums/{}/trees/{}: more than {} trials of an input: too many inputs meet in pairs, at "
      "the limits of a leaf, or where soft splits end by smallest_share",
      output, tree, most(Limit::sum_trials)));
}

// Rows of the background that a tree stays in the cache for.
constexpr Eigen::Index pairs_at_once = 32;

// Contributions of a row, outputs x inputs. `rows_of_background`: a column for each row.
Eigen::MatrixXd contributions_of(const BoostedModel& model, const std::vector<Game>& games, const Eigen::VectorXd& x,
                                 const Eigen::MatrixXd& rows_of_background, Work& work) {
  Eigen::MatrixXd contributions(model.num_outputs(), model.num_inputs());
  for (std::size_t o = 0; o < model.sums().size(); ++o) {
    const auto output = static_cast<Eigen::Index>(o);
    if (games[o].alone) {
      contributions.row(output) =
          shapley_values(*games[o].alone, games[o].inputs, x, rows_of_background, work).transpose();
      continue;
    }
    const BoostedSum& sum = model.sums()[o];
    Eigen::VectorXd values = Eigen::VectorXd::Zero(model.num_inputs());
    for (Eigen::Index first = 0; first < rows_of_background.cols(); first += pairs_at_once) {
      work.check();
      std::vector<TwoRows> pairs;
      for (Eigen::Index row = first; row < std::min(first + pairs_at_once, rows_of_background.cols()); ++row) {
        pairs.emplace_back(model, sum, x.data(), rows_of_background.col(row).data(), work);
      }
      for (std::size_t k = 0; k < sum.trees.size(); ++k) {
        for (TwoRows& pair : pairs) {
          if (!pair.add_values(sum.trees[k], *games[o].rules[k], sum.rate, values)) refuse(o, k);
        }
      }
    }
    contributions.row(output) = values.transpose() / static_cast<double>(rows_of_background.cols());
  }
  return contributions;
}

}  // namespace

Attributions attribute_rows(const BoostedModel& model, const Eigen::Ref<const Eigen::MatrixXd>& inputs,
                            const Eigen::Ref<const Eigen::MatrixXd>& background, int max_threads,
                            const Progress& progress) {
  check_table("llmt::attribute", "inputs", model, inputs);
  check_table("llmt::attribute", "background", model, background);
  Attributions result{
      .predictions = model.predict(inputs, max_threads),
      .reference = model.predict(background, max_threads).colwise().mean().transpose(),
      .contributions = {static_cast<std::size_t>(model.num_outputs()), Eigen::MatrixXd(inputs.rows(), inputs.cols())}};
  const Eigen::MatrixXd rows_of_background = background.transpose();
  std::map<int, GameRule> by_order;
  std::vector<Game> games;
  for (std::size_t output = 0; output < model.sums().size(); ++output) {
    games.push_back(game_of(model, output, by_order));
  }
  Work work(progress);
  parallel_for(inputs.rows(), max_threads, [&](Eigen::Index row) {
    const Eigen::MatrixXd of_row =
        contributions_of(model, games, inputs.row(row).transpose(), rows_of_background, work);
    for (Eigen::Index o = 0; o < of_row.rows(); ++o) result.contributions[o].row(row) = of_row.row(o);
    work.did(1.0 / static_cast<double>(inputs.rows()));
  });
  work.finish();
  return result;
}

Attribution attribute(const BoostedModel& model, const Eigen::Ref<const Eigen::VectorXd>& point,
                      const Eigen::Ref<const Eigen::MatrixXd>& background) {
  const Attributions rows = attribute_rows(model, point.transpose(), background, 1);
  Attribution result{.prediction = rows.predictions.row(0).transpose(),
                     .reference = rows.reference,
                     .contributions = Eigen::MatrixXd(model.num_outputs(), model.num_inputs())};
  for (Eigen::Index o = 0; o < model.num_outputs(); ++o) result.contributions.row(o) = rows.contributions[o].row(0);
  return result;
}

Eigen::MatrixXd background_of(const Eigen::Ref<const Eigen::MatrixXd>& inputs, Eigen::Index most) {
  const Eigen::Index count = std::min(inputs.rows(), most);
  Eigen::MatrixXd rows(count, inputs.cols());
  for (Eigen::Index k = 0; k < count; ++k) rows.row(k) = inputs.row(k * inputs.rows() / count);
  return rows;
}

Eigen::MatrixXd importance(const BoostedModel& model, const Eigen::Ref<const Eigen::MatrixXd>& inputs, int max_threads,
                           const Progress& progress) {
  check_table("llmt::importance", "inputs", model, inputs);
  const Attributions rows = attribute_rows(model, background_of(inputs, boosted_importance_rows),
                                           background_of(inputs, boosted_importance_background), max_threads, progress);
  Eigen::MatrixXd shares(model.num_outputs(), model.num_inputs());
  for (Eigen::Index o = 0; o < model.num_outputs(); ++o) {
    shares.row(o) = rows.contributions[o].cwiseAbs().colwise().sum();
    const double total = shares.row(o).sum();
    const OutputColumn& output = model.outputs()[o];
    const double rounding = 1e-14 * std::max(std::abs(output.low), std::abs(output.high));
    shares.row(o) *= total > rounding * static_cast<double>(rows.predictions.rows()) ? 1.0 / total : 0.0;
  }
  return shares;
}

Eigen::MatrixXd partial_dependence(const BoostedModel& model, const Eigen::Ref<const Eigen::MatrixXd>& inputs,
                                   Eigen::Index input, const Eigen::Ref<const Eigen::VectorXd>& values, int max_threads,
                                   const Progress& progress) {
  check_table("llmt::partial_dependence", "inputs", model, inputs);
  if (input < 0 || input >= model.num_inputs()) {
    throw std::invalid_argument(fmt::format("llmt::partial_dependence: there is no input {}, the model has {} inputs",
                                            input, model.num_inputs()));
  }
  Eigen::MatrixXd result(values.size(), model.num_outputs());
  Eigen::MatrixXd rows = inputs;
  Work work(progress);
  for (Eigen::Index k = 0; k < values.size(); ++k) {
    rows.col(input).setConstant(values(k));
    result.row(k) = model.predict(rows, max_threads).colwise().mean();
    work.did(1.0 / static_cast<double>(values.size()));
  }
  work.finish();
  return result;
}

}  // namespace llmt
