/// \file
/// A question that the data cannot answer.
#pragma once

#include <stdexcept>

namespace llmt::report {

/// The data do not allow a verdict, neither good nor bad: too few poses, another machine, no accuracy to compare with.
class NotEvaluated : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

}  // namespace llmt::report
