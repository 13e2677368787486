#include "trees/input_errors.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <stdexcept>

namespace llmt::apps {

Eigen::VectorXd errors_of_inputs(const std::vector<std::string>& given, const std::vector<std::string>& inputs) {
  if (given.empty()) return {};
  const bool is_estimated = given.size() == 1 && given.front() == "auto";
  Eigen::VectorXd errors = Eigen::VectorXd::Constant(std::ssize(inputs), is_estimated ? std::nan("") : 0.0);
  for (const std::string& entry : given) {
    if (is_estimated) break;
    const std::size_t sign = entry.find('=');
    const std::string name = entry.substr(0, sign);
    const auto place = std::ranges::find(inputs, name);
    if (sign == std::string::npos || place == inputs.end()) {
      throw std::invalid_argument(fmt::format("--input-noise: \"{}\" must be auto, or INPUT=NUMBER with an input of {}",
                                              entry, fmt::join(inputs, ", ")));
    }
    double& error = errors(place - inputs.begin());
    const std::string text = entry.substr(sign + 1);
    char* end = nullptr;
    error = std::strtod(text.c_str(), &end);
    if (text.empty() || *end != '\0' || !(error >= 0.0) || !std::isfinite(error)) {
      throw std::invalid_argument(fmt::format(
          "--input-noise: the standard deviation of {} is \"{}\", must be a number of at least 0", name, text));
    }
  }
  return errors;
}

}  // namespace llmt::apps
