#include "llmt/dynamic_model.hpp"

#include <fmt/format.h>

#include <cmath>
#include <set>
#include <stdexcept>
#include <utility>

#include "dynamics/windows.hpp"

namespace llmt {
namespace {

[[noreturn]] void refuse(const std::string& why) { throw std::invalid_argument("llmt::DynamicModel: " + why); }

void check_signals(const std::vector<Signal>& signals, const char* what, std::set<std::string>& seen) {
  for (const Signal& signal : signals) {
    if (signal.name.empty()) refuse(fmt::format("an {} has no name", what));
    if (!seen.insert(signal.name).second) refuse(fmt::format("two signals are \"{}\"", signal.name));
    if (!std::isfinite(signal.low) || !std::isfinite(signal.high) || signal.low > signal.high) {
      refuse(fmt::format("the range of \"{}\" is {} to {}", signal.name, signal.low, signal.high));
    }
  }
}

void check_polynomial(const Polynomial& polynomial, Eigen::Index regressors, Eigen::Index outputs) {
  for (const Eigen::VectorXd* values : {&polynomial.centre, &polynomial.scale, &polynomial.low, &polynomial.high}) {
    if (values->size() != regressors || !values->allFinite()) {
      refuse(
          fmt::format("the polynomial needs a finite centre, scale and range for each of {} regressors", regressors));
    }
  }
  if ((polynomial.scale.array() <= 0.0).any()) refuse("a scale of the polynomial is not positive");
  if ((polynomial.low.array() > polynomial.high.array()).any()) refuse("a range of a regressor ends before it begins");
  const Eigen::Index terms = std::ssize(polynomial.terms);
  if (terms > most_terms) refuse(fmt::format("the polynomial has {} terms, at most {} are taken", terms, most_terms));
  if (polynomial.coefficients.rows() != outputs || polynomial.coefficients.cols() != terms ||
      !polynomial.coefficients.allFinite()) {
    refuse(fmt::format("the polynomial needs {} finite coefficients for each of {} outputs", terms, outputs));
  }
  std::set<std::vector<int>> seen;
  for (const std::vector<int>& term : polynomial.terms) {
    if (std::ssize(term) > most_degree) refuse(fmt::format("a term has more than {} factors", most_degree));
    int before = 0;
    for (const int factor : term) {
      if (factor < before || factor >= regressors) refuse("the factors of a term are no ascending regressors");
      before = factor;
    }
    if (!seen.insert(term).second) refuse("two terms are the same product");
  }
}

void check_band(const RunBand& band, Eigen::Index outputs) {
  if (band.outputs.empty()) return;
  if (std::ssize(band.outputs) != outputs) {
    refuse(fmt::format("errors of held-out runs are given of {} outputs, there are {}", band.outputs.size(), outputs));
  }
  if (band.longest < 1) refuse(fmt::format("the longest held-out run has {} rows", band.longest));
  for (const std::vector<HeldOutErrors>& lists : band.outputs) {
    if (lists.empty()) refuse("an output has no errors of held-out runs, and another one has");
    double rows = 0.0;
    for (const HeldOutErrors& list : lists) {
      if (!(list.rows > rows) || !std::isfinite(list.rows)) refuse("errors of held-out runs do not ascend in rows");
      rows = list.rows;
      double error = 0.0;
      for (const double next : list.errors) {
        if (!(next >= error) || !std::isfinite(next)) refuse("errors of held-out runs are not finite and ascending");
        error = next;
      }
    }
  }
}

template <class AnyModel>
void check_rest(const AnyModel& rest, Eigen::Index regressors, Eigen::Index outputs) {
  if (rest.num_inputs() != regressors || rest.num_outputs() != outputs) {
    refuse(fmt::format("the rest has {} inputs and {} outputs, {} and {} are needed", rest.num_inputs(),
                       rest.num_outputs(), regressors, outputs));
  }
  for (const InputColumn& input : rest.inputs()) {
    if (input.is_categorical()) refuse(fmt::format("the regressor \"{}\" is a category", input.name));
  }
}

}  // namespace

DynamicModel::DynamicModel(DynamicParts parts) : parts_(std::move(parts)) {
  if (parts_.outputs.empty()) refuse("there is no output");
  std::set<std::string> seen;
  check_signals(parts_.inputs, "input", seen);
  check_signals(parts_.outputs, "output", seen);
  if (!(parts_.sample_time > 0.0) || !std::isfinite(parts_.sample_time)) {
    refuse(fmt::format("the sample time is {}", parts_.sample_time));
  }
  if (std::ssize(parts_.lags.outputs) != num_outputs() || std::ssize(parts_.lags.inputs) != num_inputs()) {
    refuse("lags are needed for each output and input");
  }
  check_lags(parts_.lags);
  columns_ = columns_of(parts_.lags);
  memory_ = longest_lag(parts_.lags);
  check_band(parts_.band, num_outputs());
  const Eigen::Index regressors = std::ssize(columns_);
  check_polynomial(parts_.polynomial, regressors, num_outputs());
  if (const auto* tree = std::get_if<Model>(&parts_.rest)) check_rest(*tree, regressors, num_outputs());
  if (const auto* sum = std::get_if<BoostedModel>(&parts_.rest)) check_rest(*sum, regressors, num_outputs());
}

double DynamicModel::lower(Eigen::Index output) const { return lower_bounds({parts_.outputs[output]})(0); }
double DynamicModel::upper(Eigen::Index output) const { return upper_bounds({parts_.outputs[output]})(0); }

}  // namespace llmt
