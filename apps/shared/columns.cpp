#include "shared/columns.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>

namespace llmt::apps {
namespace {

constexpr double missing = std::numeric_limits<double>::quiet_NaN();

bool is_number(const std::string& text) {
  try {
    return Csv::parse("x\n" + csv_field(text) + "\n", "").numbers("x").size() == 1;
  } catch (const std::runtime_error&) {
    return false;
  }
}

/// No cell is a number, some cell is a word.
bool all_words(const std::vector<std::string>& texts) {
  bool has_word = false;
  for (const std::string& text : texts) {
    if (!text.empty()) {
      if (is_number(text)) {
        return false;
      }
      has_word = true;
    }
  }
  return has_word;
}

double position(const std::vector<std::string>& levels, const std::string& text) {
  const auto found = std::find(levels.begin(), levels.end(), text);
  return found == levels.end() ? missing : static_cast<double>(found - levels.begin());
}

}  // namespace

InputColumns read_inputs(const Csv& csv, const std::vector<std::string>& columns,
                         const std::vector<std::string>& categorical) {
  for (const std::string& name : categorical) {
    if (std::find(columns.begin(), columns.end(), name) == columns.end()) {
      throw std::runtime_error(fmt::format("{}: column \"{}\" is categorical, but not an input", csv.name(), name));
    }
  }
  InputColumns inputs{Eigen::MatrixXd(csv.rows(), std::ssize(columns)), {}, {}};
  for (std::size_t c = 0; c < columns.size(); ++c) {
    const std::ptrdiff_t column = static_cast<std::ptrdiff_t>(c);
    std::vector<std::string> levels;
    const bool declared = std::find(categorical.begin(), categorical.end(), columns[c]) != categorical.end();
    try {
      if (!declared) {
        inputs.values.col(column) = csv.numbers_or_missing(std::span<const std::string>(&columns[c], 1)).col(0);
      }
    } catch (const std::runtime_error&) {
      if (!all_words(csv.texts(columns[c]))) {
        throw;
      }
      levels = csv.texts(columns[c]);
    }
    if (declared) {
      levels = csv.texts(columns[c]);
    }
    if (!levels.empty()) {
      const std::vector<std::string> texts = levels;
      std::sort(levels.begin(), levels.end());
      levels.erase(std::unique(levels.begin(), levels.end()), levels.end());
      std::erase(levels, "");
      if (levels.empty()) {
        levels.emplace_back("(none)");  // a declared category that is missing in every row
      }
      for (std::size_t row = 0; row < texts.size(); ++row) {
        inputs.values(static_cast<std::ptrdiff_t>(row), column) = position(levels, texts[row]);
      }
      inputs.categorical.push_back(static_cast<int>(c));
    }
    inputs.levels.push_back(std::move(levels));
  }
  return inputs;
}

ModelInputs read_inputs(const Csv& csv, const Model& model) {
  ModelInputs inputs{Eigen::MatrixXd(csv.rows(), model.num_inputs())};
  for (std::ptrdiff_t column = 0; column < model.num_inputs(); ++column) {
    const InputColumn& input = model.inputs()[static_cast<std::size_t>(column)];
    if (!input.is_categorical()) {
      inputs.values.col(column) = csv.numbers_or_missing(std::span<const std::string>(&input.name, 1)).col(0);
      inputs.missing += inputs.values.col(column).array().isNaN().count();
      continue;
    }
    const std::vector<std::string> texts = csv.texts(input.name);
    for (std::ptrdiff_t row = 0; row < csv.rows(); ++row) {
      const std::string& text = texts[static_cast<std::size_t>(row)];
      inputs.values(row, column) = position(input.levels, text);
      inputs.missing += text.empty() ? 1 : 0;
      inputs.unknown += !text.empty() && std::isnan(inputs.values(row, column)) ? 1 : 0;
    }
  }
  return inputs;
}

}  // namespace llmt::apps
