#include "model/codes.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace llmt {

double position_of(const InputColumn& input, double value) {
  const std::vector<double>& codes = input.codes;
  if (std::isnan(value) && input.has_empty_level()) return static_cast<double>(input.levels.size() - 1);
  if (codes.empty() || !std::isfinite(value)) return value;
  const auto above = std::ranges::lower_bound(codes, value);
  if (above == codes.begin()) return 0.0;
  const auto position = static_cast<double>(above - codes.begin());
  return above != codes.end() && *above - value < value - *(above - 1) ? position : position - 1.0;
}

bool has_codes(const std::vector<InputColumn>& columns) {
  return std::ranges::any_of(columns, [](const InputColumn& column) { return !column.codes.empty(); });
}

bool needs_positions(const std::vector<InputColumn>& columns) {
  return has_codes(columns) || std::ranges::any_of(columns, &InputColumn::has_empty_level);
}

Eigen::MatrixXd at_positions(const std::vector<InputColumn>& columns, const Eigen::Ref<const Eigen::MatrixXd>& inputs) {
  Eigen::MatrixXd result = inputs;
  for (std::size_t j = 0; j < columns.size(); ++j) {
    if (columns[j].codes.empty() && !columns[j].has_empty_level()) continue;
    for (double& value : result.col(static_cast<Eigen::Index>(j))) value = position_of(columns[j], value);
  }
  return result;
}

std::vector<std::string> names_of_codes(const std::vector<double>& codes) {
  std::vector<std::string> names;
  for (const double code : codes) names.push_back(fmt::format("{}", code));
  return names;
}

Model with_codes(const Model& model, const std::vector<std::vector<double>>& codes,
                 const std::vector<std::size_t>& empty_levels) {
  std::vector<InputColumn> inputs = model.inputs();
  for (std::size_t j = 0; j < codes.size(); ++j) {
    if (codes[j].empty()) continue;
    InputColumn& input = inputs[j];
    const auto last = static_cast<double>(codes[j].size() - 1);
    const auto code_at = [&](double given) {
      const double position = std::min(given, last);  // that of missing values is behind all codes
      const double below = std::floor(position);
      const double code = codes[j][static_cast<std::size_t>(below)];
      return position == below ? code
                               : std::lerp(code, codes[j][static_cast<std::size_t>(below) + 1], position - below);
    };
    input.low = code_at(input.low);
    input.high = code_at(input.high);
    input.centre = code_at(input.centre);
    input.codes = codes[j];
    const bool has_empty_level = input.levels.size() > codes[j].size();
    input.levels = names_of_codes(codes[j]);
    if (has_empty_level) input.levels.emplace_back();
  }
  for (std::size_t j = 0; j < empty_levels.size(); ++j) {
    if (empty_levels[j] > 0 && inputs[j].levels.size() == empty_levels[j]) inputs[j].levels.back().clear();
  }
  return {std::move(inputs), model.outputs(), model.regressors(), model.partitions()};
}

}  // namespace llmt
