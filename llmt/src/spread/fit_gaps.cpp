#include "spread/fit_gaps.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numeric>
#include <utility>

#include "llmt/random.hpp"
#include "spread/fit_spread.hpp"

namespace llmt {
namespace {

constexpr Eigen::Index most_rows = 1000;    // from which boxes are grown
constexpr std::size_t most_gaps = 50;       // that are kept
constexpr double share_of_held_out = 0.02;  // that may lie in gaps of the other rows
constexpr std::size_t most_pairs = 40;      // of inputs
constexpr std::size_t most_triples = 10;    // of inputs
constexpr int seeds_of_one = 15;            // from each of which a box is grown, for one input
constexpr int seeds_of_several = 1500;      // of pairs, triples and all inputs together
constexpr int fewest_seeds = 30;
constexpr int most_seeds = 200;

// Each value of a column by the mean of its rank and its place between the ends, both from 0 to 1: of the rank alone an
// empty band has no width, of the place alone few rows far away squeeze all others.
Eigen::VectorXd placed(const Eigen::Ref<const Eigen::VectorXd>& values) {
  std::vector<double> sorted;
  std::ranges::copy_if(values, std::back_inserter(sorted), [](double value) { return !std::isnan(value); });
  std::ranges::sort(sorted);
  const auto count = static_cast<double>(sorted.size());
  const double range = sorted.empty() ? 0.0 : sorted.back() - sorted.front();
  return values.unaryExpr([&](double value) {
    if (std::isnan(value)) return value;
    const auto [below, above] = std::ranges::equal_range(sorted, value);
    const double rank = static_cast<double>((below - sorted.begin()) + (above - sorted.begin())) / (2.0 * count);
    return 0.5 * rank + 0.5 * (value - sorted.front()) / range;
  });
}

// A box of some of the columns: what lies strictly between two rows, or beyond one, in each. -1: no end.
struct Box {
  std::vector<int> columns;
  std::vector<double> seed;  // a place within
  std::vector<double> low;
  std::vector<double> high;
  std::vector<int> row_low;
  std::vector<int> row_high;
  double size = 0.0;  // beyond what chance leaves empty

  bool has_ends() const {
    const auto is_row = [](int row) { return row >= 0; };
    return std::ranges::any_of(row_low, is_row) || std::ranges::any_of(row_high, is_row);
  }
  bool holds(const Eigen::MatrixXd& places, int row) const {
    for (std::size_t k = 0; k < columns.size(); ++k) {
      const double place = places(row, columns[k]);
      if (std::isnan(place)) return false;
      if (row_low[k] >= 0 && place <= low[k]) return false;
      if (row_high[k] >= 0 && place >= high[k]) return false;
    }
    return true;
  }
};

// Rows that lie in a box: their places in its columns, and which they are.
class Within {
 public:
  Within(const Box& box, const Eigen::MatrixXd& places, const std::vector<int>& rows)
      : rows_(rows), places_(places(rows, box.columns)) {
    if (box.has_ends() || places_.hasNaN()) keep([&](std::size_t i) { return box.holds(places, rows_[i]); });
  }

  bool empty() const { return rows_.empty(); }

  // Cuts the box at the row next to the seed: the one that leaves the least part of a way from the seed to an end,
  // where it leaves most.
  void cut(Box& box) {
    const auto count = std::ssize(rows_);
    parts_ = Eigen::ArrayXd::Zero(count);
    for (Eigen::Index k = 0; k < places_.cols(); ++k) {
      const auto [seed, below, above] = scales(box, k);
      const auto offsets = places_.col(k).head(count).array() - seed;
      parts_ = parts_.max(offsets * above).max(offsets * -below);
    }
    Eigen::Index next = 0;
    parts_.minCoeff(&next);
    Eigen::Index side = 0;
    for (Eigen::Index k = 0; k < places_.cols(); ++k) {
      if (part_of(box, next, k) >= parts_(next)) side = k;
    }
    const double place = places_(next, side);
    const auto at = static_cast<std::size_t>(side);
    const bool is_high = place >= box.seed[at];
    (is_high ? box.high : box.low)[at] = place;
    (is_high ? box.row_high : box.row_low)[at] = rows_[static_cast<std::size_t>(next)];
    keep([&](std::size_t i) {
      const double other = places_(static_cast<Eigen::Index>(i), side);
      return is_high ? other < place : other > place;
    });
  }

 private:
  double part_of(const Box& box, Eigen::Index row, Eigen::Index k) const {
    const auto [seed, below, above] = scales(box, k);
    const double offset = places_(row, k) - seed;
    return std::max(offset * above, offset * -below);
  }
  static std::array<double, 3> scales(const Box& box, Eigen::Index k) {
    const auto at = static_cast<std::size_t>(k);
    const double seed = box.seed[at];
    return {seed, 1.0 / std::max(seed - box.low[at], 1e-12), 1.0 / std::max(box.high[at] - seed, 1e-12)};
  }

  template <class Test>
  void keep(const Test& test) {
    std::size_t kept = 0;
    for (std::size_t i = 0; i < rows_.size(); ++i) {
      if (!test(i)) continue;
      rows_[kept] = rows_[i];
      for (Eigen::Index k = 0; k < places_.cols(); ++k) {
        places_(static_cast<Eigen::Index>(kept), k) = places_(static_cast<Eigen::Index>(i), k);
      }
      ++kept;
    }
    rows_.resize(kept);
  }

  std::vector<int> rows_;
  Eigen::MatrixXd places_;  // of the rows that are left, in their order
  Eigen::ArrayXd parts_;
};

// The part of the unit cube that n independent rows would leave empty by chance only with a small probability: a box of
// the volume V is empty with exp(-n V), and each of its f ends is one of n rows, so that n^f boxes were tried.
double size_of(const Box& box, std::size_t rows) {
  double volume = 1.0;
  double ends = 0.0;
  for (std::size_t k = 0; k < box.columns.size(); ++k) {
    volume *= box.high[k] - box.low[k];
    ends += (box.row_low[k] >= 0 ? 1.0 : 0.0) + (box.row_high[k] >= 0 ? 1.0 : 0.0);
  }
  const auto n = static_cast<double>(rows);
  return volume - ends * std::log(n) / n;
}

// Cuts the box until none of the rows lies in it, or its size, which falls with every cut, is `least` or less. `count`:
// the number of rows that the size is for.
void empty_of(Box& box, const Eigen::MatrixXd& places, const std::vector<int>& rows, std::size_t count, double least) {
  Within within(box, places, rows);
  for (box.size = size_of(box, count); !within.empty() && box.size > least; box.size = size_of(box, count)) {
    within.cut(box);
  }
}

void keep_some(std::vector<std::vector<int>>& sets, std::size_t most, Random& random) {
  std::vector<std::vector<int>> kept;
  for (const Eigen::Index k : random.permutation(std::ssize(sets))) {
    if (kept.size() < most) kept.push_back(std::move(sets[static_cast<std::size_t>(k)]));
  }
  sets = std::move(kept);
}

// Boxes that are not yet cut: of single inputs, pairs, triples and all, with seeds.
std::vector<Box> whole_boxes(int inputs, Random& random) {
  std::vector<std::vector<int>> ones;
  std::vector<std::vector<int>> pairs;
  std::vector<std::vector<int>> triples;
  for (int a = 0; a < inputs; ++a) {
    ones.push_back({a});
    for (int b = a + 1; b < inputs; ++b) {
      pairs.push_back({a, b});
      for (int c = b + 1; c < inputs; ++c) triples.push_back({a, b, c});
    }
  }
  keep_some(pairs, most_pairs, random);
  keep_some(triples, most_triples, random);
  std::vector<Box> boxes;
  const auto add = [&](const std::vector<int>& columns, int seeds) {
    for (int s = 0; s < seeds; ++s) {
      Box& box = boxes.emplace_back();
      box.columns = columns;
      for (std::size_t k = 0; k < columns.size(); ++k) box.seed.push_back(random.uniform());
      box.low.assign(columns.size(), 0.0);
      box.high.assign(columns.size(), 1.0);
      box.row_low.assign(columns.size(), -1);
      box.row_high.assign(columns.size(), -1);
    }
  };
  for (const auto& columns : ones) add(columns, seeds_of_one);
  std::vector<std::vector<int>> several = std::move(pairs);
  several.insert(several.end(), triples.begin(), triples.end());
  if (inputs > 3) {
    std::vector<int>& all = several.emplace_back(inputs);
    std::iota(all.begin(), all.end(), 0);
  }
  const int seeds = seeds_of_several / std::max(1, static_cast<int>(several.size()));
  for (const auto& columns : several) add(columns, std::clamp(seeds, fewest_seeds, most_seeds));
  return boxes;
}

// The size that most held-out rows' boxes, grown from the other rows, do not have.
double least_size(const std::vector<Box>& whole, const Eigen::MatrixXd& places, const std::vector<int>& rows) {
  const std::vector<int> part = dealt_parts(std::ssize(rows), parts_of_one_fold);
  std::vector<double> sizes(rows.size(), 0.0);  // of the largest box around each row
  for (int p = 0; p < parts_of_one_fold; ++p) {
    std::vector<int> others;
    for (std::size_t i = 0; i < rows.size(); ++i) {
      if (part[i] != p) others.push_back(rows[i]);
    }
    for (Box box : whole) {
      empty_of(box, places, others, rows.size(), 0.0);
      for (std::size_t i = 0; box.size > 0.0 && i < rows.size(); ++i) {
        if (part[i] == p && box.size > sizes[i] && box.holds(places, rows[i])) sizes[i] = box.size;
      }
    }
  }
  const auto beyond = static_cast<std::ptrdiff_t>(share_of_held_out * static_cast<double>(rows.size() + 1));
  std::ranges::nth_element(sizes, sizes.begin() + beyond, std::greater<>());
  return sizes[static_cast<std::size_t>(beyond)];
}

// The sides that have an end, in the units of the inputs.
Gap gap_of(const Box& box, const Eigen::Ref<const Eigen::MatrixXd>& inputs, const std::vector<int>& columns) {
  Gap gap;
  for (std::size_t k = 0; k < box.columns.size(); ++k) {
    if (box.row_low[k] < 0 && box.row_high[k] < 0) continue;
    const int column = columns[static_cast<std::size_t>(box.columns[k])];
    const auto values = inputs.col(column).array();
    const double low = values.isNaN().select(std::numeric_limits<double>::infinity(), values).minCoeff();
    const double high = values.isNaN().select(-std::numeric_limits<double>::infinity(), values).maxCoeff();
    gap.sides.push_back({.column = column,
                         .low = box.row_low[k] < 0 ? low : inputs(box.row_low[k], column),
                         .high = box.row_high[k] < 0 ? high : inputs(box.row_high[k], column)});
  }
  return gap;
}

// Many rows at the smallest value of a column have places above 0: a box below them lies beyond all values, and no row
// ever falls into it.
bool holds_values(const Gap& gap) {
  return std::ranges::all_of(gap.sides, [](const GapSide& side) { return side.low < side.high; });
}

bool is_within(const Gap& inner, const Gap& outer) {
  return std::ranges::all_of(outer.sides, [&](const GapSide& side) {
    return std::ranges::any_of(inner.sides, [&](const GapSide& other) {
      return other.column == side.column && other.low >= side.low && other.high <= side.high;
    });
  });
}

}  // namespace

std::vector<Gap> fit_gaps(const Eigen::Ref<const Eigen::MatrixXd>& inputs, const std::vector<int>& columns) {
  std::vector<int> varying;
  std::ranges::copy_if(columns, std::back_inserter(varying), [&](int column) {
    const Eigen::VectorXd place = placed(inputs.col(column));
    return !place.array().isNaN().all();  // of one value the place is not known
  });
  if (varying.empty() || inputs.rows() < fewest_rows_of_spread) return {};
  Eigen::MatrixXd places(inputs.rows(), std::ssize(varying));
  for (Eigen::Index k = 0; k < places.cols(); ++k)
    places.col(k) = placed(inputs.col(varying[static_cast<std::size_t>(k)]));
  Random random(1);
  std::vector<int> rows;
  for (const Eigen::Index row : random.permutation(inputs.rows())) rows.push_back(static_cast<int>(row));
  std::vector<int> some(rows.begin(), rows.begin() + std::min(most_rows, inputs.rows()));
  std::vector<Box> boxes = whole_boxes(static_cast<int>(varying.size()), random);
  const double least = least_size(boxes, places, some);
  for (Box& box : boxes) {
    empty_of(box, places, some, some.size(), least);
  }
  std::erase_if(boxes, [&](const Box& box) { return !(box.size > least); });
  std::ranges::stable_sort(boxes, std::greater<>(), &Box::size);
  std::vector<Gap> gaps;
  for (Box& box : boxes) {
    if (gaps.size() == most_gaps) break;
    empty_of(box, places, rows, some.size(), -std::numeric_limits<double>::infinity());
    const Gap gap = gap_of(box, inputs, varying);
    const auto holds_it = [&](const Gap& other) { return is_within(gap, other); };
    if (holds_values(gap) && std::ranges::none_of(gaps, holds_it)) gaps.push_back(gap);
  }
  return gaps;
}

}  // namespace llmt
