#include "llmt/dynamic_analysis.hpp"

#include <fmt/format.h>

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <stdexcept>

#include "base/decompositions.hpp"
#include "dynamics/linear_near.hpp"
#include "dynamics/one_step.hpp"
#include "llmt/static_curve.hpp"

namespace llmt {
namespace {

constexpr double on_unit_circle = 1e-9;

Pole pole_of(std::complex<double> z, double sample_time) {
  const std::complex<double> s = std::log(z) / sample_time;
  Pole pole{z};
  const double size = std::abs(s);
  pole.frequency = size / (2.0 * std::numbers::pi);
  pole.damping = size > 0.0 ? -s.real() / size : 1.0;
  const bool on_circle = std::abs(std::abs(z) - 1.0) < on_unit_circle;
  pole.time_constant = on_circle ? std::numeric_limits<double>::infinity() : -1.0 / s.real();
  return pole;
}

// The row of regressors with the first output at rest at a value and all else in the middle of the training rows.
Eigen::VectorXd at_rest(const DynamicModel& model, double value) {
  Eigen::VectorXd x = model.parts().polynomial.centre;
  for (std::size_t c = 0; c < model.columns().size(); ++c) {
    const LaggedColumn& column = model.columns()[c];
    if (!column.is_output) continue;
    if (column.minus_lag >= 0) {
      x(static_cast<Eigen::Index>(c)) = 0.0;
    } else if (column.signal == 0) {
      x(static_cast<Eigen::Index>(c)) = value;
    }
  }
  return x;
}

// Mean of the rows of a leaf, as regressors.
Eigen::VectorXd mean_of_leaf(const Model& tree, const Node& node) {
  Eigen::VectorXd x(tree.num_inputs());
  for (Eigen::Index j = 0; j < x.size(); ++j) x(j) = tree.inputs()[j].centre;
  for (std::size_t r = 0; r < tree.regressors().size(); ++r) {
    const Regressor& regressor = tree.regressors()[r];
    if (regressor.second_input >= 0) continue;
    x(regressor.input) = regressor.centre + node.mean(static_cast<Eigen::Index>(r));
  }
  return x;
}

// An oblique tree does not know where the rows of a leaf lie: its model where the system rests over the range of the
// first input that changes, or nothing if there are less than two such states.
std::vector<LocalDynamics> at_states_of_rest(const DynamicModel& model) {
  constexpr Eigen::Index count = 5;
  const std::vector<Signal>& inputs = model.parts().inputs;
  const auto first = std::ranges::find_if(inputs, [](const Signal& input) { return input.low < input.high; });
  if (first == inputs.end()) return {};
  const StaticCurve curve = static_curve(model, first - inputs.begin(), count);
  std::vector<LocalDynamics> all;
  for (const RestPoint& point : curve.points) {
    if (point.is_at_stop) continue;
    Eigen::VectorXd x(std::ssize(model.columns()));
    for (std::size_t c = 0; c < model.columns().size(); ++c) {
      const LaggedColumn& column = model.columns()[c];
      double& value = x(static_cast<Eigen::Index>(c));
      if (column.is_output) {
        value = column.minus_lag >= 0 ? 0.0 : point.outputs(column.signal);
      } else {
        value = column.signal == curve.input ? point.input : curve.others(column.signal);
      }
    }
    all.push_back(dynamics_at(model, x, fmt::format("at rest, {} = {:.4g}", first->name, point.input)));
  }
  return all.size() < 2 ? std::vector<LocalDynamics>() : all;
}

}  // namespace

LocalDynamics linear_near(const DynamicModel& model, const Eigen::VectorXd& regressors, const std::vector<bool>& stops,
                          std::string where) {
  OneStep map(model.parts());
  Eigen::VectorXd y(model.num_outputs());
  Eigen::MatrixXd by_regressor;
  Eigen::MatrixXd by_parameter;
  map.derivatives(regressors.data(), y.data(), by_regressor, by_parameter);
  const Eigen::Index outputs = model.num_outputs();
  LocalDynamics local{std::move(where), {}, {}, true};
  local.of_outputs.assign(std::max<Eigen::Index>(model.memory(), 1), Eigen::MatrixXd::Zero(outputs, outputs));
  local.of_inputs.assign(model.memory() + 1, Eigen::MatrixXd::Zero(outputs, model.num_inputs()));
  for (std::size_t c = 0; c < model.columns().size(); ++c) {
    const LaggedColumn& column = model.columns()[c];
    const auto slope = by_regressor.col(static_cast<Eigen::Index>(c));
    if (!column.is_output) {
      local.of_inputs[column.lag].col(column.signal) += slope;
      continue;
    }
    // An output at a stop does not move, what pushes against the stop does.
    const double moves = stops[column.signal] ? 0.0 : 1.0;
    local.of_outputs[column.lag - 1].col(column.signal) += (column.minus_lag >= 0 ? 1.0 : moves) * slope;
    if (column.minus_lag >= 0) local.of_outputs[column.minus_lag - 1].col(column.signal) -= moves * slope;
  }
  for (Eigen::Index o = 0; o < outputs; ++o) {
    if (adds_up(model.parts().lags, o) && !stops[o]) local.of_outputs[0](o, o) += 1.0;
  }
  // The state is y(t - 1), y(t - 2), ... as far back as outputs are looked at: lags of inputs alone move no pole.
  Eigen::Index memory = 1;
  for (const LaggedColumn& column : model.columns()) {
    if (column.is_output) memory = std::max<Eigen::Index>({memory, column.lag, column.minus_lag});
  }
  local.of_outputs.resize(memory);
  Eigen::MatrixXd companion = Eigen::MatrixXd::Zero(outputs * memory, outputs * memory);
  Eigen::MatrixXd of_outputs = Eigen::MatrixXd::Zero(outputs, outputs);
  Eigen::MatrixXd of_inputs = Eigen::MatrixXd::Zero(outputs, model.num_inputs());
  for (Eigen::Index k = 0; k < memory; ++k) {
    companion.block(0, k * outputs, outputs, outputs) = local.of_outputs[k];
    of_outputs += local.of_outputs[k];
  }
  for (const Eigen::MatrixXd& each : local.of_inputs) of_inputs += each;
  companion.bottomLeftCorner(outputs * (memory - 1), outputs * (memory - 1)).setIdentity();
  const Eigen::VectorXcd eigenvalues = Eigen::EigenSolver<Eigen::MatrixXd>(companion, false).eigenvalues();
  for (const std::complex<double> z : eigenvalues) {
    if (std::abs(z) < on_unit_circle) continue;
    local.poles.push_back(pole_of(z, model.parts().sample_time));
    local.is_stable = local.is_stable && std::abs(z) <= 1.0 + on_unit_circle;
  }
  std::ranges::sort(local.poles, [](const Pole& left, const Pole& right) {
    const double a = std::abs(left.z);
    const double b = std::abs(right.z);
    return a != b ? a > b : left.z.imag() > right.z.imag();
  });
  const Eigen::MatrixXd at_rest = Eigen::MatrixXd::Identity(outputs, outputs) - of_outputs;
  const Eigen::ColPivHouseholderQR<Eigen::MatrixXd> solver(at_rest);
  local.steady_gain = solver.solve(of_inputs);
  if (solver.maxPivot() == 0.0 || solver.rank() < outputs) {
    local.steady_gain.setConstant(outputs, model.num_inputs(), std::numeric_limits<double>::quiet_NaN());
  }
  return local;
}

LocalDynamics dynamics_at(const DynamicModel& model, const Eigen::VectorXd& regressors, std::string where) {
  if (regressors.size() != std::ssize(model.columns()) || !regressors.allFinite()) {
    throw std::invalid_argument("llmt::dynamics_at: a finite value is needed for each regressor");
  }
  return linear_near(model, regressors, std::vector<bool>(model.num_outputs(), false), std::move(where));
}

std::vector<LocalDynamics> local_dynamics(const DynamicModel& model) {
  const DynamicParts& parts = model.parts();
  std::vector<LocalDynamics> all;
  const auto* tree = std::get_if<Model>(&parts.rest);
  const bool is_oblique = tree != nullptr && std::ranges::any_of(tree->partitions(), [](const Partition& partition) {
                            return partition.nodes.front().is_oblique();
                          });
  if (is_oblique) all = at_states_of_rest(model);
  if (!all.empty()) return all;
  if (tree != nullptr && !is_oblique) {
    for (std::size_t p = 0; p < tree->partitions().size(); ++p) {
      const Partition& partition = tree->partitions()[p];
      int number = 0;
      for (const Leaf& leaf : tree->leaves(static_cast<Eigen::Index>(p))) {
        const std::string of_output =
            tree->partitions().size() > 1 ? " of " + parts.outputs[partition.outputs.front()].name : "";
        all.push_back(dynamics_at(model, mean_of_leaf(*tree, partition.nodes[leaf.node]),
                                  fmt::format("leaf {}{}", ++number, of_output)));
      }
    }
    return all;
  }
  const bool is_linear = std::holds_alternative<std::monostate>(parts.rest) &&
                         std::ranges::all_of(parts.polynomial.terms, [](const auto& term) { return term.size() < 2; });
  const Signal& first = parts.outputs.front();
  if (is_linear || adds_up(parts.lags, 0))
    return {dynamics_at(model, at_rest(model, 0.5 * (first.low + first.high)), "everywhere")};
  for (const double value : {first.low, 0.5 * (first.low + first.high), first.high}) {
    all.push_back(dynamics_at(model, at_rest(model, value), fmt::format("{} = {:.4g}", first.name, value)));
  }
  return all;
}

Eigen::MatrixXd step_response(const LocalDynamics& local, Eigen::Index input, Eigen::Index rows) {
  const Eigen::Index outputs = local.steady_gain.rows();
  if (input < 0 || input >= local.steady_gain.cols() || rows < 1) {
    throw std::invalid_argument(
        fmt::format("llmt::step_response: input {} and {} rows are asked for; there are {} inputs", input, rows,
                    local.steady_gain.cols()));
  }
  Eigen::MatrixXd response = Eigen::MatrixXd::Zero(rows, outputs);
  for (Eigen::Index row = 0; row < rows; ++row) {
    Eigen::VectorXd y = Eigen::VectorXd::Zero(outputs);
    for (Eigen::Index lag = 0; lag < std::ssize(local.of_inputs) && lag <= row; ++lag) {
      y += local.of_inputs[lag].col(input);
    }
    for (Eigen::Index lag = 1; lag <= std::ssize(local.of_outputs) && lag <= row; ++lag) {
      y += local.of_outputs[lag - 1] * response.row(row - lag).transpose();
    }
    response.row(row) = y.transpose();
  }
  return response;
}

Eigen::Index settled_rows(const LocalDynamics& local) {
  constexpr Eigen::Index most = 100'000;
  if (!local.is_stable || !local.steady_gain.allFinite()) return -1;
  // What is left of a motion after n rows falls as |z|^n, so this many tell when it is over.
  const double slowest = local.poles.empty() ? 0.0 : std::abs(local.poles.front().z);
  if (slowest >= 1.0) return -1;
  const double rows = slowest > 0.0 ? 12.0 / -std::log(slowest) : 0.0;
  if (rows > static_cast<double>(most)) return -1;
  const Eigen::Index count = 2 * static_cast<Eigen::Index>(rows) + std::ssize(local.of_inputs) + 1;
  Eigen::Index settled = 0;
  for (Eigen::Index input = 0; input < local.steady_gain.cols(); ++input) {
    const Eigen::MatrixXd response = step_response(local, input, count);
    for (Eigen::Index o = 0; o < response.cols(); ++o) {
      const double end = local.steady_gain(o, input);
      for (Eigen::Index row = count - 1; row >= 0; --row) {
        if (std::abs(response(row, o) - end) <= 0.02 * std::abs(end)) continue;
        if (std::abs(end) > 0.0) settled = std::max(settled, row + 1);
        break;
      }
    }
  }
  return settled;
}

}  // namespace llmt
