#include "selection.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <optional>
#include <set>

#include "evaluator.hpp"
#include "joint_fit.hpp"
#include "parallel.hpp"

namespace llmt {
namespace {

/// Held-out rows that are enough to tell good candidates from bad ones.
constexpr std::ptrdiff_t screening_rows = 1000;

/// Widths that go on to all folds.
constexpr std::size_t finalists = 2;

/// Candidates of each finalist that are compared on all folds, whatever their leaf count.
constexpr std::size_t candidates_on_all_folds = 3;

/// Leaves of the tree that are asked whether they agree on a slope beyond the training extent.
constexpr std::ptrdiff_t leaves_that_agree = 32;

/// A tree has to be better than one leaf by more than this many standard errors of the gain.
constexpr double standard_errors_of_a_gain = 2.0;

/// Up to this many unknowns every ridge is tried with every leaf count; beyond, in screening, the middle one.
constexpr std::ptrdiff_t cheap_unknowns = 300;

/// The tree with half widths for a validity; splits with a jump of at least `jump` stay crisp.
Partition blended(const TrainingRows& training, const GrownTree& grown, const Validity& validity, double jump) {
  Partition partition = grown.partition;
  partition.validity = validity;
  set_half_widths(partition, training.low(), training.high());
  for (std::size_t i = 0; i < partition.nodes.size(); ++i) {
    if (grown.jumps(static_cast<std::ptrdiff_t>(i)) >= jump) {
      partition.nodes[i].half_width = 0.0;
    }
  }
  return partition;
}

/// 2, 3, 4, 6, 9, ..., `largest`: each half as large again as the one before, counted from the largest down.
std::vector<std::ptrdiff_t> leaf_counts(std::ptrdiff_t largest) {
  std::vector<std::ptrdiff_t> counts;
  for (std::ptrdiff_t count = largest; count > 1; count = std::min(count - 1, (count * 2 + 1) / 3)) {
    counts.push_back(count);
  }
  std::reverse(counts.begin(), counts.end());
  return counts;
}

/// How leaves share the space: what the half widths of the transitions come from.
struct Shape {
  double width;
  double jump;
};

/// Position of a candidate among shapes, leaf counts and ridges.
struct Key {
  std::size_t shape;
  std::size_t leaves;
  std::size_t ridge;
  std::size_t shrinkage;
  auto operator<=>(const Key&) const = default;
};

using Errors = std::map<Key, double>;  // sum of squares over the held-out rows of a fold

double ridge_at(const Candidates& candidates, std::size_t index) {
  return candidates.ridges.empty() ? 0.0 : candidates.ridges[index];
}

/// All widths with all jumps, but for those that keep the same splits crisp as one before.
std::vector<Shape> distinct_shapes(const Candidates& candidates, const std::vector<GrownTree>& grown) {
  std::vector<Shape> shapes;
  std::set<std::ptrdiff_t> seen;
  for (const double jump : candidates.jumps) {
    std::ptrdiff_t kept = 0;
    for (const GrownTree& tree : grown) {
      kept += (tree.jumps.array() >= jump).count();
    }
    if (seen.insert(kept).second) {
      for (const double width : candidates.widths) {
        shapes.push_back({width, jump});
      }
    }
  }
  return shapes;
}

/// Errors of one fold and width, for the leaf counts and ridges that `wanted` accepts.
template <class Wanted>
Errors evaluate(const FoldRows& fold, const GrownTree& grown, const Candidates& candidates,
                const std::vector<Shape>& shapes, std::size_t shape, const std::vector<std::ptrdiff_t>& counts,
                const Eigen::VectorXd& weights, bool stop_early, const Wanted& wanted, int max_threads) {
  const Partition partition =
      blended(fold.training, grown, {candidates.kind, shapes[shape].width, candidates.smoothness}, shapes[shape].jump);
  // Sums over a subtree are the validities of its root for blends, so that one fit serves all leaf counts; Gaussians
  // are different ones for every leaf count.
  std::optional<JointFit> shared;
  if (candidates.kind == ValidityKind::blend) {
    shared.emplace(fold.training, partition, max_threads);
  }
  const std::size_t ridges = std::max<std::size_t>(candidates.ridges.size(), 1);
  Errors errors;
  double best = std::numeric_limits<double>::infinity();
  int without_gain = 0;
  for (std::size_t k = 0; k < counts.size() && without_gain < 2; ++k) {
    std::vector<Key> tried;
    for (std::size_t r = 0; r < ridges; ++r) {
      for (std::size_t s = 0; s < candidates.shrinkages.size(); ++s) {
        if (wanted(Key{shape, k, r, s})) {
          tried.push_back({shape, k, r, s});
        }
      }
    }
    if (tried.empty()) {
      continue;
    }
    const std::ptrdiff_t leaves = std::min(counts[k], grown.partition.num_leaves());
    std::vector<Partition> models;
    std::optional<JointFit> own;
    if (!shared) {
      own.emplace(fold.training, prefix(partition, leaves), max_threads);
    }
    const JointFit& fit = shared ? *shared : *own;
    if (candidates.estimation == Estimation::joint) {
      std::vector<Regularisation> values;
      for (const Key& key : tried) {
        values.push_back({ridge_at(candidates, key.ridge), candidates.shrinkages[key.shrinkage]});
      }
      models = fit.joint(leaves, values);
    } else {
      for (const Key& key : tried) {
        models.push_back(candidates.estimation == Estimation::local
                             ? fit.local(leaves, candidates.shrinkages[key.shrinkage])
                             : fit.as_grown(leaves));
      }
    }
    double here = std::numeric_limits<double>::infinity();
    for (std::size_t i = 0; i < models.size(); ++i) {
      const double error = squared_error(models[i], fold.held_out, weights);
      errors[tried[i]] = error;
      here = std::min(here, error);
    }
    without_gain = stop_early && here >= best ? without_gain + 1 : 0;
    best = std::min(best, here);
  }
  return errors;
}

/// A sum over folds of errors that all of them have.
std::map<Key, std::vector<double>> common(const std::vector<Errors>& folds) {
  std::map<Key, std::vector<double>> result;
  for (const auto& [key, error] : folds.front()) {
    std::vector<double> all;
    for (const Errors& fold : folds) {
      if (const auto found = fold.find(key); found != fold.end()) {
        all.push_back(found->second);
      }
    }
    if (all.size() == folds.size()) {
      result[key] = std::move(all);
    }
  }
  return result;
}

double sum(const std::vector<double>& values) {
  double total = 0.0;
  for (const double value : values) {
    total += value;
  }
  return total;
}

/// Goes back to one leaf if the gain on it is within chance: not more than two standard errors of the paired
/// differences of the folds. A single hold-out has no such measure.
Selection prefer_least_squares(Selection selection, const Candidates& candidates) {
  const Eigen::VectorXd gain = selection.best_of_kind.front().fold_rmse - selection.chosen.fold_rmse;
  if (!candidates.crisp || gain.size() < 2) {
    return selection;
  }
  const double folds = static_cast<double>(gain.size());
  const double error = std::sqrt((gain.array() - gain.mean()).square().sum() / (folds - 1.0) / folds);
  if (!(gain.mean() > standard_errors_of_a_gain * error)) {
    selection.chosen = selection.best_of_kind.front();
  }
  return selection;
}

}  // namespace

Eigen::MatrixXd agreed_slope(const Partition& grown) {
  const Partition first = prefix(grown, leaves_that_agree);
  const Node& root = first.nodes.front();
  Eigen::MatrixXd spread = Eigen::MatrixXd::Zero(root.slope.rows(), root.slope.cols());
  for (const Node& node : first.nodes) {
    if (node.is_leaf()) {
      spread +=
          static_cast<double>(node.samples) / static_cast<double>(root.samples) * (node.slope - root.slope).cwiseAbs2();
    }
  }
  Eigen::MatrixXd slope = root.slope;
  for (std::ptrdiff_t o = 0; o < spread.rows(); ++o) {
    for (std::ptrdiff_t k = 0; k < spread.cols(); ++k) {
      const double squared = root.slope(o, k) * root.slope(o, k);
      slope(o, k) *= squared > spread(o, k) ? 1.0 - spread(o, k) / squared : 0.0;
    }
  }
  return slope;
}

Eigen::VectorXd prefix_squared_errors(const Partition& partition, const TrainingRows& rows,
                                      const Eigen::VectorXd& weights) {
  const Evaluator evaluator(partition, rows.columns, std::ssize(rows.regressors));
  Eigen::VectorXd change = Eigen::VectorXd::Zero(partition.num_leaves());  // of the sum, from M - 1 to M leaves
  Eigen::VectorXd values(std::ssize(partition.outputs));
  for (std::ptrdiff_t index = 0; index < num_chunks(rows); ++index) {
    const Chunk chunk = fetch(rows, index, partition.outputs);
    for (std::ptrdiff_t row = 0; row < chunk.count(); ++row) {
      const double* deviations = chunk.deviations.row(row).data();
      double previous = 0.0;
      for (int node = 0; node >= 0;) {
        evaluator.local(node, deviations, values.data());
        evaluator.finish(deviations, values.data());
        const double squared =
            chunk.weights(row) * weights.dot((chunk.outputs.row(row).transpose() - values).cwiseAbs2());
        // Nodes 2k-1 and 2k come with the k-th split, that is with k + 1 leaves.
        change((node + 1) / 2) += squared - previous;
        previous = squared;
        node = partition.nodes[static_cast<std::size_t>(node)].is_leaf()
                   ? -1
                   : evaluator.child_of(node, chunk.inputs.row(row).data());
      }
    }
  }
  for (std::ptrdiff_t leaves = 1; leaves < change.size(); ++leaves) {
    change(leaves) += change(leaves - 1);
  }
  return change.cwiseMax(0.0);
}

double squared_error(const Partition& partition, const TrainingRows& rows, const Eigen::VectorXd& weights) {
  const Evaluator evaluator(partition, rows.columns, std::ssize(rows.regressors));
  std::vector<Activation> active;
  Eigen::VectorXd values(std::ssize(partition.outputs));
  double total = 0.0;
  for (std::ptrdiff_t index = 0; index < num_chunks(rows); ++index) {
    const Chunk chunk = fetch(rows, index, partition.outputs);
    for (std::ptrdiff_t row = 0; row < chunk.count(); ++row) {
      evaluator.activate(chunk.inputs.row(row).data(), active);
      evaluator.combine(active, chunk.deviations.row(row).data(), values.data());
      total += chunk.weights(row) * weights.dot((chunk.outputs.row(row).transpose() - values).cwiseAbs2());
    }
  }
  return total;
}

Partition estimate(const TrainingRows& training, const GrownTree& grown, const Candidate& candidate, int max_threads) {
  Partition partition = prefix(blended(training, grown, candidate.validity, candidate.jump), candidate.leaves);
  if (candidate.leaves == 1) {
    partition.outer_slope.resize(0, 0);  // one linear model goes on as it is
  }
  if (candidate.validity.kind == ValidityKind::crisp) {
    const JointFit fit(training, std::move(partition), max_threads);
    return candidate.shrinkage > 0.0 ? fit.local(candidate.leaves, candidate.shrinkage)
                                     : fit.as_grown(candidate.leaves);
  }
  const JointFit fit(training, std::move(partition), max_threads);
  switch (candidate.estimation) {
    case Estimation::as_grown:
      return fit.as_grown(candidate.leaves);
    case Estimation::local:
      return fit.local(candidate.leaves, candidate.shrinkage);
    case Estimation::joint:
      break;
  }
  return std::move(fit.joint(candidate.leaves, {{candidate.ridge, candidate.shrinkage}}).front());
}

Selection select(const std::vector<FoldRows>& folds, const std::vector<GrownTree>& grown, const Candidates& candidates,
                 const Eigen::VectorXd& weights, int max_threads) {
  const std::size_t num_folds = folds.size();
  const std::size_t shrinkages = candidates.shrinkages.size();
  std::vector<std::vector<Eigen::VectorXd>> crisp(shrinkages, std::vector<Eigen::VectorXd>(num_folds));
  parallel_for(std::ssize(folds), max_threads, [&](std::ptrdiff_t f) {
    const FoldRows& fold = folds[static_cast<std::size_t>(f)];
    const GrownTree& tree = grown[static_cast<std::size_t>(f)];
    const JointFit fit(fold.training, tree.partition, max_threads);
    for (std::size_t s = 0; s < shrinkages; ++s) {
      const std::ptrdiff_t leaves = tree.partition.num_leaves();
      const Partition models =
          candidates.shrinkages[s] > 0.0 ? fit.local(leaves, candidates.shrinkages[s]) : fit.as_grown(leaves);
      crisp[s][static_cast<std::size_t>(f)] = prefix_squared_errors(models, fold.held_out, weights);
    }
  });
  std::ptrdiff_t largest = 0;
  double held_out_weight = 0.0;
  std::vector<double> fold_weight;
  for (std::size_t f = 0; f < num_folds; ++f) {
    largest = std::max(largest, crisp[0][f].size());
    fold_weight.push_back(total_weight(folds[f].held_out) * static_cast<double>(weights.size()));
    held_out_weight += fold_weight.back();
  }
  const auto described = [&](const Candidate& candidate, const std::vector<double>& errors) {
    CandidateError result{candidate, std::sqrt(sum(errors) / held_out_weight), 0.0};
    double mean = 0.0;
    std::vector<double> rmse;
    for (std::size_t f = 0; f < errors.size(); ++f) {
      rmse.push_back(std::sqrt(errors[f] / fold_weight[f]));
      mean += rmse.back() / static_cast<double>(errors.size());
    }
    for (const double value : rmse) {
      result.spread += (value - mean) * (value - mean);
    }
    result.spread = rmse.size() > 1 ? std::sqrt(result.spread / static_cast<double>(rmse.size() - 1)) : 0.0;
    result.fold_rmse = Eigen::Map<const Eigen::VectorXd>(rmse.data(), std::ssize(rmse));
    return result;
  };
  // A fold whose tree is smaller stays at its last one.
  const auto crisp_errors = [&](const Candidate& candidate, std::size_t shrinkage) {
    std::vector<double> errors;
    for (const Eigen::VectorXd& fold : crisp[shrinkage]) {
      errors.push_back(fold(std::min(candidate.leaves, fold.size()) - 1));
    }
    return errors;
  };
  Selection selection;
  selection.crisp_rmse = Eigen::VectorXd::Constant(largest, std::numeric_limits<double>::infinity());
  selection.best_of_kind.push_back(described({}, crisp_errors({}, 0)));
  CandidateError best_crisp = selection.best_of_kind.front();
  for (std::size_t s = 0; s < shrinkages; ++s) {
    for (std::ptrdiff_t leaves = 1; leaves <= largest; ++leaves) {
      const Candidate candidate{.shrinkage = candidates.shrinkages[s], .leaves = leaves};
      const CandidateError error = described(candidate, crisp_errors(candidate, s));
      selection.crisp_rmse(leaves - 1) = std::min(selection.crisp_rmse(leaves - 1), error.rmse);
      if (error.rmse < best_crisp.rmse) {
        best_crisp = error;
      }
    }
  }
  selection.chosen = selection.best_of_kind.front();
  if (candidates.crisp) {
    selection.best_of_kind.push_back(best_crisp);
    selection.chosen = best_crisp;
  }
  if (candidates.widths.empty() || largest < 2) {
    return prefer_least_squares(std::move(selection), candidates);
  }

  // Screening.
  const std::vector<Shape> shapes = distinct_shapes(candidates, grown);
  const std::vector<std::ptrdiff_t> counts = leaf_counts(largest);
  const std::ptrdiff_t coefficients = std::ssize(folds.front().training.regressors) + 1;
  std::size_t screening = 0;
  for (std::ptrdiff_t rows = 0; screening < num_folds && rows < screening_rows; ++screening) {
    rows += folds[screening].held_out.count();
  }
  const std::size_t num_shapes = shapes.size();
  const std::size_t middle = candidates.ridges.size() / 2;
  const std::size_t usual = shrinkages / 2;
  std::vector<Errors> screened(screening * num_shapes);
  parallel_for(std::ssize(screened), max_threads, [&](std::ptrdiff_t task) {
    const std::size_t fold = static_cast<std::size_t>(task) / num_shapes;
    const std::size_t shape = static_cast<std::size_t>(task) % num_shapes;
    screened[static_cast<std::size_t>(task)] = evaluate(
        folds[fold], grown[fold], candidates, shapes, shape, counts, weights, true,
        [&](const Key& key) {
          return key.shrinkage == usual && (counts[key.leaves] * coefficients <= cheap_unknowns || key.ridge == middle);
        },
        max_threads);
  });
  // Sum over the screening folds of every candidate that all of them have.
  const auto totals = [&](const std::vector<Errors>& all) {
    std::map<Key, double> result;
    for (std::size_t shape = 0; shape < num_shapes; ++shape) {
      std::vector<Errors> of_shape;
      for (std::size_t fold = 0; fold < screening; ++fold) {
        of_shape.push_back(all[fold * num_shapes + shape]);
      }
      for (const auto& [key, errors] : common(of_shape)) {
        result[key] = sum(errors);
      }
    }
    return result;
  };
  // The best of each width, best width first.
  const auto ranked = [&](const std::map<Key, double>& errors) {
    std::vector<std::pair<double, Key>> order;
    for (const auto& [key, error] : errors) {
      order.emplace_back(error, key);
    }
    std::sort(order.begin(), order.end());
    std::set<double> seen;
    std::erase_if(order, [&](const auto& entry) { return !seen.insert(shapes[entry.second.shape].width).second; });
    return order;
  };
  std::map<Key, double> screened_totals = totals(screened);
  std::vector<std::pair<double, Key>> best_of_width = ranked(screened_totals);
  best_of_width.resize(std::min(best_of_width.size(), finalists));

  // Other ridges and shrinkages at the finalists' best leaf counts.
  std::vector<Errors> refined(screening * num_shapes);
  parallel_for(std::ssize(refined), max_threads, [&](std::ptrdiff_t task) {
    const std::size_t fold = static_cast<std::size_t>(task) / num_shapes;
    const std::size_t shape = static_cast<std::size_t>(task) % num_shapes;
    for (const auto& [error, best] : best_of_width) {
      if (best.shape == shape) {
        refined[static_cast<std::size_t>(task)] = evaluate(
            folds[fold], grown[fold], candidates, shapes, shape, counts, weights, false,
            [&](const Key& key) {
              // At the best leaf count; where that is cheap, at its neighbours too.
              const std::size_t reach = counts[best.leaves] * coefficients <= 3 * cheap_unknowns ? 1 : 0;
              return key.leaves + reach >= best.leaves && key.leaves <= best.leaves + reach &&
                     (reach > 0 || key.ridge == best.ridge || key.shrinkage == best.shrinkage) &&
                     !screened_totals.contains(key);
            },
            max_threads);
      }
    }
  });
  screened_totals.merge(totals(refined));
  best_of_width = ranked(screened_totals);
  best_of_width.resize(std::min(best_of_width.size(), finalists));

  // On all folds: of each finalist the best few, and the best of each leaf count near its best.
  std::set<Key> kept;
  for (const auto& [least, best] : best_of_width) {
    const std::size_t reach = counts[best.leaves] * coefficients <= cheap_unknowns ? 2 : 1;
    std::map<std::size_t, std::pair<double, Key>> best_of_count;
    std::vector<std::pair<double, Key>> order;
    for (const auto& [key, error] : screened_totals) {
      if (key.shape != best.shape) {
        continue;
      }
      order.emplace_back(error, key);
      if (key.leaves + reach >= best.leaves && key.leaves <= best.leaves + reach) {
        const auto [entry, is_new] = best_of_count.try_emplace(key.leaves, error, key);
        if (!is_new && error < entry->second.first) {
          entry->second = {error, key};
        }
      }
    }
    std::sort(order.begin(), order.end());
    order.resize(std::min(order.size(), candidates_on_all_folds));
    for (const auto& [error, key] : order) {
      kept.insert(key);
    }
    for (const auto& [count, entry] : best_of_count) {
      kept.insert(entry.second);
    }
  }
  std::vector<Errors> final_errors(num_folds * best_of_width.size());
  parallel_for(std::ssize(final_errors), max_threads, [&](std::ptrdiff_t task) {
    const std::size_t fold = static_cast<std::size_t>(task) / best_of_width.size();
    const Key& best = best_of_width[static_cast<std::size_t>(task) % best_of_width.size()].second;
    Errors& errors = final_errors[static_cast<std::size_t>(task)];
    if (fold < screening) {
      const std::size_t slot = fold * num_shapes + best.shape;
      errors = screened[slot];
      errors.insert(refined[slot].begin(), refined[slot].end());
    } else {
      errors = evaluate(
          folds[fold], grown[fold], candidates, shapes, best.shape, counts, weights, false,
          [&](const Key& key) { return kept.contains(key); }, max_threads);
    }
  });
  for (std::size_t k = 0; k < best_of_width.size(); ++k) {
    std::vector<Errors> of_shape;
    for (std::size_t fold = 0; fold < num_folds; ++fold) {
      of_shape.push_back(final_errors[fold * best_of_width.size() + k]);
    }
    std::optional<CandidateError> best;
    for (const auto& [key, errors] : common(of_shape)) {
      if (!kept.contains(key)) {
        continue;
      }
      const Candidate candidate{.validity = {candidates.kind, shapes[key.shape].width, candidates.smoothness},
                                .jump = shapes[key.shape].jump,
                                .estimation = candidates.estimation,
                                .ridge = ridge_at(candidates, key.ridge),
                                .shrinkage = candidates.shrinkages[key.shrinkage],
                                .leaves = counts[key.leaves]};
      const CandidateError error = described(candidate, errors);
      if (!best || error.rmse < best->rmse) {
        best = error;
      }
    }
    if (best) {
      selection.best_of_kind.push_back(*best);
      if (best->rmse < selection.chosen.rmse || (!candidates.crisp && k == 0)) {
        selection.chosen = *best;
      }
    }
  }
  return prefer_least_squares(std::move(selection), candidates);
}

}  // namespace llmt
