#include "discovery/terms/reversals.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "discovery/terms/motion.hpp"
#include "llmt/discovery/terms.hpp"

namespace llmt::discovery {
namespace {

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

}  // namespace

std::vector<Reversals> left_at_reversals(const Inputs& inputs, const MeasuredOutputs& measured, const Missing& missing,
                                         std::vector<bool>& apart) {
  const Rows rows = rows_of(inputs, Eigen::VectorXd::Zero(inputs.values.rows()));
  constexpr Eigen::Index lags = 2;
  const Derivatives derivatives(rows, lags * smooth_lag(rows, inputs.values));
  const std::vector<Eigen::Index> used = used_rows(missing);
  const Eigen::MatrixXd left = measured.values - missing.corrected;
  const bool is_confirmed = std::ranges::all_of(missing.found, &FoundTerm::confirmed);
  std::vector<Reversals> found;
  for (const Motion& motion : motions(derivatives, inputs)) {
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
    Reversals own{inputs.names[motion.speed], limit, (size.array() < limit).count(), ratio};
    for (Eigen::Index i = 0; i < size.size(); ++i) apart[i] = apart[i] || size(i) < limit;
    found.push_back(std::move(own));
  }
  return found;
}

std::vector<std::string> notes_on_reversals(const std::vector<Reversals>& reversals) {
  std::vector<std::string> notes;
  for (const Reversals& own : reversals) {
    notes.push_back(fmt::format(
        "at reversals of {0}, where |{0}| < {1:.3g}, the root mean square of the deviations is {2:.2g} times that at "
        "the faster half of the rows, and no term explains this: a filter has rounded dry friction, or the machine "
        "sticks. These {3} rows were set apart. The answer is about the other rows",
        own.speed, own.limit, own.ratio, own.rows));
  }
  return notes;
}

}  // namespace llmt::discovery
