#include "llmt/static_curve.hpp"

#include <fmt/format.h>

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "dynamics/linear_near.hpp"
#include "dynamics/one_step.hpp"
#include "dynamics/windows.hpp"

namespace llmt {
namespace {

constexpr Eigen::Index scanned = 401;
constexpr int bisections = 60;
constexpr int newton_steps = 50;
constexpr double close_enough = 1e-8;  // of the range of an output
constexpr Eigen::Index most_corners = 4;

// The map at rest: what the model gives where `free` are the outputs without their stops, for ever.
class AtRest {
 public:
  AtRest(const DynamicModel& model, Eigen::VectorXd inputs)
      : model_(model), map_(model.parts()), inputs_(std::move(inputs)), x_(std::ssize(model.columns())) {}

  // f(x(free)) - free
  Eigen::VectorXd rest_of(const Eigen::VectorXd& free) {
    Eigen::VectorXd y(free.size());
    map_.values(regressors(free).data(), y.data());
    return y - free;
  }

  const Eigen::VectorXd& regressors(const Eigen::VectorXd& free) {
    for (std::size_t c = 0; c < model_.columns().size(); ++c) {
      const LaggedColumn& column = model_.columns()[c];
      double& value = x_(static_cast<Eigen::Index>(c));
      if (!column.is_output) {
        value = inputs_(column.signal);
      } else {
        const double held = held_at_stops(model_.parts().outputs[column.signal], free(column.signal));
        value = column.minus_lag < 0 ? held : free(column.signal) - held;
      }
    }
    return x_;
  }

  // The outputs that stand at a stop.
  std::vector<bool> stops(const Eigen::VectorXd& free) const {
    std::vector<bool> result;
    for (Eigen::Index o = 0; o < free.size(); ++o) {
      result.push_back(held_at_stops(model_.parts().outputs[o], free(o)) != free(o));
    }
    return result;
  }

 private:
  const DynamicModel& model_;
  OneStep map_;
  Eigen::VectorXd inputs_;
  Eigen::VectorXd x_;
};

// All zeros of a function of one output between the values of a grid.
std::vector<Eigen::VectorXd> scan(AtRest& at_rest, const Signal& output) {
  const double range = output.high - output.low;
  const auto value = [&](double y) { return at_rest.rest_of(Eigen::VectorXd::Constant(1, y))(0); };
  std::vector<Eigen::VectorXd> found;
  double before = output.low - range;
  double of_before = value(before);
  for (Eigen::Index k = 1; k < scanned; ++k) {
    const double here = output.low - range + 3.0 * range * static_cast<double>(k) / static_cast<double>(scanned - 1);
    const double of_here = value(here);
    if (of_here == 0.0 || of_before * of_here < 0.0) {
      double low = before;
      double high = here;
      for (int step = 0; step < bisections && of_here != 0.0; ++step) {
        const double middle = 0.5 * (low + high);
        (value(middle) * of_before > 0.0 ? low : high) = middle;
      }
      // A map that jumps has no state of rest where it does.
      if (std::abs(value(high)) <= 1e-6 * range) found.push_back(Eigen::VectorXd::Constant(1, high));
    }
    before = here;
    of_before = of_here;
  }
  return found;
}

// Newton's method with steps that are halved until the rest falls; empty: it found nothing.
Eigen::VectorXd newton(const DynamicModel& model, AtRest& at_rest, Eigen::VectorXd free, const Eigen::VectorXd& range) {
  Eigen::VectorXd rest = at_rest.rest_of(free);
  const auto size = [&](const Eigen::VectorXd& of) { return of.cwiseQuotient(range).norm(); };
  for (int step = 0; step < newton_steps && size(rest) > close_enough; ++step) {
    const LocalDynamics local = linear_near(model, at_rest.regressors(free), at_rest.stops(free), "");
    Eigen::MatrixXd slopes = -Eigen::MatrixXd::Identity(free.size(), free.size());
    for (const Eigen::MatrixXd& each : local.of_outputs) slopes += each;
    const Eigen::VectorXd move = slopes.partialPivLu().solve(rest);
    if (!move.allFinite()) return {};
    double share = 1.0;
    Eigen::VectorXd next = at_rest.rest_of(free - move);
    while (!(size(next) < size(rest)) && share > 1e-4) {
      share *= 0.5;
      next = at_rest.rest_of(free - share * move);
    }
    if (!(size(next) < size(rest))) return {};
    free -= share * move;
    rest = next;
  }
  return size(rest) <= close_enough ? free : Eigen::VectorXd();
}

std::vector<Eigen::VectorXd> find(const DynamicModel& model, AtRest& at_rest,
                                  const std::vector<Eigen::VectorXd>& before) {
  const std::vector<Signal>& outputs = model.parts().outputs;
  if (outputs.size() == 1) return scan(at_rest, outputs.front());
  const Eigen::Index count = std::ssize(outputs);
  Eigen::VectorXd low(count);
  Eigen::VectorXd high(count);
  for (Eigen::Index o = 0; o < count; ++o) {
    low(o) = outputs[o].low;
    high(o) = outputs[o].high;
  }
  std::vector<Eigen::VectorXd> starts = before;
  starts.emplace_back(0.5 * (low + high));
  const Eigen::Index corners = Eigen::Index{1} << std::min(count, most_corners);
  for (Eigen::Index corner = 0; corner < corners; ++corner) {
    Eigen::VectorXd& start = starts.emplace_back(0.5 * (low + high));
    for (Eigen::Index o = 0; o < std::min(count, most_corners); ++o)
      start(o) = (corner >> o) % 2 == 0 ? low(o) : high(o);
  }
  const Eigen::VectorXd range = (high - low).cwiseMax(1e-300);
  std::vector<Eigen::VectorXd> found;
  for (const Eigen::VectorXd& start : starts) {
    const Eigen::VectorXd state = newton(model, at_rest, start, range);
    if (state.size() == 0) continue;
    const bool is_near = ((state - low + range).array() >= 0.0).all() && ((high + range - state).array() >= 0.0).all();
    const bool is_new = std::ranges::none_of(
        found, [&](const Eigen::VectorXd& other) { return ((state - other).cwiseQuotient(range)).norm() < 1e-6; });
    if (is_near && is_new) found.push_back(state);
  }
  return found;
}

}  // namespace

StaticCurve static_curve(const DynamicModel& model, Eigen::Index input, Eigen::Index count,
                         const Eigen::VectorXd& others) {
  const DynamicParts& parts = model.parts();
  if (input < 0 || input >= model.num_inputs()) {
    throw std::invalid_argument(
        fmt::format("llmt::static_curve: input {} is asked for, there are {}", input, model.num_inputs()));
  }
  if (count < 2) throw std::invalid_argument(fmt::format("llmt::static_curve: {} points, 2 are needed", count));
  if (others.size() > 0 && (others.size() != model.num_inputs() || !others.allFinite())) {
    throw std::invalid_argument("llmt::static_curve: a finite value is needed for each input");
  }
  StaticCurve curve{input, others, {}, {}};
  if (others.size() == 0) {
    curve.others.resize(model.num_inputs());
    for (Eigen::Index i = 0; i < model.num_inputs(); ++i) {
      curve.others(i) = 0.5 * (parts.inputs[i].low + parts.inputs[i].high);
    }
  }
  const bool adds_up = std::ranges::any_of(parts.lags.adds_up, [](bool each) { return each; });
  std::vector<Eigen::VectorXd> found;
  for (Eigen::Index k = 0; k < count; ++k) {
    Eigen::VectorXd inputs = curve.others;
    const double share = static_cast<double>(k) / static_cast<double>(count - 1);
    inputs(input) = (1.0 - share) * parts.inputs[input].low + share * parts.inputs[input].high;
    AtRest at_rest(model, inputs);
    found = adds_up ? std::vector<Eigen::VectorXd>() : find(model, at_rest, found);
    if (found.empty()) curve.none.push_back(inputs(input));
    std::ranges::sort(found, {}, [](const Eigen::VectorXd& state) { return state(0); });
    for (const Eigen::VectorXd& free : found) {
      RestPoint point{inputs(input), free};
      const std::vector<bool> stops = at_rest.stops(free);
      point.is_stable = linear_near(model, at_rest.regressors(free), stops, "").is_stable;
      for (std::size_t o = 0; o < stops.size(); ++o) {
        double& output = point.outputs(static_cast<Eigen::Index>(o));
        output = held_at_stops(parts.outputs[o], output);
        point.is_at_stop = point.is_at_stop || stops[o];
        point.is_inside = point.is_inside && output >= parts.outputs[o].low && output <= parts.outputs[o].high;
      }
      curve.points.push_back(std::move(point));
    }
  }
  return curve;
}

}  // namespace llmt
