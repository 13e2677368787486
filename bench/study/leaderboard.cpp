#include "study/leaderboard.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <numeric>
#include <set>
#include <utility>

#include "llmt/csv.hpp"

namespace bench {
namespace {

constexpr double none = std::numeric_limits<double>::quiet_NaN();

const Score* find(const ScoredTable& table, const std::string& method) {
  for (const Scores* scores : {&table.ours, &table.published}) {
    if (const auto found = scores->find(method); found != scores->end()) return &found->second;
  }
  return nullptr;
}

// Rank by a value of which the smallest is the best one.
template <class Value>
double rank(const ScoredTable& table, const std::string& method, const std::string& ours, const Value& value) {
  const double own = value(*find(table, method));
  double result = 1.0;
  const auto compare = [&](const std::string& rival, const Score& score) {
    if (rival == method) return;
    result += value(score) < own ? 1.0 : value(score) == own ? 0.5 : 0.0;
  };
  for (const auto& [rival, score] : table.published) compare(rival, score);
  if (!table.ours.contains(method)) compare(ours, table.ours.at(ours));
  return result;
}

// Mean ranks by R2 on groups of tables, and median ranks on all of them.
struct Line {
  std::string method;
  double all = none;
  double friedman = none;
  double others = none;
  double median_r2 = none;
  double median_size = none;
  std::size_t tables = 0;
};

Line line_of(const std::vector<ScoredTable>& tables, const std::string& method, const std::string& ours) {
  std::vector<double> all, friedman, others, sizes;
  for (const ScoredTable& table : tables) {
    if (find(table, method) == nullptr) continue;
    all.push_back(rank_by_r2(table, method, ours));
    (is_friedman(table.name) ? friedman : others).push_back(all.back());
    sizes.push_back(rank_by_size(table, method, ours));
  }
  return {method, mean(all), mean(friedman), mean(others), median(all), median(sizes), all.size()};
}

bool dominates(const Line& a, const Line& b) {
  return a.median_r2 <= b.median_r2 && a.median_size <= b.median_size &&
         (a.median_r2 < b.median_r2 || a.median_size < b.median_size);
}

// A number, or nothing if there is none.
std::string cell(double value, int digits) { return std::isnan(value) ? "" : fmt::format("{:.{}f}", value, digits); }

void print_mean_r2(const std::string& group, const std::vector<ScoredTable>& tables,
                   const std::vector<std::string>& methods) {
  fmt::print("{:34} {:6}", group, tables.size());
  for (const std::string& method : methods) {
    std::vector<double> values;
    for (const ScoredTable& table : tables) {
      if (const Score* score = find(table, method)) values.push_back(score->r2);
    }
    fmt::print(" {:>14}", cell(mean(values), 4));
  }
  fmt::print("\n");
}

}  // namespace

bool is_friedman(const std::string& table) { return table.find("_fri_c") != std::string::npos; }

std::map<std::string, Scores> read_published(const std::string& file) {
  const llmt::Csv csv = llmt::Csv::read(file);
  const std::vector<std::string> tables = csv.texts("dataset");
  const std::vector<std::string> methods = csv.texts("method");
  const std::vector<std::string> columns = {"median_r2", "median_model_size"};
  const Eigen::MatrixXd numbers = csv.numbers_or_missing(columns);
  std::map<std::string, Scores> result;
  for (std::size_t row = 0; row < tables.size(); ++row) {
    const Score score{numbers(static_cast<Eigen::Index>(row), 0), numbers(static_cast<Eigen::Index>(row), 1)};
    if (!std::isnan(score.r2) && !std::isnan(score.size)) result[tables[row]][methods[row]] = score;
  }
  return result;
}

double rank_by_r2(const ScoredTable& table, const std::string& method, const std::string& ours) {
  return rank(table, method, ours, [](const Score& score) { return -score.r2; });
}

double rank_by_size(const ScoredTable& table, const std::string& method, const std::string& ours) {
  return rank(table, method, ours, [](const Score& score) { return score.size; });
}

double mean(const std::vector<double>& values) {
  if (values.empty()) return none;
  return std::accumulate(values.begin(), values.end(), 0.0) / static_cast<double>(values.size());
}

double median(std::vector<double> values) {
  if (values.empty()) return none;
  std::ranges::sort(values);
  return 0.5 * (values[(values.size() - 1) / 2] + values[values.size() / 2]);
}

void print_means(const std::vector<ScoredTable>& tables) {
  std::map<std::pair<Eigen::Index, Eigen::Index>, std::vector<ScoredTable>> friedman;
  std::vector<ScoredTable> others;
  for (const ScoredTable& table : tables) {
    (is_friedman(table.name) ? friedman[{table.inputs, table.rows}] : others).push_back(table);
  }
  std::vector<std::string> methods;
  for (const auto& [method, score] : tables.front().ours) methods.push_back(method);
  methods.insert(methods.end(), {"Operon", "XGB", "LGBM"});
  fmt::print("\n{:34} {:>6}", "mean R2", "tables");
  for (const std::string& method : methods) fmt::print(" {:>14}", method);
  fmt::print("\n");
  print_mean_r2("all", tables, methods);
  print_mean_r2("not Friedman's", others, methods);
  for (const auto& [shape, group] : friedman) {
    print_mean_r2(fmt::format("Friedman's, {} inputs, {} rows", shape.first, shape.second), group, methods);
  }
}

void print_ranks(const std::vector<ScoredTable>& tables, const std::string& ours) {
  std::set<std::string> methods;
  for (const ScoredTable& table : tables) {
    for (const Scores* scores : {&table.ours, &table.published}) {
      for (const auto& [method, score] : *scores) methods.insert(method);
    }
  }
  std::vector<Line> lines;
  for (const std::string& method : methods) lines.push_back(line_of(tables, method, ours));
  std::ranges::stable_sort(lines, {}, &Line::all);
  fmt::print("\n{:16} {:>6} | {:>26} | {:>13}\n", "", "", "mean rank by R2", "median rank");
  fmt::print("{:16} {:>6} | {:>8} {:>8} {:>8} | {:>6} {:>6}\n", "method", "tables", "all", "Friedman", "others", "R2",
             "size");
  for (const Line& line : lines) {
    const bool front = std::ranges::none_of(lines, [&](const Line& rival) { return dominates(rival, line); });
    fmt::print("{:16} {:6} | {:>8} {:>8} {:>8} | {:>6} {:>6}{}\n", line.method, line.tables, cell(line.all, 2),
               cell(line.friedman, 2), cell(line.others, 2), cell(line.median_r2, 2), cell(line.median_size, 2),
               front ? " Pareto" : "");
  }
}

}  // namespace bench
