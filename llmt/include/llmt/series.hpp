/// \file
/// Records of a system that moves: inputs and outputs at equal steps of time.
///
///     llmt::Series series;
///     series.inputs = inputs;        // rows x inputs
///     series.outputs = output;       // rows x outputs
///     series.input_names = {"u"};
///     series.output_names = {"y"};
///     series.sample_time = 0.02;     // s
#pragma once

#include <Eigen/Core>
#include <string>
#include <vector>

#include "llmt/abi.hpp"

namespace llmt {

/// Rows that follow each other: begin <= row < end.
struct Stretch {
  Eigen::Index begin = 0;
  Eigen::Index end = 0;

  Eigen::Index rows() const { return end - begin; }
  bool operator==(const Stretch&) const = default;
};

/// One record or several, one behind the other. A row is what was measured at one time.
struct Series {
  Eigen::MatrixXd inputs = {};   ///< rows x inputs; NaN: missing
  Eigen::MatrixXd outputs = {};  ///< rows x outputs; NaN: missing
  std::vector<std::string> input_names = {};
  std::vector<std::string> output_names = {};
  std::vector<Eigen::Index> record_begins =
      {};                    ///< first row of each record, ascending, the first 0; empty: one record
  double sample_time = 1.0;  ///< from row to row, in `time_unit`
  std::string time_unit = "s";

  Eigen::Index rows() const { return outputs.rows(); }
};

/// Throws std::invalid_argument that names what does not fit: no output, no row, matrices of different length, an
/// infinite value, names that are too few, too many or repeated, records that are not ascending, a sample time that is
/// not positive and finite.
void check_series(const Series& series);

/// The records of a series.
std::vector<Stretch> records_of(const Series& series);

/// The longest stretches within a record in which no value is missing and that have at least `fewest` rows.
std::vector<Stretch> complete_stretches(const Series& series, Eigen::Index fewest);

/// The step of a column of times, of which every record is for itself: the median of the differences. Throws
/// std::invalid_argument naming the row if a time is missing or does not rise, or if a step differs from the median by
/// more than `tolerance` of it.
double sample_time_of(const Eigen::VectorXd& times, const std::vector<Stretch>& records, double tolerance = 0.01);

/// The series at the times 0, `sample_time`, 2 `sample_time`, ... from the beginning of each record, by straight lines
/// between the rows. A value between two rows of which one misses it, or that are more than `longest_gap` apart, is
/// missing. Throws std::invalid_argument if a time is missing or does not rise, or if there would be more than 10^8
/// rows.
Series on_grid(const Series& series, const Eigen::VectorXd& times, double sample_time, double longest_gap);

}  // namespace llmt
