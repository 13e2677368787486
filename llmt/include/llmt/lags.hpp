/// \file
/// Which earlier values a model of a system that moves looks at.
///
///     const llmt::Lags lags = llmt::parse_lags("y:1-3,u:0-4", {"u"}, {"y"});
///     const Eigen::Index memory = llmt::longest_lag(lags);  // 4 rows
#pragma once

#include <Eigen/Core>
#include <string>
#include <string_view>
#include <vector>

#include "llmt/abi.hpp"

namespace llmt {

/// Lags in rows, ascending. Those of outputs are 1 or more, those of inputs 0 or more.
struct Lags {
  std::vector<std::vector<int>> outputs;  ///< one list an output
  std::vector<std::vector<int>> inputs;   ///< one list an input
  /// One an output, or none at all: whether the output adds up its changes, as a position driven by a force does. The
  /// model then gives y(t) - y(t-1), and the value y(t-1) itself is no regressor. Lags of such an output begin at 1.
  std::vector<bool> adds_up = {};

  bool operator==(const Lags&) const = default;
};

/// The largest lag that is accepted.
inline constexpr int most_lag = 10'000;
/// Regressors of a model at most.
inline constexpr Eigen::Index most_lagged_columns = 1000;

/// Reads "y:1-3,u:0-4": names of signals with a lag or a range of lags each; a name may be repeated. "y:+1-3" says that
/// the output adds up its changes. Throws std::invalid_argument that names the part that cannot be read, a signal that
/// is not there, or a lag out of range.
Lags parse_lags(std::string_view text, const std::vector<std::string>& inputs, const std::vector<std::string>& outputs);

/// Reads dead times "u:3,v:0" in rows, one an input; `otherwise` for inputs that are not named. Throws
/// std::invalid_argument that names the part that cannot be read, or an input that is not there or named twice.
std::vector<int> parse_delays(std::string_view text, const std::vector<std::string>& inputs, int otherwise);

/// The lags of inputs that count from a dead time on, one an input.
Lags delayed(Lags lags, const std::vector<int>& delays);

/// The text that parse_lags() reads.
std::string text_of(const Lags& lags, const std::vector<std::string>& inputs, const std::vector<std::string>& outputs);

/// Whether an output adds up its changes.
bool adds_up(const Lags& lags, Eigen::Index output);

/// Throws std::invalid_argument if lags are not ascending or out of range, or if there are none.
void check_lags(const Lags& lags);

/// The rows before the present one that the model needs.
Eigen::Index longest_lag(const Lags& lags);

/// A regressor of the model: s(t - lag), or s(t - lag) - s(t - minus_lag).
struct LaggedColumn {
  bool is_output = false;
  int signal = 0;  ///< of the outputs or of the inputs
  int lag = 0;
  int minus_lag = -1;  ///< -1: nothing is subtracted
};

/// The regressors. The first one of an output is its value at the smallest lag, the others are its changes from lag to
/// lag: y(t-1), y(t-1)-y(t-2), ... A split on them is one on position or speed, and squares of them are far less alike
/// than those of successive values. An output that adds up has its changes alone. Inputs are taken as they are.
std::vector<LaggedColumn> columns_of(const Lags& lags);

/// Their names: "y(t-1)", "y(t-1)-y(t-2)", "u(t)".
std::vector<std::string> column_names(const std::vector<LaggedColumn>& columns, const std::vector<std::string>& inputs,
                                      const std::vector<std::string>& outputs);

}  // namespace llmt
