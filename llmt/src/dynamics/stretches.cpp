#include "dynamics/stretches.hpp"

#include <algorithm>

namespace llmt {
namespace {

Eigen::Index rows_of(const std::vector<Stretch>& stretches) {
  Eigen::Index rows = 0;
  for (const Stretch& stretch : stretches) rows += stretch.rows();
  return rows;
}

// The rows from `begin` to `end` of those of the stretches, counted one behind the other.
std::vector<Stretch> part(const std::vector<Stretch>& stretches, Eigen::Index begin, Eigen::Index end) {
  std::vector<Stretch> result;
  Eigen::Index before = 0;
  for (const Stretch& stretch : stretches) {
    const Eigen::Index first = std::max<Eigen::Index>(begin - before, 0);
    const Eigen::Index last = std::min(end - before, stretch.rows());
    if (first < last) result.push_back({stretch.begin + first, stretch.begin + last});
    before += stretch.rows();
  }
  return result;
}

void append(std::vector<Stretch>& to, const std::vector<Stretch>& from) {
  to.insert(to.end(), from.begin(), from.end());
}

}  // namespace

std::vector<StretchFold> cut(const std::vector<Stretch>& stretches, Eigen::Index count) {
  const Eigen::Index rows = rows_of(stretches);
  std::vector<StretchFold> folds;
  for (Eigen::Index k = 0; k < count; ++k) {
    StretchFold fold;
    fold.held_out = part(stretches, rows * k / count, rows * (k + 1) / count);
    fold.train = part(stretches, 0, rows * k / count);
    append(fold.train, part(stretches, rows * (k + 1) / count, rows));
    folds.push_back(std::move(fold));
  }
  return folds;
}

StretchFold every_third(const std::vector<Stretch>& stretches, Eigen::Index count, Eigen::Index first) {
  const Eigen::Index rows = rows_of(stretches);
  StretchFold fold;
  for (Eigen::Index k = 0; k < count; ++k) {
    append(k % 3 == first ? fold.held_out : fold.train, part(stretches, rows * k / count, rows * (k + 1) / count));
  }
  return fold;
}

std::vector<Stretch> thinned(const std::vector<Stretch>& stretches, Eigen::Index rows, Eigen::Index count) {
  const Eigen::Index all = rows_of(stretches);
  if (all <= rows) return stretches;
  std::vector<Stretch> result;
  for (Eigen::Index k = 0; k < count; ++k) {
    const Eigen::Index begin = (all - rows / count) * k / (count - 1);
    append(result, part(stretches, begin, begin + rows / count));
  }
  return result;
}

bool stands_at(const Series& series, const std::vector<Stretch>& stretches, Eigen::Index output, double value) {
  constexpr Eigen::Index fewest_rows = 5;
  constexpr Eigen::Index fewest_times = 2;
  Eigen::Index times = 0;
  Eigen::Index standing = 0;
  for (const Stretch& stretch : stretches) {
    Eigen::Index run = 0;
    for (Eigen::Index row = stretch.begin; row <= stretch.end; ++row) {
      if (row < stretch.end && series.outputs(row, output) == value) {
        ++run;
        continue;
      }
      if (run >= fewest_rows) {
        ++times;
        standing += run;
      }
      run = 0;
    }
  }
  return times >= fewest_times && 100 * standing >= rows_of(stretches);
}

}  // namespace llmt
