// Rows that do not count, and why.
#pragma once

#include <string>
#include <vector>

#include "discovery/recording/recording.hpp"
#include "llmt/discovery/missing.hpp"

namespace llmt::discovery {

enum class ApartReason {
  at_limit,      ///< an output stays at its largest or smallest value while the simulation goes on
  at_rest,       ///< an input is within its zero band
  unknown_sign,  ///< the errors of an input may change its sign
  at_reversal    ///< a machine reverses, and nothing explains the deviations
};

/// Rows that are neither searched nor set aside.
struct Apart {
  std::vector<Eigen::Index> rows;
  ApartReason reason;
  std::string sentence;
};

/// What rows are judged by.
struct RowsSeen {
  const Recording& recording;
  const MeasuredOutputs& measured;
  const Eigen::MatrixXd& simulated;  ///< n x d, as it is measured
  const Missing* answer = nullptr;   ///< of the last search, after one
};

enum class ApartWhen {
  before_searches,  ///< at limits, at rest
  before_a_fit,     ///< where the sign of an input is not known
  after_a_search    ///< at reversals
};

/// Goes through all rules of that time.
std::vector<Apart> rows_apart(ApartWhen when, const RowsSeen& seen);

void mark(const std::vector<Apart>& all, std::vector<bool>& rows);

/// Adds their sentences.
void tell(const std::vector<Apart>& all, std::vector<std::string>& notes);

}  // namespace llmt::discovery
