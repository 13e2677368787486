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

/// The different rows with the smallest hashes of their values: a sample without replacement of all different rows so
/// far, whatever their order, in which a row that comes again is found again. One in eight is held out.
class Reservoir {
 public:
  /// Rows of `width` numbers.
  Reservoir(Eigen::Index capacity, Eigen::Index width) : capacity_(capacity), width_(width) {}

  struct Row {
    std::vector<double> values;
    bool held_out;
    Eigen::Index times;  ///< that it has come
  };

  /// Offers a row; true if it is now in the sample and held out.
  bool add(const double* values);

  /// Different rows / rows of the stream: 1 if none has come twice. Of the rows in the sample, which have been counted
  /// since their first time.
  double share_of_different() const {
    return rows_.empty() ? 1.0 : static_cast<double>(rows_.size()) / static_cast<double>(times_);
  }

  /// Drops rows.
  void remove_if(const std::function<bool(const double* values)>& drop);

  /// In the order of their hashes, which is random but for equal rows.
  const std::map<std::uint64_t, Row>& rows() const { return rows_; }

  Eigen::Index bytes() const;

 private:
  Eigen::Index capacity_;
  Eigen::Index width_;
  std::map<std::uint64_t, Row> rows_;
  Eigen::Index times_ = 0;  // sum over the rows
};

}  // namespace llmt
