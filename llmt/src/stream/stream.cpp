#include "llmt/stream.hpp"
#include "base/matrix.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numeric>
#include <stdexcept>

#include "base/checks.hpp"
#include "fit/validate.hpp"
#include "stream/reservoir.hpp"
#include "stream/snapshot.hpp"
#include "stream/tree.hpp"

namespace llmt {
namespace {

// Rows from which the units are taken; and that recent errors are over.
constexpr Eigen::Index unit_rows = 50;
constexpr double recent_rows = 1000.0;

// Sums of all leaves' bins.
constexpr double default_bytes = 64.0 * 1024.0 * 1024.0;

[[noreturn]] void reject(const std::string& what) { throw std::invalid_argument("llmt::Stream: " + what); }

StreamOptions checked(Eigen::Index inputs, Eigen::Index outputs, StreamOptions options) {
  if (inputs < 1 || outputs < 1) {
    reject(fmt::format("it has {} inputs and {} outputs, both must be at least 1", inputs, outputs));
  }
  const auto need = [](bool holds, const char* field, double value, const char* bound) {
    if (!holds) {
      reject(fmt::format("StreamOptions::{} is {}, it must be {}", field, value, bound));
    }
  };
  need(options.significance > 0.0, "significance", options.significance, "positive");
  need(options.min_variance_gain >= 0.0 && std::isfinite(options.min_variance_gain), "min_variance_gain",
       options.min_variance_gain, "finite and not negative");
  need(options.min_leaf_samples >= 0, "min_leaf_samples", static_cast<double>(options.min_leaf_samples),
       "not negative");
  need(options.max_leaves >= 0, "max_leaves", static_cast<double>(options.max_leaves), "not negative");
  need(options.bins >= 4 && options.bins <= 256, "bins", options.bins, "within 4 ... 256");
  need(options.shrinkage >= 0.0 && std::isfinite(options.shrinkage), "shrinkage", options.shrinkage,
       "finite and not negative");
  need(options.reservoir_rows >= 0, "reservoir_rows", static_cast<double>(options.reservoir_rows), "not negative");
  if (options.min_leaf_samples == 0) {
    options.min_leaf_samples = 2 * (inputs + 1);
  }
  if (options.max_leaves == 0) {
    const double bytes_per_leaf =
        static_cast<double>(inputs * options.bins * GramShape(inputs + 1, 1).size()) * sizeof(double);
    options.max_leaves = std::clamp<Eigen::Index>(static_cast<Eigen::Index>(default_bytes / bytes_per_leaf), 16, 500);
  }
  return options;
}

}  // namespace

class StreamState {
 public:
  StreamState(Eigen::Index inputs, Eigen::Index outputs, const StreamOptions& options)
      : inputs_(inputs),
        outputs_(outputs),
        options_(checked(inputs, outputs, options)),
        reservoir_(options.reservoir_rows, inputs + outputs + 1),
        columns_(inputs + outputs),
        known_(Eigen::VectorXd::Zero(inputs + outputs)),
        squares_(Eigen::VectorXd::Zero(outputs)),
        recent_(Eigen::VectorXd::Constant(outputs, std::nan(""))) {}

  void add(const Eigen::Ref<const Eigen::MatrixXd>& inputs, const Eigen::Ref<const Eigen::MatrixXd>& outputs,
           const Eigen::Ref<const Eigen::VectorXd>& weights) {
    check(inputs, outputs, weights);
    std::vector<double> row(inputs_ + outputs_ + 1);
    for (Eigen::Index i = 0; i < inputs.rows(); ++i) {
      for (Eigen::Index j = 0; j < inputs_; ++j) {
        row[j] = inputs(i, j);
      }
      for (Eigen::Index o = 0; o < outputs_; ++o) {
        row[inputs_ + o] = outputs(i, o);
      }
      row.back() = weights.size() > 0 ? weights(i) : 1.0;
      ++offered_;
      if (row.back() > 0.0) {
        add_row(row);
      }
    }
  }

  Eigen::MatrixXd predict(const Eigen::Ref<const Eigen::MatrixXd>& inputs) const {
    if (inputs.cols() != inputs_) {
      reject(fmt::format("predict(): inputs has {} columns, the stream has {}", inputs.cols(), inputs_));
    }
    check_finite_or_missing("llmt::Stream::predict", "inputs", inputs);
    Eigen::MatrixXd result(inputs.rows(), outputs_);
    Eigen::VectorXd x(inputs_);
    Eigen::VectorXd z(inputs_);
    for (Eigen::Index i = 0; i < inputs.rows(); ++i) {
      x = inputs.row(i).transpose();
      for (Eigen::Index o = 0; o < outputs_; ++o) {
        if (trees_.empty()) {
          result(i, o) = rows_ > 0 ? columns_[inputs_ + o].mean : std::nan("");
          continue;
        }
        const StreamTree& tree = *trees_[o];
        scale(tree.setting(), x.data(), z);
        result(i, o) = tree.predict({x.data(), z.data(), 0.0, 1.0, 1.0});
      }
    }
    return result;
  }

  Eigen::VectorXd prequential_rmse() const {
    return tested_ > 0 ? (squares_ / static_cast<double>(tested_)).cwiseSqrt().eval()
                       : Eigen::VectorXd::Constant(outputs_, std::nan("")).eval();
  }
  Eigen::VectorXd recent_rmse() const { return recent_.cwiseSqrt(); }

  StreamCounts counts() const {
    StreamCounts counts{.rows = rows_, .missing_values = missing_};
    for (const auto& [hash, row] : reservoir_.rows()) {
      counts.held_out += row.held_out ? 1 : 0;
    }
    for (const std::unique_ptr<StreamTree>& tree : trees_) {
      const StreamTree::Counts& of_tree = tree->counts();
      counts.leaves += of_tree.leaves;
      counts.splits += of_tree.splits;
      counts.prunes += of_tree.prunes;
      counts.drifts += of_tree.drifts;
      counts.replacements += of_tree.replacements;
      counts.bytes += tree->bytes();
    }
    counts.bytes += reservoir_.bytes() + static_cast<Eigen::Index>(first_rows_.capacity() * sizeof(double));
    return counts;
  }

  Model snapshot(ValidityChoice validity) const;

 private:
  void check(const Eigen::Ref<const Eigen::MatrixXd>& inputs, const Eigen::Ref<const Eigen::MatrixXd>& outputs,
             const Eigen::Ref<const Eigen::VectorXd>& weights) const {
    if (inputs.cols() != inputs_ || outputs.cols() != outputs_ || inputs.rows() != outputs.rows() ||
        (weights.size() > 0 && weights.size() != inputs.rows())) {
      reject(
          fmt::format("add(): inputs is {} x {}, outputs is {} x {} and there are {} weights; the stream has {} "
                      "inputs and {} outputs",
                      inputs.rows(), inputs.cols(), outputs.rows(), outputs.cols(), weights.size(), inputs_, outputs_));
    }
    for (Eigen::Index i = 0; i < inputs.rows(); ++i) {
      const auto refuse = [&](const char* what, Eigen::Index column, double value, const char* bound) {
        reject(fmt::format("add(): {}({}, {}) is {}, it must be {} (row {} of the stream; counted from 0)", what, i,
                           column, value, bound, offered_ + i));
      };
      for (Eigen::Index j = 0; j < inputs_; ++j) {
        if (std::abs(inputs(i, j)) > largest_magnitude) {
          refuse("inputs", j, inputs(i, j), "at most 1e150 in magnitude, or NaN where it is missing");
        }
      }
      for (Eigen::Index o = 0; o < outputs_; ++o) {
        if (!(std::abs(outputs(i, o)) <= largest_magnitude)) {
          refuse("outputs", o, outputs(i, o), "finite and at most 1e150 in magnitude");
        }
      }
      if (weights.size() > 0 && !(weights(i) >= 0.0 && std::isfinite(weights(i)))) {
        refuse("weights", 0, weights(i), "finite and not negative");
      }
    }
  }

  static void scale(const StreamSetting& setting, const double* x, Eigen::VectorXd& z) {
    for (Eigen::Index j = 0; j < setting.inputs; ++j) {
      z(j) = setting.scaled(j, x[j]);
    }
  }

  void add_row(const std::vector<double>& row) {
    ++rows_;
    for (Eigen::Index k = 0; k < inputs_ + outputs_; ++k) {
      const double value = row[k];
      if (std::isnan(value)) {
        ++missing_;
        continue;
      }
      ColumnRange& column = columns_[k];
      known_(k) += 1.0;
      column.low = known_(k) == 1.0 ? value : std::min(column.low, value);
      column.high = known_(k) == 1.0 ? value : std::max(column.high, value);
      column.mean += (value - column.mean) / known_(k);
    }
    if (!trees_.empty()) {
      if (!reservoir_.add(row.data())) {
        learn(row.data());
      }
      return;
    }
    first_rows_.insert(first_rows_.end(), row.begin(), row.end());
    if (rows_ == std::max(unit_rows, 2 * (inputs_ + 1))) {
      start();
    }
  }

  void learn(const double* row) {
    Eigen::VectorXd z(inputs_);
    scale(trees_.front()->setting(), row, z);
    ++tested_;
    for (Eigen::Index o = 0; o < outputs_; ++o) {
      const double error =
          trees_[o]->learn({row, z.data(), row[inputs_ + o], row[inputs_ + outputs_], reservoir_.share_of_different()});
      squares_(o) += error * error;
      const double rate = 1.0 / std::min(static_cast<double>(tested_), recent_rows);
      recent_(o) = tested_ == 1 ? error * error : recent_(o) + rate * (error * error - recent_(o));
    }
  }

  // Units and first models from the first rows, which are then learned.
  void start() {
    const Eigen::Index width = inputs_ + outputs_ + 1;
    const Eigen::Index count = std::ssize(first_rows_) / width;
    const Eigen::Map<const RowMajor> first(first_rows_.data(), count, width);
    Eigen::VectorXd centre = Eigen::VectorXd::Zero(inputs_);
    Eigen::VectorXd scale_of_input = Eigen::VectorXd::Ones(inputs_);
    for (Eigen::Index j = 0; j < inputs_; ++j) {
      centre(j) = columns_[j].mean;
      double squares = 0.0;
      for (Eigen::Index i = 0; i < count; ++i) {
        squares += std::isnan(first(i, j)) ? 0.0 : (first(i, j) - centre(j)) * (first(i, j) - centre(j));
      }
      if (squares > 0.0) {
        scale_of_input(j) = std::sqrt(squares / std::max(1.0, known_(j)));
      }
    }
    for (Eigen::Index o = 0; o < outputs_; ++o) {
      const double mean = columns_[inputs_ + o].mean;
      const auto column = first.col(inputs_ + o).array();
      const double variance = (column - mean).square().mean();
      StreamSetting setting{.options = options_,
                            .inputs = inputs_,
                            .shape = GramShape(inputs_ + 1, 1),
                            .output_variance = variance,
                            .rounding = 1e-10 * std::sqrt(variance) + 1e-13 * column.abs().maxCoeff(),
                            .centre = centre,
                            .scale = scale_of_input};
      // Twice, for the digits that large values cost.
      Basis basis{Eigen::VectorXd::Zero(inputs_), Eigen::VectorXd::Zero(inputs_ + 1)};
      basis.base(0) = mean;
      Eigen::VectorXd z(inputs_);
      for (int pass = 0; pass < 2; ++pass) {
        RowProducts products(setting.shape);
        Sums sums{std::vector<double>(setting.shape.size(), 0.0), 0};
        for (Eigen::Index i = 0; i < count; ++i) {
          scale(setting, first_rows_.data() + i * width, z);
          products.set(basis, z.data(), first(i, inputs_ + o), first(i, inputs_ + outputs_));
          products.add_to(sums);
        }
        int rank = 0;
        basis.base += solve(setting.shape, sums.gram.data(), options_.shrinkage, rank);
      }
      trees_.push_back(std::make_unique<StreamTree>(setting, basis.base));
      trees_.back()->on_drift = [this](const std::function<bool(const double*)>& concerned) {
        reservoir_.remove_if(concerned);
      };
    }
    const std::vector<double> rows = std::move(first_rows_);
    first_rows_ = {};
    for (Eigen::Index i = 0; i < count; ++i) {
      learn(rows.data() + i * width);
    }
    tested_ = 0;  // these rows have made the first model
    squares_.setZero();
    recent_.setConstant(std::nan(""));
  }

  Eigen::Index inputs_;
  Eigen::Index outputs_;
  StreamOptions options_;
  Reservoir reservoir_;
  std::vector<double> first_rows_;
  std::vector<ColumnRange> columns_;
  Eigen::VectorXd known_;  // number of values of each column
  Eigen::VectorXd squares_;
  Eigen::VectorXd recent_;
  Eigen::Index offered_ = 0;
  Eigen::Index rows_ = 0;
  Eigen::Index tested_ = 0;
  Eigen::Index missing_ = 0;
  std::vector<std::unique_ptr<StreamTree>> trees_;
};

Model StreamState::snapshot(ValidityChoice validity) const {
  if (rows_ == 0) {
    reject("snapshot(): there is no row yet");
  }
  if (validity == ValidityChoice::gaussian) {
    reject("snapshot(): ValidityChoice::gaussian is not for streams");
  }
  if (trees_.empty()) {
    const Eigen::Index width = inputs_ + outputs_ + 1;
    const Eigen::Map<const RowMajor> first(first_rows_.data(), std::ssize(first_rows_) / width, width);
    FitOptions one_leaf;
    one_leaf.growth.max_leaves = 1;
    one_leaf.selection.folds.count = 0;
    one_leaf.weights = first.rightCols(1);
    return fit(first.leftCols(inputs_), first.middleCols(inputs_, outputs_), one_leaf).model;
  }
  std::vector<InputColumn> inputs;
  std::vector<OutputColumn> outputs;
  std::vector<Regressor> regressors;
  for (Eigen::Index j = 0; j < inputs_; ++j) {
    const ColumnRange& column = columns_[j];
    inputs.push_back(
        {.name = fmt::format("x{}", j + 1), .low = column.low, .high = column.high, .centre = column.mean});
    regressors.push_back({static_cast<int>(j), -1, column.mean});
  }
  for (Eigen::Index o = 0; o < outputs_; ++o) {
    const ColumnRange& column = columns_[inputs_ + o];
    outputs.push_back({outputs_ == 1 ? "y" : fmt::format("y{}", o + 1), column.low, column.high});
  }
  std::vector<Partition> partitions;
  for (Eigen::Index o = 0; o < outputs_; ++o) {
    partitions.push_back(
        crisp_partition(*trees_[o], {columns_.begin(), columns_.begin() + inputs_}, static_cast<int>(o)));
  }
  if (std::ssize(reservoir_.rows()) > 0) {
    const Eigen::Index count = std::ssize(reservoir_.rows());
    Eigen::MatrixXd values(count, inputs_ + outputs_ + 1);
    std::vector<int> others;
    std::vector<int> held_out;
    Eigen::Index at = 0;
    for (const auto& [hash, row] : reservoir_.rows()) {
      (row.held_out ? held_out : others).push_back(static_cast<int>(at));
      values.row(at++) = Eigen::Map<const Eigen::RowVectorXd>(row.values.data(), values.cols());
    }
    std::vector<int> all_inputs(inputs_);
    std::iota(all_inputs.begin(), all_inputs.end(), 0);
    const Table table{values.leftCols(inputs_),
                      values.middleCols(inputs_, outputs_),
                      values.rightCols(1),
                      std::vector<int>(inputs_, 0),
                      all_inputs,
                      all_inputs};
    if (!others.empty()) {
      TrainingRows training = training_rows(table, std::move(others));
      training.columns = inputs;
      training.regressors = regressors;
      const TrainingRows queries = query_rows(table, std::move(held_out), training);
      for (Partition& partition : partitions) {
        partition = choose(training, queries, std::move(partition), validity);
      }
    }
  }
  for (Partition& partition : partitions) {
    for (Node& node : partition.nodes) {
      if (!node.is_leaf()) {
        node.inverse_gram.resize(0, 0);
      }
    }
  }
  return Model(std::move(inputs), std::move(outputs), std::move(regressors), std::move(partitions));
}

Stream::Stream(Eigen::Index num_inputs, Eigen::Index num_outputs, const StreamOptions& options)
    : state_(std::make_unique<StreamState>(num_inputs, num_outputs, options)) {}
Stream::~Stream() = default;
Stream::Stream(Stream&&) noexcept = default;
Stream& Stream::operator=(Stream&&) noexcept = default;

void Stream::add(const Eigen::Ref<const Eigen::MatrixXd>& inputs, const Eigen::Ref<const Eigen::MatrixXd>& outputs,
                 const Eigen::Ref<const Eigen::VectorXd>& weights) {
  state_->add(inputs, outputs, weights);
}
Eigen::MatrixXd Stream::predict(const Eigen::Ref<const Eigen::MatrixXd>& inputs) const {
  return state_->predict(inputs);
}
Eigen::VectorXd Stream::prequential_rmse() const { return state_->prequential_rmse(); }
Eigen::VectorXd Stream::recent_rmse() const { return state_->recent_rmse(); }
StreamCounts Stream::counts() const { return state_->counts(); }
Model Stream::snapshot(ValidityChoice validity) const { return state_->snapshot(validity); }

}  // namespace llmt
