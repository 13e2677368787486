#include "discovery/terms/limits.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <iterator>
#include <map>

namespace llmt::discovery {
namespace {

// `sign` 1: the largest value; -1: the smallest.
AtLimit at_end(const Eigen::VectorXd& measured, const Eigen::VectorXd& simulated, double sign,
               std::vector<bool>& apart) {
  constexpr std::size_t fewest_values = 20;
  constexpr double fewest_rows = 5.0;
  constexpr double fewest_of_all = 0.002;
  constexpr double of_next = 5.0;
  constexpr double beyond = 0.75;
  std::map<double, double> rows_of;  // by value times sign
  for (const double value : measured) ++rows_of[sign * value];
  if (rows_of.size() < fewest_values) return {};
  const auto& [end, count] = *rows_of.rbegin();
  const double next = std::next(rows_of.rbegin())->second;
  const auto n = static_cast<double>(measured.size());
  if (end == 0.0 || count < std::max(fewest_rows, fewest_of_all * n) || count < of_next * next) return {};
  const Eigen::Array<bool, Eigen::Dynamic, 1> is_there = sign * measured.array() == end;
  const double rows_beyond = (is_there && sign * simulated.array() > end).cast<double>().sum();
  if (rows_beyond < beyond * count) return {};
  AtLimit limit{"", sign * end, sign > 0.0, static_cast<Eigen::Index>(count), sign * end};
  for (Eigen::Index i = 0; i < measured.size(); ++i) {
    if (!is_there(i)) continue;
    apart[i] = true;
    if (sign * simulated(i) > sign * limit.simulated) limit.simulated = simulated(i);
  }
  return limit;
}

}  // namespace

std::vector<AtLimit> rows_at_limits(const MeasuredOutputs& measured, const Eigen::MatrixXd& simulated,
                                    std::vector<bool>& apart) {
  std::vector<AtLimit> all;
  // What has the wrong shape is refused by the search.
  if (simulated.rows() != measured.values.rows() || simulated.cols() != measured.values.cols()) return all;
  for (Eigen::Index o = 0; o < measured.values.cols(); ++o) {
    for (const double sign : {1.0, -1.0}) {
      AtLimit limit = at_end(measured.values.col(o), simulated.col(o), sign, apart);
      if (limit.rows == 0) continue;
      limit.output = measured.names[o];
      all.push_back(std::move(limit));
    }
  }
  return all;
}

std::vector<std::string> notes_on_limits(const std::vector<AtLimit>& limits) {
  std::vector<std::string> notes;
  for (const AtLimit& own : limits) {
    notes.push_back(fmt::format(
        "{} is exactly {:.6g}, its {} value, at {} rows, where the simulation goes on to {:.4g}: a sensor or an "
        "actuator is at its limit there. These rows were set apart. The answer is about the other rows",
        own.output, own.limit, own.is_largest ? "largest" : "smallest", own.rows, own.simulated));
  }
  return notes;
}

}  // namespace llmt::discovery
