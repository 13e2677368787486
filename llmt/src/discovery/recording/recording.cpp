#include "discovery/recording/recording.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <numeric>
#include <set>
#include <string>
#include <utility>

#include "discovery/recording/refuse.hpp"

namespace llmt::discovery {
namespace {

// `order`: of the rows in time.
Pieces pieces_of(const Inputs& inputs, const Piece& order) {
  const Eigen::Index n = inputs.values.rows();
  const Eigen::VectorXd& instants = inputs.instants;
  const auto run = [&](Eigen::Index i) { return inputs.runs.empty() ? Eigen::Index{0} : inputs.runs[i]; };
  std::vector<double> steps;
  for (Eigen::Index k = 1; k < n; ++k) {
    if (run(order[k]) != run(order[k - 1])) continue;
    const double step = instants(order[k]) - instants(order[k - 1]);
    if (!(step > 0.0)) {
      refuse("find_missing", fmt::format("rows {} and {} were taken at the same time, {}", order[k - 1] + 1,
                                         order[k] + 1, instants(order[k])));
    }
    steps.push_back(step);
  }
  Pieces pieces;
  if (steps.empty()) refuse("find_missing", "no run has two rows");
  std::ranges::nth_element(steps, steps.begin() + std::ssize(steps) / 2);
  pieces.step = steps[steps.size() / 2];
  for (Eigen::Index k = 0; k < n; ++k) {
    const bool goes_on = k > 0 && run(order[k]) == run(order[k - 1]) &&
                         instants(order[k]) - instants(order[k - 1]) <= interruption * pieces.step;
    if (!goes_on) {
      pieces.rows.emplace_back();
      pieces.runs.push_back(run(order[k]));
    }
    pieces.rows.back().push_back(order[k]);
  }
  return pieces;
}

// Values of the inputs, 0 within their bands.
Eigen::MatrixXd at_rest_as_zero(const Inputs& inputs) {
  Eigen::MatrixXd values = inputs.values;
  for (Eigen::Index j = 0; j < inputs.zero_bands.size(); ++j) {
    values.col(j) = (values.col(j).array().abs() < inputs.zero_bands(j)).select(0.0, values.col(j));
  }
  return values;
}

template <class T, class Make>
const T& once(std::shared_ptr<const T>& known, Make make) {
  if (known == nullptr) known = std::make_shared<const T>(make());
  return *known;
}

}  // namespace

Eigen::Index order_column(const Inputs& inputs) {
  const auto found = std::ranges::find(inputs.names, inputs.order);
  if (found == inputs.names.end())
    refuse("standard_terms", fmt::format("the order \"{}\" is not an input", inputs.order));
  return found - inputs.names.begin();
}

void check_inputs(const Inputs& inputs) {
  if (std::ssize(inputs.names) != inputs.values.cols()) {
    refuse("standard_terms", fmt::format("{} names for {} columns", inputs.names.size(), inputs.values.cols()));
  }
  std::set<std::string> seen;
  for (const std::string& name : inputs.names) {
    if (name.empty()) refuse("standard_terms", "an input has no name");
    if (!seen.insert(name).second) refuse("standard_terms", fmt::format("the input \"{}\" is there twice", name));
  }
  for (Eigen::Index j = 0; j < inputs.values.cols(); ++j) {
    if (!inputs.values.col(j).allFinite()) {
      refuse("standard_terms", fmt::format("the input \"{}\" has a value that is not finite", inputs.names[j]));
    }
  }
  const auto refuse_unlike = [](const char* what, Eigen::Index count, Eigen::Index expected) {
    if (count > 0 && count != expected) refuse("standard_terms", fmt::format(fmt::runtime(what), count, expected));
  };
  refuse_unlike("{} instants for {} rows", inputs.instants.size(), inputs.values.rows());
  refuse_unlike("{} labels of runs for {} rows", std::ssize(inputs.runs), inputs.values.rows());
  refuse_unlike("{} zero bands for {} inputs", inputs.zero_bands.size(), inputs.values.cols());
  if (!inputs.instants.allFinite()) refuse("standard_terms", "an instant is not finite");
}

namespace {

// Throws as check_inputs(), and where the order holds a value twice.
Rows rows_in_order(const Inputs& inputs) {
  check_inputs(inputs);
  const Eigen::Index n = inputs.values.rows();
  Rows rows{.inputs = at_rest_as_zero(inputs),
            .simulated = Eigen::VectorXd::Zero(n),
            .sequence = {},
            .instants = Eigen::VectorXd::LinSpaced(n, 0.0, static_cast<double>(n - 1))};
  rows.sequence.resize(n);
  std::iota(rows.sequence.begin(), rows.sequence.end(), 0);
  if (inputs.instants.size() > 0) {
    rows.instants = inputs.instants;
    std::ranges::stable_sort(rows.sequence, {}, [&](Eigen::Index i) {
      return std::pair(inputs.runs.empty() ? Eigen::Index{0} : inputs.runs[i], rows.instants(i));
    });
    // A run begins at 0, because a clock may go on from one run to the next.
    Eigen::Index first = 0;
    for (Eigen::Index k = 0; k < n && !inputs.runs.empty(); ++k) {
      const Eigen::Index row = rows.sequence[k];
      if (k == 0 || inputs.runs[row] != inputs.runs[rows.sequence[k - 1]]) first = row;
      rows.instants(row) = inputs.instants(row) - inputs.instants(first);
    }
    return rows;
  }
  if (inputs.order.empty()) return rows;
  rows.instants = inputs.values.col(order_column(inputs));
  std::ranges::stable_sort(rows.sequence, {}, [&](Eigen::Index i) { return rows.instants(i); });
  for (std::size_t k = 1; k < rows.sequence.size(); ++k) {
    if (rows.instants(rows.sequence[k]) == rows.instants(rows.sequence[k - 1])) {
      refuse("standard_terms",
             fmt::format("the order \"{}\" has the value {} twice", inputs.order, rows.instants(rows.sequence[k])));
    }
  }
  return rows;
}

}  // namespace

Recording::Recording(Inputs inputs) : inputs_(std::move(inputs)), rows_(rows_in_order(inputs_)) {}

Recording Recording::with_zero_bands(Eigen::VectorXd bands) const {
  Recording other = *this;
  other.inputs_.zero_bands = std::move(bands);
  check_inputs(other.inputs_);
  other.rows_.inputs = at_rest_as_zero(other.inputs_);
  return other;
}

Recording Recording::with_values(Eigen::MatrixXd values) const {
  Recording other = *this;
  other.inputs_.values = std::move(values);
  other.rows_.inputs = at_rest_as_zero(other.inputs_);
  other.known_ = {};
  other.known_.pieces = known_.pieces;
  return other;
}

const Pieces& Recording::pieces() const {
  return once(known_.pieces, [&] { return pieces_of(inputs_, rows_.sequence); });
}

const std::vector<Signal>& Recording::signals() const {
  return once(known_.signals, [&] { return signals_of(pieces().rows, inputs_.values); });
}

bool Recording::is_smooth(Eigen::Index input) const {
  const auto own = std::ranges::find(signals(), input, &Signal::column);
  return own != signals().end() && own->is_smooth();
}

const RowFilter& Recording::filter() const {
  return once(known_.filter, [&] { return RowFilter(rows_, inputs_.values, inputs_.cutoff); });
}

Eigen::MatrixXd Recording::as_measured(const Eigen::MatrixXd& of_rows) const {
  return is_filtered() ? filter()(of_rows) : of_rows;
}

Eigen::MatrixXd Recording::squared_errors_of_steps(const Eigen::MatrixXd& of_rows) const {
  if (!is_filtered()) return Eigen::MatrixXd::Zero(of_rows.rows(), of_rows.cols());
  const RowFilter& every_row = filter();
  return once(known_.errors_of_steps, [&] { return ErrorsOfSteps(every_row, rows_, inputs_.values, inputs_.cutoff); })
      .squares(every_row, of_rows);
}

Eigen::Index Recording::lag() const {
  return once(known_.lag, [&] { return smooth_lag(rows_, inputs_.values); });
}

const Derivatives& Recording::derivatives() const {
  return once(known_.derivatives, [&] { return Derivatives(rows_, lags_of_a_window * lag()); });
}

const std::vector<Motion>& Recording::axes() const {
  return once(known_.axes, [&] { return motions(derivatives(), inputs_); });
}

const Eigen::MatrixXd& Recording::covariance() const {
  return once(known_.covariance, [&] { return covariance_of_errors(rows_, inputs_); });
}

std::shared_ptr<const Surrogate> Recording::surrogate(const Eigen::MatrixXd& simulated) const {
  const bool is_known = known_.surrogate != nullptr && known_.surrogate->simulated.rows() == simulated.rows() &&
                        known_.surrogate->simulated.cols() == simulated.cols() &&
                        known_.surrogate->simulated == simulated;
  if (!is_known) {
    known_.surrogate = std::make_shared<const SurrogateOf>(
        SurrogateOf{simulated, std::make_shared<const Surrogate>(inputs_.values, simulated)});
  }
  return known_.surrogate->surrogate;
}

}  // namespace llmt::discovery
