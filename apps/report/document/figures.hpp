/// \file
/// Charts and texts that several reports have.
#pragma once

#include <Eigen/Core>
#include <string>
#include <vector>

#include "report/document/document.hpp"

namespace llmt::report {

/// A picture shows no more points than this, so that a page stays quick and small.
inline constexpr Eigen::Index most_points = 3000;

/// Evenly spaced numbers below `count`, at most `most` of them.
std::vector<Eigen::Index> thinned(Eigen::Index count, Eigen::Index most = most_points);

/// " 3000 of 100 000 rows are drawn; figures are of all." or nothing if all are.
std::string thinning_note(Eigen::Index count, const std::string& what, Eigen::Index most = most_points);

/// The value below which the share lies, by linear interpolation. NaN without values.
double quantile(Numbers values, double share);

/// From `low` to `high` in equal steps, both included.
Numbers steps_between(double low, double high, int count);

/// The name of a file without its folders.
std::string file_name(const std::string& path);

/// A sample of values with a name and a role.
struct Sample {
  std::string name;
  std::string role;
  Numbers values;
};

/// How often which values occur, in bins that all samples share. Values beyond the 99.5 % quantile of the first sample
/// are in no bin, and the caption says so.
Chart histogram(const std::string& title, const std::string& axis, const std::vector<Sample>& samples);

/// The share of each sample below every value, over a logarithmic axis.
Chart shares_below(const std::string& title, const std::string& axis, const std::vector<Sample>& samples);

/// Bars with names from top to bottom, and a label at the end of each.
Chart ranking(const std::string& title, const std::string& axis, const std::vector<std::string>& names,
              const Numbers& values, const std::vector<std::string>& labels, const std::string& role = "model");

}  // namespace llmt::report
