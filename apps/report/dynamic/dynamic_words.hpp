/// \file
/// Words and JSON that the reports of models of systems that move share.
#pragma once

#include <Eigen/Core>
#include <string>
#include <vector>

#include "llmt/fit_dynamic.hpp"
#include "report/text/json.hpp"

namespace llmt::report {

std::vector<std::string> signal_names(const std::vector<Signal>& signals);

/// A time with its unit.
std::string run_time_text(double time, const std::string& unit);

/// Numbers; null where one is not finite.
Json number_array(const Eigen::VectorXd& values);
Json number_rows(const Eigen::MatrixXd& matrix);

Json errors_json(const RunErrors& errors);

}  // namespace llmt::report
