#include "report/dynamic/dynamic_words.hpp"

#include <fmt/format.h>

namespace llmt::report {

std::vector<std::string> signal_names(const std::vector<Signal>& signals) {
  std::vector<std::string> names;
  for (const Signal& signal : signals) names.push_back(signal.name);
  return names;
}

std::string run_time_text(double time, const std::string& unit) { return fmt::format("{:.6g} {}", time, unit); }

Json number_array(const Eigen::VectorXd& values) {
  Json json = Json::array();
  for (const double value : values) json.push_back(finite_or_null(value));
  return json;
}

Json number_rows(const Eigen::MatrixXd& matrix) {
  Json json = Json::array();
  for (Eigen::Index i = 0; i < matrix.rows(); ++i) json.push_back(number_array(matrix.row(i).transpose()));
  return json;
}

Json errors_json(const RunErrors& errors) {
  return {{"rmse", number_array(errors.rmse)},
          {"fit_per_cent", number_array(errors.fit)},
          {"rows", errors.rows},
          {"runs", errors.runs},
          {"diverged", errors.diverged}};
}

}  // namespace llmt::report
