/// \file
/// A model of a system that moves, run freely: its own outputs are its past.
///
///     llmt::Simulator simulator(llmt::load_dynamic("drive.json"));
///     simulator.start(inputs.topRows(4), outputs.topRows(4));
///     const Eigen::VectorXd next = simulator.step(inputs.row(4).transpose());
#pragma once

#include <Eigen/Core>
#include <memory>

#include "llmt/abi.hpp"
#include "llmt/dynamic_model.hpp"

namespace llmt {

/// A model with its state. Not for several threads at a time; copies run on their own.
class Simulator {
 public:
  /// At rest at the middle of the training ranges until start() is called.
  explicit Simulator(const DynamicModel& model);

  /// Sets the past: the last DynamicModel::memory() rows of these, the latest last. If there are fewer, the system was
  /// at rest at the first of them. Throws std::invalid_argument if there is none, or if a number of columns or a value
  /// does not fit.
  void start(const Eigen::Ref<const Eigen::MatrixXd>& past_inputs,
             const Eigen::Ref<const Eigen::MatrixXd>& past_outputs);

  /// The system has been at rest there. Throws as start().
  void start_at_rest(const Eigen::VectorXd& inputs, const Eigen::VectorXd& outputs);

  /// The outputs at the time of these inputs; they become the past. Throws std::invalid_argument if a value is not
  /// finite or their number differs.
  const Eigen::VectorXd& step(const Eigen::Ref<const Eigen::VectorXd>& inputs);

  /// As step(), but what was measured becomes the past: prediction of the next row.
  const Eigen::VectorXd& step(const Eigen::Ref<const Eigen::VectorXd>& inputs,
                              const Eigen::Ref<const Eigen::VectorXd>& measured);

  /// The regressors of the last step, see DynamicModel::columns().
  const Eigen::VectorXd& regressors() const;

  Simulator(const Simulator& other);
  Simulator& operator=(const Simulator& other);
  Simulator(Simulator&&) noexcept;
  Simulator& operator=(Simulator&&) noexcept;
  ~Simulator();

 private:
  struct State;
  const Eigen::VectorXd& predict_next(const Eigen::Ref<const Eigen::VectorXd>& inputs);
  void remember(const Eigen::Ref<const Eigen::VectorXd>& held, const Eigen::Ref<const Eigen::VectorXd>& free);

  std::unique_ptr<State> state_;
};

/// A run of a model.
struct Run {
  Eigen::MatrixXd outputs;       ///< rows x outputs; NaN behind `left_at`
  Eigen::Index first = 0;        ///< the first row that was simulated; the rows before it are those given
  Eigen::Index left_at = -1;     ///< row in which an output left the bounds, or was not finite; -1: none did
  Eigen::Index outside_at = -1;  ///< first simulated row with a regressor outside of the training ranges; -1: none
};

/// Runs the model over `inputs` (rows x inputs), from `initial_outputs`, the measured or assumed outputs of the first
/// rows, see Simulator::start(). Throws as Simulator, and if there are more initial outputs than rows.
Run simulate(const DynamicModel& model, const Eigen::Ref<const Eigen::MatrixXd>& inputs,
             const Eigen::Ref<const Eigen::MatrixXd>& initial_outputs);

}  // namespace llmt
