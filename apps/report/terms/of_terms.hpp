/// \file
/// The report of `llmt discover`.
#pragma once

#include <string>

#include "llmt/discovery/missing.hpp"
#include "llmt/discovery/simulation.hpp"
#include "report/document/document.hpp"

namespace llmt::report {

struct Simulated {
  std::string simulated;  ///< the file
  std::string measured;   ///< the file
  const discovery::Inputs& inputs;
  const Eigen::MatrixXd& values;  ///< measured, rows x outputs
  const discovery::Missing& missing;
};

Document terms_report(const Simulated& simulated);

}  // namespace llmt::report
