/// \file
/// A sample of fixed size of the rows of a stream.
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <map>
#include <vector>

namespace llmt {

/// The different rows so far whose values have the smallest hashes: a sample without replacement that does not depend
/// on the order of the rows, and in which a row that comes again is recognised. One row in eight is held out.
class Reservoir {
 public:
  /// Rows of `width` numbers.
  Reservoir(Eigen::Index capacity, Eigen::Index width) : capacity_(capacity), width_(width) {}

  struct Row {
    std::vector<double> values;
    bool held_out;
    Eigen::Index times;  ///< how often it has come
  };

  /// Offers a row that comes `times` times. Returns true if it is in the sample now and held out.
  bool add(const double* values, Eigen::Index times = 1);

  /// Offers the rows of another reservoir of this capacity: the sample of the rows that both have been offered.
  void merge(const Reservoir& other);

  /// Number of different rows divided by number of rows, over the rows in the sample and all times that they have come.
  /// 1 if none has come twice.
  double different_fraction() const {
    return rows_.empty() ? 1.0 : static_cast<double>(rows_.size()) / static_cast<double>(times_);
  }

  /// Drops the rows for which `drop` is true.
  void remove_if(const std::function<bool(const double* values)>& drop);

  /// In the order of their hashes, which is a random order.
  const std::map<std::uint64_t, Row>& rows() const { return rows_; }

  Eigen::Index bytes() const;

 private:
  Eigen::Index capacity_;
  Eigen::Index width_;
  std::map<std::uint64_t, Row> rows_;
  Eigen::Index times_ = 0;  // sum over the rows
};

}  // namespace llmt
