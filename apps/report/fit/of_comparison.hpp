/// \file
/// The report of `llmt compare`.
#pragma once

#include <string>

#include "llmt/compare.hpp"
#include "report/document/document.hpp"

namespace llmt::report {

struct Compared {
  std::string data;    ///< the file
  std::string target;  ///< the column
  Eigen::Index rows = 0;
  Eigen::Index inputs = 0;
  const ComparisonResult& result;
};

Document comparison_report(const Compared& compared);

}  // namespace llmt::report
