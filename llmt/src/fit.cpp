#include "llmt/fit.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <mutex>
#include <numeric>
#include <stdexcept>

#include "checks.hpp"
#include "growth.hpp"
#include "parallel.hpp"
#include "selection.hpp"

namespace llmt {
namespace {

constexpr double largest_magnitude = 1e150;  // squares stay finite

void require(bool condition, const char* option, double value, const char* bound) {
  if (!condition) {
    throw std::invalid_argument(fmt::format("llmt::fit: {} is {}, it must be {}", option, value, bound));
  }
}

void check_data(const char* name, const Eigen::Ref<const Eigen::MatrixXd>& data) {
  if (data.rows() < 1 || data.cols() < 1) {
    throw std::invalid_argument(fmt::format("llmt::fit: {} is {} x {}, at least one row and one column are needed",
                                            name, data.rows(), data.cols()));
  }
  check_finite("llmt::fit", name, data);
  require(data.cwiseAbs().maxCoeff() <= largest_magnitude, fmt::format("a magnitude in {}", name).c_str(),
          data.cwiseAbs().maxCoeff(), "at most 1e150");
}

std::vector<int> all_columns(std::ptrdiff_t count) {
  std::vector<int> columns(static_cast<std::size_t>(count));
  std::iota(columns.begin(), columns.end(), 0);
  return columns;
}

/// Options without blanks, or a complaint.
GrowthOptions resolve(GrowthOptions options, std::ptrdiff_t inputs) {
  require(options.significance >= 0.0, "growth.significance", options.significance, "at least 0");
  require(std::isfinite(options.min_variance_gain), "growth.min_variance_gain", options.min_variance_gain, "finite");
  require(options.pruning_m >= 0.0, "growth.pruning_m", options.pruning_m, "at least 0");
  require(options.min_leaf_samples >= 0, "growth.min_leaf_samples", static_cast<double>(options.min_leaf_samples),
          "at least 0");
  require(options.max_leaves >= 0, "growth.max_leaves", static_cast<double>(options.max_leaves), "at least 0");
  require(options.min_improvement >= 0.0 && options.min_improvement < 1.0, "growth.min_improvement",
          options.min_improvement, "in [0, 1)");
  for (std::vector<int>* columns : {&options.split_inputs, &options.regression_inputs}) {
    check_columns("llmt::fit", columns == &options.split_inputs ? "growth.split_inputs" : "growth.regression_inputs",
                  *columns, inputs);
    if (columns->empty()) {
      *columns = all_columns(inputs);
    }
    std::sort(columns->begin(), columns->end());
  }
  if (options.min_leaf_samples == 0) {
    options.min_leaf_samples = 2 * (std::ssize(options.regression_inputs) + 1);
  }
  return options;
}

/// A tree grown from some rows, about its own centre.
struct Grown {
  Partition partition;
  Eigen::RowVectorXd centre;  // of the inputs
  StopReason stop = StopReason::leaf_samples;
};

Grown grow_rows(const Eigen::MatrixXd& inputs, const Eigen::MatrixXd& outputs, const std::vector<int>& served,
                const GrowthOptions& options, int max_threads) {
  Grown grown;
  grown.centre = inputs.colwise().mean();
  GrowthProblem problem;
  problem.split_values = inputs(Eigen::all, options.split_inputs);
  problem.deviations = inputs(Eigen::all, options.regression_inputs).rowwise() -
                       Eigen::RowVectorXd(grown.centre(options.regression_inputs));
  problem.outputs = outputs(Eigen::all, served);
  problem.options = options;
  problem.max_threads = max_threads;
  GrownPartition result = grow(problem);
  grown.partition = {.outputs = served, .nodes = std::move(result.nodes)};
  grown.stop = result.stop;
  return grown;
}

/// Weights of the outputs' squared errors: 1 for a single one; else 1 / variance, so that outputs of any scale count
/// alike.
Eigen::VectorXd error_weights(const Eigen::MatrixXd& outputs) {
  if (outputs.cols() == 1) {
    return Eigen::VectorXd::Ones(1);
  }
  const Eigen::MatrixXd centred = outputs.rowwise() - outputs.colwise().mean();
  const Eigen::VectorXd variance = centred.colwise().squaredNorm().transpose() / static_cast<double>(outputs.rows());
  return variance.unaryExpr([](double value) { return value > 0.0 ? 1.0 / value : 1.0; });
}

/// Held-out squared errors of the prefixes of the tree grown without the rows of `fold`.
Eigen::VectorXd held_out_errors(const Eigen::MatrixXd& inputs, const Eigen::MatrixXd& outputs,
                                const std::vector<int>& served, const GrowthOptions& options, const Fold& fold,
                                int max_threads) {
  const Grown grown =
      grow_rows(inputs(fold.train, Eigen::all), outputs(fold.train, Eigen::all), served, options, max_threads);
  const Eigen::MatrixXd held_out = inputs(fold.held_out, Eigen::all);
  const Eigen::MatrixXd deviations = held_out(Eigen::all, options.regression_inputs).rowwise() -
                                     Eigen::RowVectorXd(grown.centre(options.regression_inputs));
  return prefix_squared_errors(grown.partition, held_out, deviations, outputs(fold.held_out, served),
                               error_weights(outputs(Eigen::all, served)));
}

/// Sums the folds' errors for 1, 2, ... leaves; a fold whose tree is smaller stays at its last one.
Eigen::VectorXd combine_folds(const std::vector<Eigen::VectorXd>& folds) {
  std::ptrdiff_t longest = 0;
  for (const Eigen::VectorXd& errors : folds) {
    longest = std::max(longest, errors.size());
  }
  Eigen::VectorXd total = Eigen::VectorXd::Zero(longest);
  for (const Eigen::VectorXd& errors : folds) {
    total.head(errors.size()) += errors;
    total.tail(longest - errors.size()).array() += errors(errors.size() - 1);
  }
  return total;
}

std::vector<Fold> selection_folds(std::ptrdiff_t rows, FoldOptions options) {
  if (options.count == 0) {
    return {};
  }
  require(options.count >= 2, "folds.count", options.count, "0 or at least 2");
  std::vector<double> distinct(options.groups.begin(), options.groups.end());
  std::sort(distinct.begin(), distinct.end());
  distinct.erase(std::unique(distinct.begin(), distinct.end()), distinct.end());
  const std::ptrdiff_t groups = options.groups.empty() ? rows : std::ssize(distinct);
  options.count = static_cast<int>(std::min<std::ptrdiff_t>(options.count, groups));
  return options.count < 2 ? std::vector<Fold>{} : make_folds(rows, options);
}

std::vector<InputColumn> describe_inputs(const Eigen::MatrixXd& inputs, const Eigen::RowVectorXd& centre) {
  std::vector<InputColumn> columns;
  for (std::ptrdiff_t j = 0; j < inputs.cols(); ++j) {
    columns.push_back({.name = fmt::format("x{}", j + 1),
                       .low = inputs.col(j).minCoeff(),
                       .high = inputs.col(j).maxCoeff(),
                       .centre = centre(j)});
  }
  return columns;
}

std::vector<OutputColumn> describe_outputs(const Eigen::MatrixXd& outputs) {
  std::vector<OutputColumn> columns;
  for (std::ptrdiff_t o = 0; o < outputs.cols(); ++o) {
    columns.push_back({.name = outputs.cols() == 1 ? "y" : fmt::format("y{}", o + 1),
                       .low = outputs.col(o).minCoeff(),
                       .high = outputs.col(o).maxCoeff()});
  }
  return columns;
}

PartitionSummary summarise(const Partition& partition, std::ptrdiff_t regressors) {
  PartitionSummary summary;
  summary.outputs = partition.outputs;
  summary.leaves = partition.num_leaves();
  Eigen::VectorXd rss = Eigen::VectorXd::Zero(std::ssize(partition.outputs));
  for (const Node& node : partition.nodes) {
    if (node.is_leaf()) {
      rss += node.rss;
      summary.rank_deficient_leaves += node.rank < regressors + 1 ? 1 : 0;
    }
  }
  summary.train_rmse = (rss / static_cast<double>(partition.nodes.front().samples)).cwiseSqrt();
  return summary;
}

}  // namespace

FitResult fit(const Eigen::Ref<const Eigen::MatrixXd>& inputs, const Eigen::Ref<const Eigen::MatrixXd>& outputs,
              const FitOptions& options) {
  check_data("inputs", inputs);
  check_data("outputs", outputs);
  if (inputs.rows() != outputs.rows()) {
    throw std::invalid_argument(
        fmt::format("llmt::fit: inputs has {} rows, outputs has {}", inputs.rows(), outputs.rows()));
  }
  require(inputs.rows() <= std::numeric_limits<int>::max(), "the number of rows", static_cast<double>(inputs.rows()),
          "below 2^31");
  require(options.max_threads >= 0, "max_threads", options.max_threads, "at least 0");
  const GrowthOptions growth = resolve(options.growth, inputs.cols());
  const std::vector<Fold> folds = selection_folds(inputs.rows(), options.folds);

  std::vector<std::vector<int>> served;
  for (int o = 0; o < outputs.cols(); ++o) {
    if (growth.shared_partition && o > 0) {
      served.front().push_back(o);
    } else {
      served.push_back({o});
    }
  }

  // Every growth is a task of its own: the final tree of each partition, then those of its folds.
  const Eigen::MatrixXd x = inputs;
  const Eigen::MatrixXd y = outputs;
  const std::size_t tasks_each = folds.size() + 1;
  std::vector<Grown> grown(served.size());
  std::vector<std::vector<Eigen::VectorXd>> errors(served.size(), std::vector<Eigen::VectorXd>(folds.size()));
  const std::ptrdiff_t tasks = static_cast<std::ptrdiff_t>(served.size() * tasks_each);
  std::mutex progress_mutex;
  std::ptrdiff_t done = 0;
  parallel_for(tasks, options.max_threads, [&](std::ptrdiff_t task) {
    const std::size_t partition = static_cast<std::size_t>(task) / tasks_each;
    const std::size_t step = static_cast<std::size_t>(task) % tasks_each;
    if (step == 0) {
      grown[partition] = grow_rows(x, y, served[partition], growth, options.max_threads);
    } else {
      errors[partition][step - 1] =
          held_out_errors(x, y, served[partition], growth, folds[step - 1], options.max_threads);
    }
    if (options.progress) {
      const std::lock_guard<std::mutex> lock(progress_mutex);
      options.progress(++done, tasks);
    }
  });

  FitSummary summary{.samples = inputs.rows(), .min_leaf_samples = growth.min_leaf_samples, .partitions = {}};
  std::vector<Partition> partitions;
  for (std::size_t i = 0; i < served.size(); ++i) {
    const std::ptrdiff_t grown_leaves = grown[i].partition.num_leaves();
    StopReason stop = grown[i].stop;
    Eigen::VectorXd cv_rmse;
    if (!folds.empty()) {
      const Eigen::VectorXd held_out = combine_folds(errors[i]);
      cv_rmse = (held_out / static_cast<double>(inputs.rows() * std::ssize(served[i]))).cwiseSqrt();
      std::ptrdiff_t best = 0;
      held_out.minCoeff(&best);
      if (best + 1 < grown_leaves) {
        grown[i].partition = prefix(grown[i].partition, best + 1);
        stop = StopReason::cross_validation;
      }
    }
    PartitionSummary described = summarise(grown[i].partition, std::ssize(growth.regression_inputs));
    described.grown_leaves = grown_leaves;
    described.stop = stop;
    described.cv_rmse = std::move(cv_rmse);
    described.cv_folds = std::ssize(folds);
    summary.partitions.push_back(std::move(described));
    partitions.push_back(std::move(grown[i].partition));
  }
  return {Model(describe_inputs(x, grown.front().centre), describe_outputs(y), growth.regression_inputs,
                std::move(partitions)),
          std::move(summary)};
}

Eigen::VectorXd rmse(const Eigen::Ref<const Eigen::MatrixXd>& predicted,
                     const Eigen::Ref<const Eigen::MatrixXd>& measured) {
  if (predicted.rows() != measured.rows() || predicted.cols() != measured.cols() || predicted.rows() == 0) {
    throw std::invalid_argument(
        fmt::format("llmt::rmse: predicted is {} x {}, measured is {} x {}; the shapes must agree and have rows",
                    predicted.rows(), predicted.cols(), measured.rows(), measured.cols()));
  }
  return ((predicted - measured).colwise().squaredNorm() / static_cast<double>(predicted.rows()))
      .cwiseSqrt()
      .transpose();
}

std::string describe(StopReason reason) {
  switch (reason) {
    case StopReason::max_leaves:
      return "the leaf limit";
    case StopReason::significance:
      return "the significance test";
    case StopReason::variance_gain:
      return "the variance gain";
    case StopReason::leaf_samples:
      return "the smallest leaf size";
    case StopReason::exact_fit:
      return "an exact fit";
    case StopReason::improvement:
      return "too little improvement";
    case StopReason::pruning:
      return "pruning";
    case StopReason::cross_validation:
      return "cross-validation";
  }
  return "";
}

}  // namespace llmt
