#include "llmt/series.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <set>
#include <stdexcept>

#include "base/checks.hpp"

namespace llmt {
namespace {

constexpr double most_grid_rows = 1e8;

void check_signal_names(const std::vector<std::string>& names, Eigen::Index columns, const char* what,
                        std::set<std::string>& seen) {
  if (std::ssize(names) != columns) {
    throw std::invalid_argument(
        fmt::format("llmt::Series: {} has {} names for {} columns", what, names.size(), columns));
  }
  for (const std::string& name : names) {
    if (!seen.insert(name).second)
      throw std::invalid_argument(fmt::format("llmt::Series: two signals are \"{}\"", name));
  }
}

void check_times(const Eigen::VectorXd& times, const Stretch& record) {
  for (Eigen::Index row = record.begin; row < record.end; ++row) {
    if (!std::isfinite(times(row))) {
      throw std::invalid_argument(fmt::format("row {} has no time", row));
    }
    if (row > record.begin && !(times(row) > times(row - 1))) {
      throw std::invalid_argument(
          fmt::format("the time does not rise in row {}: {} after {}", row, times(row), times(row - 1)));
    }
  }
}

}  // namespace

void check_series(const Series& series) {
  constexpr const char* function = "llmt::Series";
  if (series.outputs.cols() == 0 || series.rows() == 0) {
    throw std::invalid_argument(fmt::format("{}: there are {} outputs and {} rows; one of each is needed", function,
                                            series.outputs.cols(), series.rows()));
  }
  if (series.inputs.cols() > 0 && series.inputs.rows() != series.rows()) {
    throw std::invalid_argument(
        fmt::format("{}: inputs has {} rows, outputs {}", function, series.inputs.rows(), series.rows()));
  }
  check_finite_or_missing(function, "inputs", series.inputs);
  check_finite_or_missing(function, "outputs", series.outputs);
  std::set<std::string> seen;
  check_signal_names(series.input_names, series.inputs.cols(), "inputs", seen);
  check_signal_names(series.output_names, series.outputs.cols(), "outputs", seen);
  Eigen::Index last = -1;
  for (const Eigen::Index begin : series.record_begins) {
    if (begin <= last || begin >= series.rows() || (last < 0 && begin != 0)) {
      throw std::invalid_argument(
          fmt::format("{}: record_begins has {}; they ascend from 0 to below {}", function, begin, series.rows()));
    }
    last = begin;
  }
  if (!(series.sample_time > 0.0) || !std::isfinite(series.sample_time)) {
    throw std::invalid_argument(
        fmt::format("{}: sample_time is {}, it must be positive and finite", function, series.sample_time));
  }
}

std::vector<Stretch> records_of(const Series& series) {
  std::vector<Stretch> records;
  if (series.record_begins.empty()) return {{0, series.rows()}};
  for (std::size_t k = 0; k < series.record_begins.size(); ++k) {
    const bool is_last = k + 1 == series.record_begins.size();
    records.push_back({series.record_begins[k], is_last ? series.rows() : series.record_begins[k + 1]});
  }
  return records;
}

std::vector<Stretch> complete_stretches(const Series& series, Eigen::Index fewest) {
  std::vector<Stretch> stretches;
  const auto add = [&](Eigen::Index begin, Eigen::Index end) {
    if (end - begin >= fewest && end > begin) stretches.push_back({begin, end});
  };
  for (const Stretch& record : records_of(series)) {
    Eigen::Index begin = record.begin;
    for (Eigen::Index row = record.begin; row < record.end; ++row) {
      const bool complete =
          series.outputs.row(row).allFinite() && (series.inputs.cols() == 0 || series.inputs.row(row).allFinite());
      if (complete) continue;
      add(begin, row);
      begin = row + 1;
    }
    add(begin, record.end);
  }
  return stretches;
}

double sample_time_of(const Eigen::VectorXd& times, const std::vector<Stretch>& records, double tolerance) {
  std::vector<double> steps;
  for (const Stretch& record : records) {
    check_times(times, record);
    for (Eigen::Index row = record.begin + 1; row < record.end; ++row) steps.push_back(times(row) - times(row - 1));
  }
  if (steps.empty()) throw std::invalid_argument("a step of time needs two rows of a record");
  std::ranges::nth_element(steps, steps.begin() + std::ssize(steps) / 2);
  const double step = steps[steps.size() / 2];
  for (const Stretch& record : records) {
    for (Eigen::Index row = record.begin + 1; row < record.end; ++row) {
      const double here = times(row) - times(row - 1);
      if (std::abs(here - step) <= tolerance * step) continue;
      throw std::invalid_argument(
          fmt::format("the step of time to row {} is {:.6g}, most are {:.6g}", row, here, step));
    }
  }
  // The mean is more exact than a difference of rounded times.
  double span = 0.0;
  Eigen::Index count = 0;
  for (const Stretch& record : records) {
    span += times(record.end - 1) - times(record.begin);
    count += record.rows() - 1;
  }
  return span / static_cast<double>(count);
}

Series on_grid(const Series& series, const Eigen::VectorXd& times, double sample_time, double longest_gap) {
  Series result = series;
  result.sample_time = sample_time;
  const std::vector<Stretch> records = records_of(series);
  double rows = 0.0;
  std::vector<Eigen::Index> counts;
  for (const Stretch& record : records) {
    check_times(times, record);
    const double count = std::floor((times(record.end - 1) - times(record.begin)) / sample_time * (1.0 + 1e-12)) + 1.0;
    rows += count;
    if (!(rows <= most_grid_rows)) {
      throw std::invalid_argument(fmt::format("a grid of {} would have more than 10^8 rows", sample_time));
    }
    counts.push_back(static_cast<Eigen::Index>(count));
  }
  const auto total = static_cast<Eigen::Index>(rows);
  result.inputs.resize(total, series.inputs.cols());
  result.outputs.resize(total, series.outputs.cols());
  result.record_begins.clear();
  Eigen::Index to = 0;
  for (std::size_t r = 0; r < records.size(); ++r) {
    result.record_begins.push_back(to);
    Eigen::Index from = records[r].begin;
    for (Eigen::Index k = 0; k < counts[r]; ++k, ++to) {
      const double time = times(records[r].begin) + static_cast<double>(k) * sample_time;
      while (from + 2 < records[r].end && times(from + 1) <= time) ++from;
      const Eigen::Index next = std::min(from + 1, records[r].end - 1);
      const double gap = times(next) - times(from);
      const double part = gap > 0.0 ? std::clamp((time - times(from)) / gap, 0.0, 1.0) : 0.0;
      const auto between = [&](const Eigen::MatrixXd& values, Eigen::MatrixXd& target) {
        if (part == 0.0 || part == 1.0) {
          target.row(to) = values.row(part == 0.0 ? from : next);
        } else if (gap > longest_gap) {
          target.row(to).setConstant(std::nan(""));
        } else {
          target.row(to) = (1.0 - part) * values.row(from) + part * values.row(next);
        }
      };
      between(series.inputs, result.inputs);
      between(series.outputs, result.outputs);
    }
  }
  return result;
}

}  // namespace llmt
