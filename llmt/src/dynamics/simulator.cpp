#include "llmt/simulator.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "dynamics/one_step.hpp"
#include "dynamics/windows.hpp"

namespace llmt {

struct Simulator::State {
  explicit State(const DynamicModel& of) : model(of), map(model.parts()) {}
  State(const State& other)
      : model(other.model),
        map(model.parts()),
        inputs(other.inputs),
        outputs(other.outputs),
        x(other.x),
        free(other.free),
        result(other.result) {}

  DynamicModel model;
  OneStep map;
  Eigen::MatrixXd inputs = {};  // memory + 1 rows, the latest last; the last one is that of the step
  Outputs outputs = {};         // memory rows
  Eigen::VectorXd x = {};
  Eigen::VectorXd free = {};  // the outputs of the step without their stops
  Eigen::VectorXd result = {};
};

namespace {

void shift_up(Eigen::MatrixXd& rows) {
  for (Eigen::Index row = 0; row + 1 < rows.rows(); ++row) rows.row(row) = rows.row(row + 1);
}

void require_finite(const Eigen::Ref<const Eigen::MatrixXd>& values, Eigen::Index columns, const char* what) {
  if (values.cols() != columns) {
    throw std::invalid_argument(
        fmt::format("llmt::Simulator: {} has {} values a row, the model has {}", what, values.cols(), columns));
  }
  if (!values.allFinite()) throw std::invalid_argument(fmt::format("llmt::Simulator: {} is not finite", what));
}

}  // namespace

Simulator::Simulator(const DynamicModel& model) : state_(std::make_unique<State>(model)) {
  const auto middles = [](const std::vector<Signal>& signals) {
    Eigen::VectorXd values(std::ssize(signals));
    for (std::size_t k = 0; k < signals.size(); ++k) values(k) = 0.5 * (signals[k].low + signals[k].high);
    return values;
  };
  start_at_rest(middles(model.parts().inputs), middles(model.parts().outputs));
}

Simulator::Simulator(const Simulator& other) : state_(std::make_unique<State>(*other.state_)) {}
Simulator& Simulator::operator=(const Simulator& other) {
  state_ = std::make_unique<State>(*other.state_);
  return *this;
}
Simulator::Simulator(Simulator&&) noexcept = default;
Simulator& Simulator::operator=(Simulator&&) noexcept = default;
Simulator::~Simulator() = default;

void Simulator::start(const Eigen::Ref<const Eigen::MatrixXd>& past_inputs,
                      const Eigen::Ref<const Eigen::MatrixXd>& past_outputs) {
  const Eigen::Index memory = state_->model.memory();
  require_finite(past_inputs, state_->model.num_inputs(), "the past of the inputs");
  require_finite(past_outputs, state_->model.num_outputs(), "the past of the outputs");
  if (past_outputs.rows() == 0 || (past_inputs.rows() == 0 && state_->model.num_inputs() > 0)) {
    throw std::invalid_argument("llmt::Simulator: at least one row of the past is needed");
  }
  // Before the first row that is given the system was at rest there.
  const auto last_rows = [memory](const Eigen::Ref<const Eigen::MatrixXd>& values, Eigen::MatrixXd& rows,
                                  Eigen::Index behind) {  // `behind`: rows that the next step shifts out
    rows.setZero(memory + behind, values.cols());
    if (values.cols() == 0) return;
    for (Eigen::Index row = 0; row < memory; ++row) {
      rows.row(behind + row) = values.row(std::max<Eigen::Index>(0, values.rows() - memory + row));
    }
  };
  Eigen::MatrixXd outputs;
  last_rows(past_inputs, state_->inputs, 1);
  last_rows(past_outputs, outputs, 0);
  state_->outputs = Outputs(outputs);
  state_->x.resize(std::ssize(state_->model.columns()));
  state_->result.resize(state_->model.num_outputs());
}

void Simulator::start_at_rest(const Eigen::VectorXd& inputs, const Eigen::VectorXd& outputs) {
  start(inputs.transpose(), outputs.transpose());
}

const Eigen::VectorXd& Simulator::predict_next(const Eigen::Ref<const Eigen::VectorXd>& inputs) {
  State& s = *state_;
  require_finite(inputs.transpose(), s.model.num_inputs(), "the inputs of a step");
  shift_up(s.inputs);
  s.inputs.bottomRows(1) = inputs.transpose();
  const Eigen::Index now = s.inputs.rows() - 1;
  regressors_of_run(s.model.columns(), s.outputs, now, s.inputs, now, s.x.data());
  if (s.x.allFinite()) {
    s.map.values(s.x.data(), s.result.data());
    add_last(s.model.parts().lags, s.outputs, s.outputs.held.rows(), s.result.data());
  } else {
    s.result.setConstant(std::nan(""));
  }
  s.free = s.result;
  for (Eigen::Index o = 0; o < s.result.size(); ++o) {
    s.result(o) = held_at_stops(s.model.parts().outputs[o], s.result(o));
  }
  return s.result;
}

void Simulator::remember(const Eigen::Ref<const Eigen::VectorXd>& held, const Eigen::Ref<const Eigen::VectorXd>& free) {
  if (state_->outputs.held.rows() == 0) return;
  shift_up(state_->outputs.held);
  shift_up(state_->outputs.free);
  state_->outputs.held.bottomRows(1) = held.transpose();
  state_->outputs.free.bottomRows(1) = free.transpose();
}

const Eigen::VectorXd& Simulator::step(const Eigen::Ref<const Eigen::VectorXd>& inputs) {
  predict_next(inputs);
  remember(state_->result, state_->free);
  return state_->result;
}

const Eigen::VectorXd& Simulator::step(const Eigen::Ref<const Eigen::VectorXd>& inputs,
                                       const Eigen::Ref<const Eigen::VectorXd>& measured) {
  require_finite(measured.transpose(), state_->model.num_outputs(), "the measured outputs");
  predict_next(inputs);
  remember(measured, measured);
  return state_->result;
}

const Eigen::VectorXd& Simulator::regressors() const { return state_->x; }

Run simulate(const DynamicModel& model, const Eigen::Ref<const Eigen::MatrixXd>& inputs,
             const Eigen::Ref<const Eigen::MatrixXd>& initial_outputs) {
  const Eigen::Index given = initial_outputs.rows();
  if (given > inputs.rows()) {
    throw std::invalid_argument(
        fmt::format("llmt::simulate: {} rows of initial outputs, {} of inputs", given, inputs.rows()));
  }
  require_finite(inputs, model.num_inputs(), "inputs");
  Simulator simulator(model);
  Run run;
  run.outputs.resize(inputs.rows(), model.num_outputs());
  run.outputs.topRows(given) = initial_outputs;
  run.first = given;
  simulator.start(inputs.topRows(given), initial_outputs);
  const Polynomial& polynomial = model.parts().polynomial;
  const Eigen::VectorXd& x = simulator.regressors();
  for (Eigen::Index row = given; row < inputs.rows(); ++row) {
    const Eigen::VectorXd& y = simulator.step(inputs.row(row).transpose());
    run.outputs.row(row) = y.transpose();
    if (run.outside_at < 0 && ((x.array() < polynomial.low.array()) || (x.array() > polynomial.high.array())).any()) {
      run.outside_at = row;
    }
    bool within = true;
    for (Eigen::Index o = 0; o < y.size(); ++o) within = within && y(o) >= model.lower(o) && y(o) <= model.upper(o);
    if (within) continue;
    run.left_at = row;
    run.outputs.bottomRows(inputs.rows() - row - 1).setConstant(std::nan(""));
    break;
  }
  return run;
}

}  // namespace llmt
