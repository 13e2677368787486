#include "stream/state.hpp"

#include <algorithm>
#include <cmath>

#include "stream/sums.hpp"

namespace llmt {
namespace {

// The units of inputs and outputs, and the first models, are taken from the first 50 rows, or from two for each
// coefficient if that is more.
constexpr Eigen::Index unit_rows = 50;
constexpr Eigen::Index unit_rows_per_coefficient = 2;

// Number of rows over which the recent errors are averaged.
constexpr double recent_rows = 1000.0;

// Residuals below these parts of the standard deviation and of the largest magnitude of an output are rounding.
constexpr double rounding_of_deviation = 1e-10;
constexpr double rounding_of_magnitude = 1e-13;

}  // namespace

StreamState::StreamState(Eigen::Index inputs, Eigen::Index outputs, const StreamOptions& options)
    : inputs_(inputs),
      outputs_(outputs),
      options_(options),
      reservoir_(options.reservoir_rows, width()),
      columns_(inputs + outputs),
      known_(Eigen::VectorXd::Zero(inputs + outputs)),
      squares_(Eigen::VectorXd::Zero(outputs)),
      recent_(Eigen::VectorXd::Constant(outputs, std::nan(""))) {}

void StreamState::add(const std::vector<double>& row) {
  ++offered_;
  if (!(row.back() > 0.0)) return;
  ++rows_;
  describe_columns(row);
  if (!trees_.empty()) {
    if (!reservoir_.add(row.data())) learn(row.data());
    return;
  }
  first_rows_.insert(first_rows_.end(), row.begin(), row.end());
  if (rows_ == rows_before_trees()) start();
}

Eigen::Index StreamState::rows_before_trees() const {
  return std::max(unit_rows, unit_rows_per_coefficient * (inputs_ + 1));
}

void StreamState::describe_columns(const std::vector<double>& row) {
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
}

void StreamState::learn(const double* row) {
  Eigen::VectorXd z(inputs_);
  set_scaled(trees_.front()->setting(), row, z);
  ++tested_;
  for (Eigen::Index o = 0; o < outputs_; ++o) {
    const double error =
        trees_[o]->learn({row, z.data(), row[inputs_ + o], row[inputs_ + outputs_], reservoir_.different_fraction()});
    squares_(o) += error * error;
    const double rate = 1.0 / std::min(static_cast<double>(tested_), recent_rows);
    recent_(o) = tested_ == 1 ? error * error : recent_(o) + rate * (error * error - recent_(o));
  }
}

// Takes units and first models from the first rows, and then learns these rows.
void StreamState::start() {
  const Eigen::Index count = std::ssize(first_rows_) / width();
  const RowMajor first = Eigen::Map<const RowMajor>(first_rows_.data(), count, width());
  first_rows_ = std::vector<double>();
  Eigen::VectorXd centre(inputs_);
  for (Eigen::Index j = 0; j < inputs_; ++j) {
    centre(j) = columns_[j].mean;
  }
  const Eigen::VectorXd scale = scale_of_inputs(first);
  for (Eigen::Index o = 0; o < outputs_; ++o) {
    start_tree(first, o, centre, scale);
  }
  for (Eigen::Index i = 0; i < count; ++i) {
    learn(first.row(i).data());
  }
  tested_ = 0;  // the first model has seen these rows, so they are no test of it
  squares_.setZero();
  recent_.setConstant(std::nan(""));
}

// Standard deviations; 1 for a constant input.
Eigen::VectorXd StreamState::scale_of_inputs(const RowMajor& first) const {
  Eigen::VectorXd scale = Eigen::VectorXd::Ones(inputs_);
  for (Eigen::Index j = 0; j < inputs_; ++j) {
    const double centre = columns_[j].mean;
    double squares = 0.0;
    for (Eigen::Index i = 0; i < first.rows(); ++i) {
      squares += std::isnan(first(i, j)) ? 0.0 : (first(i, j) - centre) * (first(i, j) - centre);
    }
    if (squares > 0.0) {
      scale(j) = std::sqrt(squares / std::max(1.0, known_(j)));
    }
  }
  return scale;
}

StreamSetting StreamState::usual_setting() const {
  return {.significance = options_.significance,
          .min_variance_gain = options_.min_variance_gain,
          .min_leaf_samples = options_.min_leaf_samples,
          .max_leaves = options_.max_leaves,
          .bins = options_.bins,
          .shrinkage = options_.shrinkage,
          .inputs = inputs_,
          .shape = GramShape(inputs_ + 1, 1),
          .centre = {},
          .scale = {}};
}

StreamTree& StreamState::add_tree(const StreamSetting& setting, const Eigen::VectorXd& first_model) {
  trees_.push_back(std::make_unique<StreamTree>(setting, first_model));
  trees_.back()->on_drift = [this](const std::function<bool(const double*)>& concerned) {
    reservoir_.remove_if(concerned);
  };
  return *trees_.back();
}

void StreamState::start_tree(const RowMajor& first, Eigen::Index output, const Eigen::VectorXd& centre,
                             const Eigen::VectorXd& scale) {
  const double mean = columns_[inputs_ + output].mean;
  const auto column = first.col(inputs_ + output).array();
  StreamSetting setting = usual_setting();
  setting.output_variance = (column - mean).square().mean();
  setting.rounding =
      rounding_of_deviation * std::sqrt(setting.output_variance) + rounding_of_magnitude * column.abs().maxCoeff();
  setting.centre = centre;
  setting.scale = scale;
  Basis basis{Eigen::VectorXd::Zero(inputs_), Eigen::VectorXd::Zero(inputs_ + 1)};
  basis.base(0) = mean;
  Eigen::VectorXd z(inputs_);
  // The second pass finds the digits that the first loses if values are large.
  for (int pass = 0; pass < 2; ++pass) {
    RowProducts products(setting.shape);
    Sums sums{std::vector<double>(setting.shape.size(), 0.0), 0};
    for (Eigen::Index i = 0; i < first.rows(); ++i) {
      set_scaled(setting, first.row(i).data(), z);
      products.set(basis, z.data(), first(i, inputs_ + output), first(i, inputs_ + outputs_));
      products.add_to(sums);
    }
    int rank = 0;
    basis.base += solve(setting.shape, sums.gram.data(), setting.shrinkage, rank);
  }
  add_tree(setting, basis.base);
}

Eigen::MatrixXd StreamState::predict(const Eigen::Ref<const Eigen::MatrixXd>& inputs) const {
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
      set_scaled(tree.setting(), x.data(), z);
      result(i, o) = tree.predict({x.data(), z.data(), 0.0, 1.0, 1.0});
    }
  }
  return result;
}

Eigen::VectorXd StreamState::prequential_rmse() const {
  if (tested_ == 0) return Eigen::VectorXd::Constant(outputs_, std::nan(""));
  return (squares_ / static_cast<double>(tested_)).cwiseSqrt();
}

StreamCounts StreamState::counts() const {
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
  counts.max_leaves = options_.max_leaves;
  counts.bytes += reservoir_.bytes() + static_cast<Eigen::Index>(first_rows_.capacity() * sizeof(double));
  return counts;
}

}  // namespace llmt
