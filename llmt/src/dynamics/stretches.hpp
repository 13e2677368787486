/// \file
/// Stretches that are held out together, and those a search looks at.
#pragma once

#include <vector>

#include "llmt/series.hpp"

namespace llmt {

struct StretchFold {
  std::vector<Stretch> train;
  std::vector<Stretch> held_out;
};

/// Cuts the rows of the stretches, one behind the other, into `count` parts of equal length; each is held out once.
std::vector<StretchFold> cut(const std::vector<Stretch>& stretches, Eigen::Index count);

/// One fold that holds out the parts first, first + 3, first + 6, ... of `count`, counted from 0, together.
StretchFold every_third(const std::vector<Stretch>& stretches, Eigen::Index count, Eigen::Index first = 2);

/// At most `rows` rows, in `count` parts of equal length at equal distances.
std::vector<Stretch> thinned(const std::vector<Stretch>& stretches, Eigen::Index rows, Eigen::Index count);

/// Whether an output stands at a value, its largest or smallest, for five rows or more at least twice, for a hundredth
/// of all rows or more: it may be a stop.
bool stands_at(const Series& series, const std::vector<Stretch>& stretches, Eigen::Index output, double value);

}  // namespace llmt
