/// \file
/// A command of the user's as a simulation.
#pragma once

#include <string>
#include <vector>

#include "llmt/discovery/simulation.hpp"
#include "trees/compared_tables.hpp"

namespace llmt::apps {

/// One run of the command for each evaluation. It gets a CSV table on standard input: a header, and a row for each row
/// of the inputs with the inputs, then the values of all parameters, then the labels. It writes a CSV table with a
/// header to standard output, that has the columns `outputs` and as many rows, in the same order. Numbers have a
/// decimal point.
struct CommandSimulation {
  std::string command;
  double seconds = 60.0;  ///< longest time of a run
  std::vector<discovery::Parameter> parameters;
  std::vector<std::string> inputs;
  std::vector<std::string> outputs;
  std::vector<LabelColumn> labels = {};  ///< times and runs of the rows

  /// Nominal values of the parameters.
  Eigen::VectorXd nominal() const;

  /// n x d. Throws std::runtime_error that names the command, the values, and what went wrong: an exit code, a signal,
  /// the time, the line of the output that cannot be read, the number of rows.
  Eigen::MatrixXd run(const Eigen::MatrixXd& inputs, const Eigen::VectorXd& values) const;
};

}  // namespace llmt::apps
