#include "data/equal_rows.hpp"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <cstdint>
#include <functional>
#include <limits>
#include <map>
#include <numeric>
#include <utility>

#include "base/count.hpp"
#include "base/parallel.hpp"
#include "data/row_hash.hpp"

namespace llmt {
namespace {

// Rows are repeats if at most this part of them has inputs that no other row has. Copies among many other rows come
// with new rows as often as with held-out ones.
constexpr double most_alone = 0.5;

// Rows are repeats if of those that meet in half of the inputs this part meets in the others too, beyond chance.
constexpr double part_that_meets = 0.5;

// Part of the variance of the numbers of equal rows that rows drawn at random would have.
constexpr double part_of_scatter = 0.5;

// Repeats and copies are looked for where there are at least this number of different rows: few rows may be there twice
// by chance, and can hardly be dealt to folds.
constexpr int fewest_different = 10;

constexpr Eigen::Index rows_at_once = 16384;  // rows that are hashed at a time
constexpr int bits_of_part = 4;               // hashes with the same first bits are sorted together

int different(const std::vector<int>& numbers) { return numbers.empty() ? 0 : *std::ranges::max_element(numbers) + 1; }

// Of each number, how many rows have it.
std::vector<int> sizes_of(const std::vector<int>& numbers) {
  std::vector<int> sizes(different(numbers), 0);
  for (const int number : numbers) ++sizes[number];
  return sizes;
}

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

// Every second one of the columns from the place `first` on.
std::vector<int> every_second(const std::vector<int>& columns, std::size_t first) {
  std::vector<int> result;
  for (std::size_t at = first; at < columns.size(); at += 2) result.push_back(columns[at]);
  return result;
}

// Whether the kinds of rows have more even numbers of rows than if rows had been drawn at random from kinds that are
// equally frequent: those numbers have a Poisson distribution, of which the kinds without a row are not seen.
bool are_even(const std::vector<int>& numbers) {
  const std::vector<int> sizes = sizes_of(numbers);
  const double kinds = static_cast<double>(sizes.size());
  const double mean = static_cast<double>(numbers.size()) / kinds;
  double squares = 0.0;
  for (const int size : sizes) squares += (size - mean) * (size - mean);
  // The rate of the Poisson distribution whose mean without zeros is `mean`: the fixed point lies between mean - 1 and
  // mean.
  double rate = mean;
  for (int step = 0; step < 200; ++step) rate = mean * -std::expm1(-rate);
  return squares / (kinds - 1.0) < part_of_scatter * mean * (1.0 + rate - mean);
}

// The rule (C.2): whether rows that agree in some columns are repeats.
bool are_repeats(const Eigen::Ref<const Eigen::MatrixXd>& inputs, const std::vector<Eigen::Index>& rows,
                 const std::vector<int>& columns, const std::vector<int>& numbers) {
  const std::vector<int> sizes = sizes_of(numbers);
  const auto alone = static_cast<double>(std::ranges::count(sizes, 1));
  if (count_of(sizes) < fewest_different || alone > most_alone * static_cast<double>(rows.size())) return false;
  if (are_even(numbers)) return true;
  if (columns.size() < 2) return false;
  // Of the other rows, the parts that agree with a row in a half of the inputs, or in all.
  const auto part = [&](const std::vector<int>& by) {
    return (mean_size(by) - 1.0) / (static_cast<double>(rows.size()) - 1.0);
  };
  const double first = part(number_different_rows(inputs, rows, every_second(columns, 0)));
  const double second = part(number_different_rows(inputs, rows, every_second(columns, 1)));
  const double by_chance = std::max(first, second);
  return part(numbers) / std::min(first, second) - by_chance >= part_that_meets * (1.0 - by_chance);
}

// Whether a column grows from each row to the next, or falls, as a time stamp or a counter does.
bool is_running(const Eigen::Ref<const Eigen::MatrixXd>& inputs, const std::vector<Eigen::Index>& rows, int column) {
  const auto every_step = [&](const auto& compare) {
    for (std::size_t i = 1; i < rows.size(); ++i) {
      if (!compare(inputs(rows[i - 1], column), inputs(rows[i], column))) return false;
    }
    return true;
  };
  return every_step(std::less<>()) || every_step(std::greater<>());
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

std::vector<Eigen::Index> at_places(const std::vector<Eigen::Index>& rows, const std::vector<Eigen::Index>& places) {
  std::vector<Eigen::Index> result;
  for (const Eigen::Index place : places) result.push_back(rows[place]);
  return result;
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
  const std::vector<int> all = all_columns(inputs);
  const auto have_twins = [&](const std::vector<int>& numbers) { return different(numbers) < count_of(rows); };
  RowNumbers numbers;
  for (const int column : all) {
    if (!is_running(inputs, rows, column)) numbers.setting_columns.push_back(column);
  }
  if (!numbers.setting_columns.empty() && numbers.setting_columns.size() < all.size()) {
    numbers.by_setting = number_different_rows(inputs, rows, numbers.setting_columns, max_threads);
  }
  // Rows that differ in some columns differ in all.
  if (!numbers.by_setting.empty() && !have_twins(numbers.by_setting)) return {};
  std::vector<int> by_inputs = number_different_rows(inputs, rows, all, max_threads);
  if (have_twins(by_inputs)) {
    numbers.by_all = pairs_of(by_inputs, number_different_rows(outputs, rows, all_columns(outputs)));
    numbers.by_inputs = std::move(by_inputs);
  }
  return numbers;
}

long times_rows_were_numbered() { return times_numbered; }

RowNumbers at(const RowNumbers& numbers, const std::vector<Eigen::Index>& positions) {
  RowNumbers result{.setting_columns = numbers.setting_columns};
  if (!numbers.by_setting.empty()) result.by_setting = renumbered(numbers.by_setting, positions);
  if (!numbers.by_inputs.empty()) {
    result.by_inputs = renumbered(numbers.by_inputs, positions);
    result.by_all = renumbered(numbers.by_all, positions);
  } else if (std::ranges::adjacent_find(positions) != positions.end()) {
    for (std::size_t i = 0; i < positions.size(); ++i) {
      const bool same = i > 0 && positions[i] == positions[i - 1];
      result.by_inputs.push_back(i == 0 ? 0 : result.by_inputs.back() + (same ? 0 : 1));
    }
    result.by_all = result.by_inputs;
  }
  return result;
}

EqualRows find_equal_rows(const Eigen::Ref<const Eigen::MatrixXd>& inputs, const std::vector<Eigen::Index>& rows,
                          const RowNumbers& numbers) {
  EqualRows result;
  std::vector<int> all_alone(rows.size());
  std::iota(all_alone.begin(), all_alone.end(), 0);
  const std::vector<int>& by_all = numbers.by_all.empty() ? all_alone : numbers.by_all;
  // The table written once.
  const int times = times_written(by_all);
  std::vector<int> copy_of = copies(by_all, times);
  std::vector<Eigen::Index> left;
  for (int i = 0; i < count_of(rows); ++i) {
    if (copy_of[i] == i) left.push_back(i);
  }
  const std::vector<Eigen::Index> rows_left = at_places(rows, left);
  const auto repeat = [&](const std::vector<int>& by, const std::vector<int>& columns) {
    return !by.empty() && are_repeats(inputs, rows_left, columns, renumbered(by, left));
  };
  const bool in_all = repeat(numbers.by_inputs, all_columns(inputs));
  if (in_all || repeat(numbers.by_setting, numbers.setting_columns)) {
    result.are_repeats = true;
    result.group = in_all ? numbers.by_inputs : numbers.by_setting;
    result.copy_of = copies(by_all, std::numeric_limits<int>::max());
  } else if (times > 1 && different(by_all) >= fewest_different) {
    result.group = copy_of;
    result.copy_of = std::move(copy_of);
  }
  return result;
}

}  // namespace llmt
