#include "llmt/compare.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <limits>
#include <stdexcept>

#include "data/regressors.hpp"
#include "fit/linear_or_quadratic.hpp"
#include "model/evaluator.hpp"

namespace llmt {
namespace {

constexpr Eigen::Index most_rows = 1000;

double seconds_of(const std::function<void()>& work) {
  const auto start = std::chrono::steady_clock::now();
  work();
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

// Rows of the options that speak of single rows, for a part of them.
FitOptions for_rows(FitOptions options, const std::vector<Eigen::Index>& rows) {
  if (options.weights.size() > 0) {
    options.weights = Eigen::VectorXd(options.weights(rows));
  }
  options.selection.folds.groups = {};
  return options;
}

Eigen::Index count_parameters(const Model& model) {
  Eigen::Index count = 0;
  for (const Partition& partition : model.partitions()) {
    count += partition.num_leaves() - 1;
    for (const Node& node : partition.nodes) {
      count += node.is_leaf() ? node.value.size() + (node.slope.array() != 0.0).count() : 0;
      // A direction, the length of which says nothing, and the half width of the gate.
      count += node.is_oblique() ? (node.direction.array() != 0.0).count() : 0;
    }
  }
  return count;
}

// Mean of the differences of two methods' errors over the folds, and its standard error.
struct Paired {
  double mean;
  double error;
};

Paired paired(const Eigen::VectorXd& a, const Eigen::VectorXd& b) {
  const Eigen::VectorXd difference = a - b;
  const double folds = static_cast<double>(difference.size());
  const double mean = difference.mean();
  const double squares = (difference.array() - mean).square().sum();
  return {mean, folds > 1.0 ? std::sqrt(squares / (folds - 1.0) / folds) : 0.0};
}

bool is_least_squares(const Method& method) { return method.options.growth.max_leaves == 1; }

bool is_readable(const Method& method) {
  return method.options.growth.rule == GrowthRule::rd && method.options.blend.validity == ValidityChoice::crisp &&
         method.options.local_models.terms == LocalTerms::linear;
}

void recommend(const std::vector<Method>& methods, ComparisonResult& result) {
  std::size_t best = 0;
  for (std::size_t m = 1; m < methods.size(); ++m) {
    if (result.methods[m].cv_rmse < result.methods[best].cv_rmse) {
      best = m;
    }
  }
  result.recommended = best;
  const auto ties = [&](std::size_t m) {
    const Paired difference = paired(result.methods[m].fold_rmse, result.methods[best].fold_rmse);
    return difference.mean <= difference.error;
  };
  for (const auto& simple : {is_readable, is_least_squares}) {
    for (std::size_t m = 0; m < methods.size() && !is_least_squares(methods[best]); ++m) {
      if (m != best && simple(methods[m]) && ties(m)) {
        result.recommended = m;
      }
    }
  }
  const Comparison& taken = result.methods[result.recommended];
  if (result.recommended != best) {
    result.recommendation =
        fmt::format("Take {}: its held-out error is within one standard error of the best ({}), and it is simpler.",
                    taken.method, result.methods[best].method);
    return;
  }
  // The best of the others says how much the choice matters.
  std::size_t second = result.methods.size();
  for (std::size_t m = 0; m < methods.size(); ++m) {
    if (m != best && (second == result.methods.size() || result.methods[m].cv_rmse < result.methods[second].cv_rmse)) {
      second = m;
    }
  }
  result.recommendation = fmt::format("Take {}: it has the smallest held-out error", taken.method);
  if (second < result.methods.size()) {
    const double gain = 1.0 - taken.cv_rmse / result.methods[second].cv_rmse;
    result.recommendation += fmt::format(", {:.1f} % below the next ({})", 100.0 * gain, result.methods[second].method);
    if (ties(second)) {
      result.recommendation += ", which differs by less than one standard error over the folds";
    }
  }
  result.recommendation += ".";
}

}  // namespace

std::vector<Method> usual_methods(const FitOptions& base, Eigen::Index inputs) {
  FitOptions plain = base;
  plain.intervals = false;
  plain.progress = {};
  plain.growth.pruning = Pruning::last_splits;
  plain.blend.validity = ValidityChoice::crisp;
  plain.local_models = {};
  std::vector<Method> methods;
  const auto add = [&](const std::string& name, const auto& change) {
    methods.push_back({name, plain});
    change(methods.back().options);
  };
  add("least squares", [](FitOptions& options) {
    options.growth.max_leaves = 1;
    options.selection.folds.count = 0;
  });
  add("crisp tree, RD", [](FitOptions&) {});
  add("crisp tree, RETIS", [](FitOptions& options) { options.growth.rule = GrowthRule::retis; });
  add("crisp tree, RA", [](FitOptions& options) { options.growth.rule = GrowthRule::ra; });
  add("M5', smoothed", [](FitOptions& options) {
    options.growth.rule = GrowthRule::m5;
    options.selection.folds.count = 0;  // its pruning decides
    options.blend.shrinkages = {};
    options.growth.min_improvement = 0.0;
  });
  // Gaussians overlap everywhere: their joint estimates cost the square of the number of leaves.
  const Eigen::Index gaussian_leaves =
      base.growth.max_leaves > 0 ? std::min<Eigen::Index>(base.growth.max_leaves, 50) : 50;
  add("Gaussians, as grown", [=](FitOptions& options) {
    options.blend.validity = ValidityChoice::gaussian;
    options.blend.estimation = Estimation::as_grown;
    options.growth.max_leaves = gaussian_leaves;
  });
  add("Gaussians, re-estimated", [=](FitOptions& options) {
    options.blend.validity = ValidityChoice::gaussian;
    options.blend.widths = {1.0 / 3.0, 2.0 / 3.0};
    options.growth.max_leaves = gaussian_leaves;
  });
  add("blend, joint", [](FitOptions& options) { options.blend.validity = ValidityChoice::blend; });
  add("LOLIMOT", [=](FitOptions& options) {
    options.growth.rule = GrowthRule::lolimot;
    options.blend.estimation = Estimation::as_grown;
    options.growth.max_leaves = gaussian_leaves;
  });
  // So do logistic gates.
  add("HILOMOT", [=](FitOptions& options) {
    options.growth.rule = GrowthRule::hilomot;
    options.blend.validity = ValidityChoice::automatic;
    options.growth.max_leaves = gaussian_leaves;
  });
  if (const Eigen::Index numbers = count_numbers(inputs, base); numbers > 0 && numbers <= most_inputs_of_products) {
    add("crisp tree, quadratic leaves",
        [](FitOptions& options) { options.local_models.terms = LocalTerms::quadratic; });
  }
  if (base.growth.pruning == Pruning::weakest_link) {
    const auto pruned = [](ValidityChoice validity) {
      return [validity](FitOptions& options) {
        options.growth.pruning = Pruning::weakest_link;
        options.blend.validity = validity;
      };
    };
    add("crisp tree, RD, pruned", pruned(ValidityChoice::crisp));
    add("blend, joint, pruned", pruned(ValidityChoice::blend));
  }
  return methods;
}

namespace {

// Moves a row to either side of the plane of a node's split: along the split input, or in an oblique split
// orthogonally to the plane, every input measured by its training range. Inputs without a value stay.
std::pair<Eigen::VectorXd, Eigen::VectorXd> sides_of_plane(const Model& model, const Node& node,
                                                           const Eigen::VectorXd& row) {
  std::pair<Eigen::VectorXd, Eigen::VectorXd> sides{row, row};
  if (!node.is_oblique()) {
    sides.first(node.split_input) = node.threshold;
    sides.second(node.split_input) = std::nextafter(node.threshold, std::numeric_limits<double>::infinity());
    return sides;
  }
  Eigen::VectorXd way = Eigen::VectorXd::Zero(row.size());  // by which s grows by 1
  double side = 0.0;
  double scale = 0.0;
  for (Eigen::Index j = 0; j < row.size(); ++j) {
    const InputColumn& input = model.inputs()[j];
    if (node.direction(j) != 0.0 && !std::isnan(row(j))) {
      const double range = input.high - input.low;
      side += node.direction(j) * (row(j) - input.centre);
      scale += std::abs(node.direction(j)) * (range + std::abs(row(j)) + std::abs(input.centre));
      way(j) = node.direction(j) * range * range;
    }
  }
  const double square = node.direction.dot(way);
  if (square > 0.0) {
    // Far enough from the plane for rounding, too near for the local models to differ by it.
    const double step = 1e-12 * scale;
    sides.first += (node.threshold - step - side) / square * way;
    sides.second += (node.threshold + step - side) / square * way;
  }
  return sides;
}

}  // namespace

double largest_jump(const Model& model, const Eigen::Ref<const Eigen::MatrixXd>& inputs) {
  const Eigen::Index step = std::max<Eigen::Index>(1, (inputs.rows() + most_rows - 1) / most_rows);
  double largest = 0.0;
  for (const Partition& partition : model.partitions()) {
    const Evaluator evaluator(partition, model.inputs(), std::ssize(model.regressors()));
    // Rows just left and right of each split that may jump. Splits with a transition do not; Gaussians never do.
    std::vector<Eigen::VectorXd> left;
    std::vector<Eigen::VectorXd> right;
    for (Eigen::Index row = 0; row < inputs.rows() && partition.validity.kind != ValidityKind::gaussian; row += step) {
      const Eigen::VectorXd x = inputs.row(row).transpose();
      for (Eigen::Index index = 0; index >= 0;) {
        const Node& node = partition.nodes[index];
        if (node.is_leaf()) break;
        if (node.level_side.empty() && node.half_width == 0.0) {
          auto [first, second] = sides_of_plane(model, node, x);
          left.push_back(std::move(first));
          right.push_back(std::move(second));
        }
        if (!node.level_side.empty() || (!node.is_oblique() && std::isnan(x(node.split_input)))) {
          break;  // what lies below a set of levels has no plane of its own here
        }
        index = evaluator.child_of(static_cast<int>(index), x.data());
      }
    }
    if (left.empty()) continue;
    Eigen::MatrixXd at_left(std::ssize(left), model.num_inputs());
    Eigen::MatrixXd at_right(std::ssize(left), model.num_inputs());
    for (std::size_t k = 0; k < left.size(); ++k) {
      at_left.row(k) = left[k].transpose();
      at_right.row(k) = right[k].transpose();
    }
    const int output = partition.outputs.front();
    largest = std::max(
        largest, (model.predict(at_left).col(output) - model.predict(at_right).col(output)).cwiseAbs().maxCoeff());
  }
  return largest;
}

ComparisonResult compare(const Eigen::Ref<const Eigen::MatrixXd>& inputs,
                         const Eigen::Ref<const Eigen::MatrixXd>& output, const std::vector<Method>& methods,
                         const CompareOptions& options) {
  if (methods.empty()) throw std::invalid_argument("llmt::compare: there is no method");
  if (output.cols() != 1 || output.rows() != inputs.rows()) {
    throw std::invalid_argument(fmt::format("llmt::compare: output is {} x {}, one column and {} rows are needed",
                                            output.rows(), output.cols(), inputs.rows()));
  }
  FoldOptions fold_options = options.folds;
  fold_options.count = static_cast<int>(std::min<Eigen::Index>(fold_options.count, inputs.rows()));
  const std::vector<Fold> folds = make_folds(inputs.rows(), fold_options);
  const Eigen::Index total = std::ssize(methods) * (std::ssize(folds) + 1);
  Eigen::Index done = 0;
  const auto report = [&](const Method& method) {
    ++done;
    if (options.progress) {
      options.progress(method.name, done, total);
    }
  };

  ComparisonResult result;
  for (const Method& method : methods) {
    Comparison entry{.method = method.name, .fold_rmse = Eigen::VectorXd(std::ssize(folds))};
    double squares = 0.0;
    double weight = 0.0;
    for (std::size_t f = 0; f < folds.size(); ++f) {
      const Fold& fold = folds[f];
      const FitResult fitted =
          fit(inputs(fold.train, Eigen::all), output(fold.train, Eigen::all), for_rows(method.options, fold.train));
      const Eigen::VectorXd error =
          fitted.model.predict(inputs(fold.held_out, Eigen::all)) - Eigen::MatrixXd(output(fold.held_out, Eigen::all));
      Eigen::VectorXd weights = Eigen::VectorXd::Ones(error.size());
      if (method.options.weights.size() > 0) {
        weights = method.options.weights(fold.held_out);
      }
      const double of_fold = weights.dot(error.cwiseAbs2());
      squares += of_fold;
      weight += weights.sum();
      entry.fold_rmse(f) = weights.sum() > 0.0 ? std::sqrt(of_fold / weights.sum()) : 0.0;
      report(method);
    }
    entry.cv_rmse = std::sqrt(squares / weight);
    const double mean = entry.fold_rmse.mean();
    entry.spread = entry.fold_rmse.size() > 1 ? std::sqrt((entry.fold_rmse.array() - mean).square().sum() /
                                                          static_cast<double>(entry.fold_rmse.size() - 1))
                                              : 0.0;
    std::vector<FitResult> all;
    entry.fit_seconds = seconds_of([&] { all.push_back(fit(inputs, output, method.options)); });
    const Model& model = all.front().model;
    entry.predict_seconds = seconds_of([&] { model.predict(inputs, method.options.max_threads); }) * 1e6 /
                            static_cast<double>(inputs.rows());
    entry.leaves = model.partitions().front().num_leaves();
    entry.parameters = count_parameters(model);
    entry.largest_jump = largest_jump(model, inputs);
    result.methods.push_back(std::move(entry));
    report(method);
  }
  recommend(methods, result);
  return result;
}

}  // namespace llmt
