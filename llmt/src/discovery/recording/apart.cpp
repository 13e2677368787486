#include "discovery/recording/apart.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <iterator>
#include <map>
#include <utility>

#include "discovery/recording/speeds.hpp"

namespace llmt::discovery {
namespace {

std::vector<Eigen::Index> rows_below(const Eigen::VectorXd& x, double limit) {
  std::vector<Eigen::Index> rows;
  for (Eigen::Index i = 0; i < x.size(); ++i) {
    if (std::abs(x(i)) < limit) rows.push_back(i);
  }
  return rows;
}

// `sign` 1: the largest value; -1: the smallest.
Apart at_end(const std::string& output, const Eigen::VectorXd& measured, const Eigen::VectorXd& simulated,
             double sign) {
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
  Apart limit{{}, ApartReason::at_limit, {}};
  double farthest = sign * end;  // of the simulation
  for (Eigen::Index i = 0; i < measured.size(); ++i) {
    if (!is_there(i)) continue;
    limit.rows.push_back(i);
    if (sign * simulated(i) > sign * farthest) farthest = simulated(i);
  }
  limit.sentence = fmt::format(
      "{} is exactly {:.6g}, its {} value, at {} rows, where the simulation goes on to {:.4g}: a sensor or an "
      "actuator is at its limit there. These rows were set apart. The answer is about the other rows",
      output, sign * end, sign > 0.0 ? "largest" : "smallest", limit.rows.size(), farthest);
  return limit;
}

// Outputs of at least 20 different values. An end of the measured values is a limit if
//
// - at least 5 rows and 0.2 % of all have this value exactly, and 5 times as many as have the value next to it (a
//   signal in steps of its resolution also dwells at its ends, but not so);
// - the simulation is beyond the value at three quarters of these rows: an error would be on both sides;
// - the value is not 0, where a machine may just stand.
std::vector<Apart> at_limits(const RowsSeen& seen) {
  std::vector<Apart> all;
  const Eigen::MatrixXd& measured = seen.measured.values;
  // What has the wrong shape is refused by the search.
  if (seen.simulated.rows() != measured.rows() || seen.simulated.cols() != measured.cols()) return all;
  for (Eigen::Index o = 0; o < measured.cols(); ++o) {
    for (const double sign : {1.0, -1.0}) {
      Apart limit = at_end(seen.measured.names[o], measured.col(o), seen.simulated.col(o), sign);
      if (!limit.rows.empty()) all.push_back(std::move(limit));
    }
  }
  return all;
}

// Rows at which an input is within its zero band.
std::vector<Apart> at_rest(const RowsSeen& seen) {
  std::vector<Apart> all;
  const Inputs& inputs = seen.recording.inputs();
  const Eigen::VectorXd of_errors = bands_of_errors(inputs);
  for (Eigen::Index j = 0; j < inputs.zero_bands.size(); ++j) {
    const double band = inputs.zero_bands(j);
    if (!(band > 0.0)) continue;
    std::vector<Eigen::Index> rows = rows_below(inputs.values.col(j), band);
    std::string sentence = fmt::format(
        "{0} rests at {1} rows, with |{0}| < {2:.3g}. They were set apart, because dry friction at rest may be "
        "anything up to that of motion. The terms found take {0} for 0 where |{0}| < {3:.3g}",
        inputs.names[j], rows.size(), band, of_errors(j));
    all.push_back({std::move(rows), ApartReason::at_rest, std::move(sentence)});
  }
  return all;
}

// Squares of the fourth differences that are centred at each row; negative where there is none.
Eigen::VectorXd roughness(const Rows& rows, const Eigen::VectorXd& values) {
  const std::vector<Recorded> recorded = recordings(rows);
  const auto n = std::ssize(rows.sequence);
  Eigen::VectorXd squares = Eigen::VectorXd::Constant(n, -1.0);
  for (Eigen::Index k = 2; k + 2 < n; ++k) {
    if (recorded[k - 2].begin != recorded[k + 2].begin) continue;
    const auto at = [&](Eigen::Index i) { return values(rows.sequence[k + i]); };
    const double difference = at(-2) - 4.0 * at(-1) + 6.0 * at(0) - 4.0 * at(1) + at(2);
    squares(rows.sequence[k]) = difference * difference;
  }
  return squares;
}

// Inputs that change sign, with known errors: the limit is 3 standard deviations of the error. A row is rough as its
// deviation differs from what its neighbours in time say: fourth differences. Rows are set apart where those below the
// limit are clearly rougher than the others (mean square 2.5 times as large), because the simulation or the machine
// jumps with the sign.
std::vector<Apart> of_unknown_sign(const RowsSeen& seen) {
  if (!seen.recording.is_in_time() || seen.recording.is_filtered()) return {};
  const Inputs& inputs = seen.recording.inputs();
  const Eigen::MatrixXd& covariance = seen.recording.covariance();
  const Eigen::MatrixXd deviations = seen.measured.values - seen.simulated;
  constexpr double rougher = 2.5;
  constexpr double fewest = 8.0;
  constexpr double largest_share = 0.3;
  std::vector<Apart> found;
  std::vector<bool> apart(inputs.values.rows(), false);
  for (Eigen::Index j = 0; j < inputs.values.cols(); ++j) {
    const Eigen::VectorXd x = inputs.values.col(j);
    const double limit = hides_the_sign * std::sqrt(covariance(j, j));
    if (!(limit > 0.0) || x.minCoeff() >= 0.0 || x.maxCoeff() <= 0.0) continue;
    const std::vector<Eigen::Index> slow = rows_below(x, limit);
    double roughest = 0.0;  // mean square, in units of that of the other rows
    if (static_cast<double>(slow.size()) > largest_share * static_cast<double>(x.size())) continue;
    for (Eigen::Index o = 0; o < deviations.cols(); ++o) {
      const Eigen::VectorXd squares = roughness(seen.recording.rows(), deviations.col(o));
      double below = 0.0;
      double count = 0.0;
      std::vector<double> above;
      for (Eigen::Index i = 0; i < x.size(); ++i) {
        if (squares(i) < 0.0 || apart[i]) continue;
        if (std::abs(x(i)) < limit) {
          below += squares(i);
          count += 1.0;
        } else {
          above.push_back(squares(i));
        }
      }
      if (count < fewest || static_cast<double>(above.size()) < fewest) continue;
      double sum = 0.0;
      for (const double value : above) sum += value;
      const double mean = sum / static_cast<double>(above.size());
      if (mean > 0.0) roughest = std::max(roughest, below / count / mean);
    }
    if (roughest < rougher) continue;
    for (const Eigen::Index row : slow) apart[row] = true;
    found.push_back({slow, ApartReason::unknown_sign,
                     fmt::format("{} rows with |{}| < {:.3g} were set apart: the sign of {} is not known there, and "
                                 "values scatter {:.1f} times as much as elsewhere",
                                 slow.size(), inputs.names[j], limit, inputs.names[j], std::sqrt(roughest))});
  }
  return found;
}

std::vector<Eigen::Index> used_rows(const Missing& missing) {
  std::vector<Eigen::Index> rows = missing.searched;
  rows.insert(rows.end(), missing.held_out.begin(), missing.held_out.end());
  std::erase_if(rows,
                [&](Eigen::Index row) { return std::ranges::find(missing.outliers, row) != missing.outliers.end(); });
  return rows;
}

// Of squares in the order of speed, with those before terms were found: the number of the slowest that are clearly
// larger than those of the faster half, and that confirmed terms do not explain.
Eigen::Index slow_and_large(const Eigen::VectorXd& squares, const Eigen::VectorXd& before, bool is_confirmed) {
  constexpr Eigen::Index bins = 40;
  constexpr Eigen::Index fewest_of_a_bin = 10;
  constexpr double larger = 2.0;
  constexpr double clearly_larger = 3.0;
  constexpr double widest = 0.3;
  constexpr double unexplained = 0.15;  // of the gap
  constexpr double far = 4.0;           // the square of two standard deviations
  constexpr double share_of_far = 0.15;
  constexpr double fewest_far = 4.0;
  const Eigen::Index n = squares.size();
  const Eigen::Index length = std::max(fewest_of_a_bin, n / bins);
  const double fast = squares.tail(n / 2).mean();
  const auto most = static_cast<Eigen::Index>(widest * static_cast<double>(n));
  Eigen::Index slow = 0;
  while (slow + length <= most && squares.segment(slow, length).mean() >= larger * fast) slow += length;
  if (slow == 0 || squares.head(slow).mean() < clearly_larger * fast) return 0;
  if (is_confirmed && squares.head(slow).sum() < unexplained * before.head(slow).sum()) return 0;
  const auto count = static_cast<double>((squares.head(slow).array() > far * fast).count());
  return count >= std::max(fewest_far, share_of_far * static_cast<double>(slow)) ? slow : 0;
}

// For rows in time. Where a machine reverses, filters round the jump of its friction, it sticks, and the sign of its
// speed is uncertain: deviations there follow no law of the inputs at the same row. The rows that `missing` used, but
// for its outliers, are sorted by |speed| of each motion among the inputs, and looked at in bins of a fortieth. The
// slowest bins are reversals as far as their mean square is at least 2 times that of the faster half; at most 30 % of
// the rows. They are set apart if their mean square is at least 3 times as large, and if at least 15 % of them, and 4,
// are larger than 2 standard deviations of the faster half, unless confirmed terms explain 85 % of the squares there.
std::vector<Apart> at_reversals(const RowsSeen& seen) {
  const Missing& missing = *seen.answer;
  const MeasuredOutputs& measured = seen.measured;
  const Inputs& inputs = seen.recording.inputs();
  const std::vector<Eigen::Index> used = used_rows(missing);
  const Eigen::MatrixXd left = measured.values - missing.corrected;
  const bool is_confirmed = std::ranges::all_of(missing.found, &FoundTerm::confirmed);
  std::vector<Apart> found;
  for (const Motion& motion : seen.recording.axes()) {
    const Eigen::VectorXd size = inputs.values.col(motion.speed).cwiseAbs();
    std::vector<Eigen::Index> order = used;
    std::ranges::stable_sort(order, {}, [&](Eigen::Index row) { return size(row); });
    Eigen::Index slow = 0;
    double ratio = 0.0;
    for (Eigen::Index o = 0; o < left.cols(); ++o) {
      const Eigen::VectorXd squares = left.col(o)(order).array().square();
      const Eigen::VectorXd before = (measured.values - missing.before).col(o)(order).array().square();
      const Eigen::Index own = slow_and_large(squares, before, is_confirmed);
      if (own == 0) continue;
      slow = std::max(slow, own);
      ratio = std::max(ratio, std::sqrt(squares.head(own).mean() / squares.tail(squares.size() / 2).mean()));
    }
    if (slow == 0 || slow == std::ssize(order)) continue;
    const double limit = size(order[slow]);
    std::vector<Eigen::Index> rows = rows_below(size, limit);
    std::string sentence = fmt::format(
        "at reversals of {0}, where |{0}| < {1:.3g}, the root mean square of the deviations is {2:.2g} times that at "
        "the faster half of the rows, and no term explains this: a filter has rounded dry friction, or the machine "
        "sticks. These {3} rows were set apart. The answer is about the other rows",
        inputs.names[motion.speed], limit, ratio, rows.size());
    found.push_back({std::move(rows), ApartReason::at_reversal, std::move(sentence)});
  }
  return found;
}

struct Rule {
  ApartWhen when;
  std::vector<Apart> (*rows)(const RowsSeen&);
};

// In the order in which they are told.
constexpr std::array<Rule, 4> rules = {{{ApartWhen::before_searches, at_limits},
                                        {ApartWhen::before_searches, at_rest},
                                        {ApartWhen::before_a_fit, of_unknown_sign},
                                        {ApartWhen::after_a_search, at_reversals}}};

}  // namespace

std::vector<Apart> rows_apart(ApartWhen when, const RowsSeen& seen) {
  std::vector<Apart> all;
  for (const Rule& rule : rules) {
    if (rule.when == when) std::ranges::move(rule.rows(seen), std::back_inserter(all));
  }
  return all;
}

void mark(const std::vector<Apart>& all, std::vector<bool>& rows) {
  for (const Apart& apart : all) {
    for (const Eigen::Index row : apart.rows) rows[row] = true;
  }
}

void tell(const std::vector<Apart>& all, std::vector<std::string>& notes) {
  for (const Apart& apart : all) notes.push_back(apart.sentence);
}

}  // namespace llmt::discovery
