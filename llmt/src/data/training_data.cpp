#include "llmt/training_data.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <limits>
#include <map>
#include <stdexcept>
#include <string_view>
#include <utility>

namespace llmt {

void set_categories(TrainingData& data, int input, std::span<const std::string> words) {
  if (input < 0 || input >= data.inputs.cols()) {
    throw std::invalid_argument(
        fmt::format("llmt::set_categories: input is {}, there are {} inputs", input, data.inputs.cols()));
  }
  if (std::ssize(words) != data.inputs.rows()) {
    throw std::invalid_argument(
        fmt::format("llmt::set_categories: there are {} words for {} rows", words.size(), data.inputs.rows()));
  }
  std::vector<std::string> levels(words.begin(), words.end());
  std::ranges::sort(levels);
  levels.erase(std::unique(levels.begin(), levels.end()), levels.end());
  std::erase(levels, "");
  data.inputs.col(input) = category_values(words, levels);
  data.levels.resize(data.inputs.cols());
  data.levels[input] = std::move(levels);
}

Eigen::VectorXd category_values(std::span<const std::string> words, std::span<const std::string> levels) {
  constexpr double unknown = -1.0;
  std::map<std::string_view, double> places;
  for (const std::string& level : levels) places.emplace(level, static_cast<double>(places.size()));
  Eigen::VectorXd values(std::ssize(words));
  for (std::size_t row = 0; row < words.size(); ++row) {
    const auto found = places.find(words[row]);
    values(static_cast<Eigen::Index>(row)) = found != places.end() ? found->second
                                             : words[row].empty()  ? std::numeric_limits<double>::quiet_NaN()
                                                                   : unknown;
  }
  return values;
}

}  // namespace llmt
