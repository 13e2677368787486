#include "llmt/stream.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "base/checks.hpp"
#include "base/memory.hpp"
#include "data/row_weight.hpp"
#include "data/table.hpp"
#include "fit/plan/memory.hpp"
#include "llmt/option_fields.hpp"
#include "stream/state.hpp"

namespace llmt {
namespace {

// The default of max_leaves is the number of leaves whose bins take this many bytes, within these bounds. If
// the fewest leaves take more than `most_default_bytes`, because there are many inputs, there are fewer leaves, down to
// one, which needs no bins.
constexpr double default_bytes = 64.0 * 1024.0 * 1024.0;
constexpr double most_default_bytes = 1024.0 * 1024.0 * 1024.0;
constexpr Eigen::Index fewest_default_leaves = 16;
constexpr Eigen::Index most_default_leaves = 500;

// The default of min_leaf_samples.
constexpr Eigen::Index rows_per_coefficient = 2;

[[noreturn]] void reject(const std::string& what) { throw std::invalid_argument("llmt::Stream: " + what); }

void check(Eigen::Index inputs, Eigen::Index outputs, const StreamOptions& options) {
  if (inputs < 1 || outputs < 1) {
    reject(fmt::format("it has {} inputs and {} outputs, both must be at least 1", inputs, outputs));
  }
  const auto need = [](bool holds, const char* field, double value, const char* bound) {
    if (!holds) reject(fmt::format("StreamOptions::{} is {}, it must be {}", field, value, bound));
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
}

StreamOptions with_defaults(Eigen::Index inputs, StreamOptions options) {
  if (options.min_leaf_samples == 0) {
    options.min_leaf_samples = rows_per_coefficient * (inputs + 1);
  }
  if (options.max_leaves == 0) {
    const double bytes_per_leaf =
        static_cast<double>(inputs * options.bins * GramShape(inputs + 1, 1).size()) * sizeof(double);
    const auto most = static_cast<Eigen::Index>(most_default_bytes / bytes_per_leaf);
    options.max_leaves = std::clamp(static_cast<Eigen::Index>(default_bytes / bytes_per_leaf), fewest_default_leaves,
                                    most_default_leaves);
    options.max_leaves = std::clamp<Eigen::Index>(most, 1, options.max_leaves);
  }
  return options;
}

void check_rows(const StreamState& state, const Eigen::Ref<const Eigen::MatrixXd>& inputs,
                const Eigen::Ref<const Eigen::MatrixXd>& outputs, const Eigen::Ref<const Eigen::VectorXd>& weights) {
  if (inputs.cols() != state.inputs() || outputs.cols() != state.outputs() || inputs.rows() != outputs.rows() ||
      (weights.size() > 0 && weights.size() != inputs.rows())) {
    reject(fmt::format(
        "add(): inputs is {} x {}, outputs is {} x {} and there are {} weights; the stream has {} "
        "inputs and {} outputs",
        inputs.rows(), inputs.cols(), outputs.rows(), outputs.cols(), weights.size(), state.inputs(), state.outputs()));
  }
  for (Eigen::Index i = 0; i < inputs.rows(); ++i) {
    const auto refuse = [&](const char* what, Eigen::Index column, double value, const char* bound) {
      reject(fmt::format("add(): {}({}, {}) is {}, it must be {} (row {} of the stream; counted from 0)", what, i,
                         column, value, bound, state.offered() + i));
    };
    for (Eigen::Index j = 0; j < inputs.cols(); ++j) {
      if (std::abs(inputs(i, j)) > largest_magnitude) {
        refuse("inputs", j, inputs(i, j), "at most 1e150 in magnitude, or NaN where it is missing");
      }
    }
    for (Eigen::Index o = 0; o < outputs.cols(); ++o) {
      if (!(std::abs(outputs(i, o)) <= largest_magnitude)) {
        refuse("outputs", o, outputs(i, o), "finite and at most 1e150 in magnitude");
      }
    }
    if (weights.size() > 0 && !is_row_weight(weights(i))) refuse("weights", 0, weights(i), words_of_row_weight);
  }
}

std::unique_ptr<StreamState> make_state(Eigen::Index inputs, Eigen::Index outputs, const StreamOptions& options) {
  check(inputs, outputs, options);
  // A snapshot needs the sums of one leaf at least.
  refuse_beyond_memory(
      {.rows = 0, .inputs = inputs, .outputs = outputs, .coefficients = inputs + 1, .unknowns = 0, .threads = 1},
      machine_memory());
  return std::make_unique<StreamState>(inputs, outputs, with_defaults(inputs, options));
}

}  // namespace

StreamOptions stream_options(const FitOptions& options) {
  require_taken(options, in_stream);
  const std::vector<double>& shrinkages = options.expert.shrinkages;
  if (shrinkages.size() > 1) {
    throw std::invalid_argument(
        fmt::format("llmt::stream_options: expert.shrinkages has {} numbers, a stream takes one", shrinkages.size()));
  }
  StreamOptions result{.min_leaf_samples = options.min_leaf_samples, .max_leaves = options.max_leaves};
  if (options.significance >= 0.0) result.significance = options.significance;
  if (!shrinkages.empty()) result.shrinkage = shrinkages.front();
  return result;
}

Stream::Stream(Eigen::Index num_inputs, Eigen::Index num_outputs, const StreamOptions& options)
    : state_(make_state(num_inputs, num_outputs, options)) {}
Stream::~Stream() = default;
Stream::Stream(Stream&&) noexcept = default;
Stream& Stream::operator=(Stream&&) noexcept = default;

void Stream::add(const Eigen::Ref<const Eigen::MatrixXd>& inputs, const Eigen::Ref<const Eigen::MatrixXd>& outputs,
                 const Eigen::Ref<const Eigen::VectorXd>& weights) {
  check_rows(*state_, inputs, outputs, weights);
  std::vector<double> row(inputs.cols() + outputs.cols() + 1);
  for (Eigen::Index i = 0; i < inputs.rows(); ++i) {
    for (Eigen::Index j = 0; j < inputs.cols(); ++j) {
      row[j] = inputs(i, j);
    }
    for (Eigen::Index o = 0; o < outputs.cols(); ++o) {
      row[inputs.cols() + o] = outputs(i, o);
    }
    row.back() = weights.size() > 0 ? weights(i) : 1.0;
    state_->add(row);
  }
}

Eigen::MatrixXd Stream::predict(const Eigen::Ref<const Eigen::MatrixXd>& inputs) const {
  if (inputs.cols() != state_->inputs()) {
    reject(fmt::format("predict(): inputs has {} columns, the stream has {}", inputs.cols(), state_->inputs()));
  }
  check_finite_or_missing("llmt::Stream::predict", "inputs", inputs);
  return state_->predict(inputs);
}

Eigen::VectorXd Stream::prequential_rmse() const { return state_->prequential_rmse(); }
Eigen::VectorXd Stream::recent_rmse() const { return state_->recent_rmse(); }
StreamCounts Stream::counts() const { return state_->counts(); }

Model Stream::snapshot(ValidityChoice validity) const {
  if (state_->rows() == 0) {
    reject("snapshot(): there is no row yet");
  }
  if (validity == ValidityChoice::gaussian) {
    reject("snapshot(): ValidityChoice::gaussian is not for streams");
  }
  return state_->snapshot(validity);
}

}  // namespace llmt
