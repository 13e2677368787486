#include "data/equal_rows.hpp"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <cstdint>
#include <limits>
#include <map>
#include <numeric>
#include <utility>

#include "base/count.hpp"
#include "base/parallel.hpp"
#include "data/row_hash.hpp"

namespace llmt {
namespace {

// Rows that meet others with equal inputs are of one measurement if they are at most this many on average. More of them
// are cells of a table of few values.
constexpr double most_repeats = 10.0;

// Rows with equal inputs are repeats only if there are at least 1 + this of them on average. If there are fewer, new
// rows will have an equal one as often as held-out rows do.
constexpr double fewest_repeats = 0.2;

// Part of the rows that meet in half of the inputs and in all of them.
constexpr double part_that_meets = 0.5;

// Repeats and copies are looked for where there are at least this number of different rows: few rows may be there twice
// by chance, and can hardly be dealt to folds.
constexpr int fewest_different = 10;

constexpr Eigen::Index rows_at_once = 16384;  // rows that are hashed at a time
constexpr int bits_of_part = 4;               // hashes with the same first bits are sorted together

std::vector<int> sizes_of(const std::vector<int>& numbers) {
  std::vector<int> sizes(numbers.size(), 0);
  for (const int number : numbers) ++sizes[number];
  return sizes;
}

int different(const std::vector<int>& numbers) { return *std::ranges::max_element(numbers) + 1; }

// Mean, over the rows, of the number of rows that are the same.
double mean_size(const std::vector<int>& numbers) {
  double squares = 0.0;
  for (const int size : sizes_of(numbers)) squares += static_cast<double>(size) * size;
  return squares / static_cast<double>(numbers.size());
}

// Numbers the different pairs of two numbers, in order of first appearance.
std::vector<int> pairs_of(const std::vector<int>& a, const std::vector<int>& b) {
  std::map<std::pair<int, int>, int> seen;
  std::vector<int> numbers;
  for (std::size_t i = 0; i < a.size(); ++i) {
    numbers.push_back(seen.try_emplace({a[i], b[i]}, count_of(seen)).first->second);
  }
  return numbers;
}

std::vector<int> all_columns(const Eigen::Ref<const Eigen::MatrixXd>& table) {
  std::vector<int> columns(table.cols());
  std::iota(columns.begin(), columns.end(), 0);
  return columns;
}

// Every second column from `first` on.
std::vector<int> every_second(int first, Eigen::Index columns) {
  std::vector<int> result;
  for (int j = first; j < columns; j += 2) result.push_back(j);
  return result;
}

// The rule (C.2).
bool are_repeats(const Eigen::Ref<const Eigen::MatrixXd>& inputs, const std::vector<Eigen::Index>& rows,
                 const std::vector<int>& by_inputs) {
  const double size = mean_size(by_inputs);
  if (size < 1.0 + fewest_repeats || size > most_repeats) return false;
  if (inputs.cols() == 1) return true;
  const auto size_by = [&](int first) {
    return mean_size(number_different_rows(inputs, rows, every_second(first, inputs.cols())));
  };
  return size - 1.0 >= part_that_meets * (std::min(size_by(0), size_by(1)) - 1.0);
}

// The number of times that a table was written one after the other: the greatest common divisor of the numbers of equal
// rows.
int times_written(const std::vector<int>& by_all) {
  int times = 0;
  for (const int size : sizes_of(by_all)) times = std::gcd(times, size);
  return times;
}

// For each row the row that it copies, or itself. Of equal rows every `times`-th one stays, at least one.
std::vector<int> copies(const std::vector<int>& by_all, int times) {
  const std::vector<int> sizes = sizes_of(by_all);
  std::vector<std::vector<int>> left(by_all.size());
  std::vector<int> seen(by_all.size(), 0);
  std::vector<int> copy_of(by_all.size());
  for (int i = 0; i < count_of(by_all); ++i) {
    const int number = by_all[i];
    const int stay = std::max(1, sizes[number] / times);
    if (count_of(left[number]) < stay) left[number].push_back(i);
    copy_of[i] = left[number][seen[number]++ % stay];
  }
  return copy_of;
}

// The numbers at some positions, in order of first appearance there.
std::vector<int> renumbered(const std::vector<int>& numbers, const std::vector<Eigen::Index>& positions) {
  std::vector<int> seen(numbers.size(), -1);
  std::vector<int> result;
  int different = 0;
  for (const Eigen::Index position : positions) {
    int& number = seen[numbers[position]];
    if (number < 0) number = different++;
    result.push_back(number);
  }
  return result;
}

std::atomic<long> times_numbered = 0;

}  // namespace

std::vector<int> number_different_rows(const Eigen::Ref<const Eigen::MatrixXd>& table,
                                       const std::vector<Eigen::Index>& rows, const std::vector<int>& columns,
                                       int max_threads) {
  std::vector<std::uint64_t> hashes(rows.size(), 0);
  parallel_for((std::ssize(rows) + rows_at_once - 1) / rows_at_once, max_threads, [&](Eigen::Index part) {
    const Eigen::Index end = std::min(std::ssize(rows), (part + 1) * rows_at_once);
    for (const int j : columns) {
      for (Eigen::Index i = part * rows_at_once; i < end; ++i) {
        hashes[i] = row_hash(hashes[i], table(rows[i], j));
      }
    }
  });
  using Entry = std::pair<std::uint64_t, int>;  // hash and row
  std::vector<std::vector<Entry>> parts(std::size_t{1} << bits_of_part);
  for (int i = 0; i < count_of(rows); ++i) parts[hashes[i] >> (64 - bits_of_part)].emplace_back(hashes[i], i);
  const auto compare = [&](int a, int b) -> int {
    for (const int j : columns) {
      const double of_a = table(rows[a], j);
      const double of_b = table(rows[b], j);
      if (of_a < of_b || (!std::isnan(of_a) && std::isnan(of_b))) return -1;
      if (of_b < of_a || (std::isnan(of_a) && !std::isnan(of_b))) return 1;
    }
    return 0;
  };
  std::vector<int> first(rows.size());  // row that is the same
  parallel_for(std::ssize(parts), max_threads, [&](Eigen::Index part) {
    std::vector<Entry>& order = parts[part];
    std::ranges::sort(order);
    for (auto begin = order.begin(); begin != order.end();) {
      const auto end = std::find_if(begin, order.end(), [&](const Entry& each) { return each.first != begin->first; });
      // Rows of one hash are ordered by their values, so that rows made to collide cost no more than others.
      std::sort(begin, end, [&](const Entry& a, const Entry& b) {
        const int difference = compare(a.second, b.second);
        return difference != 0 ? difference < 0 : a.second < b.second;
      });
      for (auto at = begin; at != end; ++at) {
        const bool same = at != begin && compare(std::prev(at)->second, at->second) == 0;
        first[at->second] = same ? first[std::prev(at)->second] : at->second;
      }
      begin = end;
    }
  });
  int different = 0;
  std::vector<int> numbers(rows.size());
  for (int i = 0; i < count_of(rows); ++i) numbers[i] = first[i] == i ? different++ : numbers[first[i]];
  return numbers;
}

RowNumbers number_rows(const Eigen::Ref<const Eigen::MatrixXd>& inputs,
                       const Eigen::Ref<const Eigen::MatrixXd>& outputs, const std::vector<Eigen::Index>& rows,
                       int max_threads) {
  ++times_numbered;
  RowNumbers numbers;
  std::vector<int> by_inputs = number_different_rows(inputs, rows, all_columns(inputs), max_threads);
  if (different(by_inputs) == count_of(rows)) return numbers;
  numbers.by_all = pairs_of(by_inputs, number_different_rows(outputs, rows, all_columns(outputs)));
  numbers.by_inputs = std::move(by_inputs);
  return numbers;
}

long times_rows_were_numbered() { return times_numbered; }

RowNumbers at(const RowNumbers& numbers, const std::vector<Eigen::Index>& positions) {
  if (numbers.by_inputs.empty()) {
    if (std::ranges::adjacent_find(positions) == positions.end()) return {};
    std::vector<int> own;
    for (std::size_t i = 0; i < positions.size(); ++i) {
      own.push_back(i == 0 ? 0 : own.back() + (positions[i] != positions[i - 1] ? 1 : 0));
    }
    return {own, own};
  }
  return {renumbered(numbers.by_inputs, positions), renumbered(numbers.by_all, positions)};
}

EqualRows find_equal_rows(const Eigen::Ref<const Eigen::MatrixXd>& inputs, const std::vector<Eigen::Index>& rows,
                          const RowNumbers& numbers) {
  if (numbers.by_inputs.empty()) return {};
  const int cells = different(numbers.by_inputs);
  if (cells == count_of(rows) || cells < fewest_different) return {};
  const int times = times_written(numbers.by_all);
  std::vector<int> copy_of = copies(numbers.by_all, times);
  std::vector<Eigen::Index> left;  // rows of the table written once
  std::vector<int> left_by_inputs;
  for (int i = 0; i < count_of(rows); ++i) {
    if (copy_of[i] != i) continue;
    left.push_back(rows[i]);
    left_by_inputs.push_back(numbers.by_inputs[i]);
  }
  EqualRows result;
  result.are_repeats = cells < count_of(left) && are_repeats(inputs, left, left_by_inputs);
  if (result.are_repeats) {
    result.copy_of = copies(numbers.by_all, std::numeric_limits<int>::max());
    result.group = numbers.by_inputs;
  } else if (times > 1) {
    result.group = copy_of;
    result.copy_of = std::move(copy_of);
  }
  return result;
}

}  // namespace llmt
