/// \file
/// The log of a machine: its positions and torques over time.
#pragma once

#include <Eigen/Core>
#include <stdexcept>
#include <string>
#include <vector>

#include "llmt/abi.hpp"

namespace llmt::discovery {

/// Signals as they were recorded. There are n rows in the order of time.
struct Log {
  Eigen::VectorXd time;             ///< n, in s
  Eigen::MatrixXd positions;        ///< n x p: signals that are filtered and differentiated
  Eigen::MatrixXd torques;          ///< n x k: signals that are filtered and not differentiated; k may be 0
  std::vector<std::string> runs{};  ///< n: the run of each row, whose rows stand together; empty: one run
};

/// Thrown for a log that cannot be used.
class LogError : public std::invalid_argument {
 public:
  LogError(const std::string& message, Eigen::Index row) : std::invalid_argument(message), row_(row) {}

  Eigen::Index row() const { return row_; }  ///< of the log; -1: no row in particular

 private:
  Eigen::Index row_;
};

}  // namespace llmt::discovery
