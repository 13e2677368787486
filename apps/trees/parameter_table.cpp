#include "trees/parameter_table.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <stdexcept>

namespace llmt::apps {
namespace {

struct Column {
  std::string name;
  std::string parameter;
  std::size_t output = 0;
};

Column column_of(const Csv& csv, const std::string& name, const std::vector<std::string>& outputs) {
  for (std::size_t o = 0; o < outputs.size(); ++o) {
    if (name.starts_with(outputs[o] + ":") && name.size() > outputs[o].size() + 1) {
      return {name, name.substr(outputs[o].size() + 1), o};
    }
  }
  if (outputs.size() == 1 && name.find(':') == std::string::npos) return {name, name, 0};
  throw std::runtime_error(fmt::format(
      "{}: column \"{}\" is neither an input nor a derivative, which is called {}", csv.name(), name,
      outputs.size() == 1 ? fmt::format("PARAMETER or {}:PARAMETER", outputs.front())
                          : fmt::format("OUTPUT:PARAMETER, with the outputs {}", fmt::join(outputs, ", "))));
}

void check_input(const Csv& csv, const std::string& name, const Eigen::VectorXd& expected) {
  const Eigen::VectorXd values = csv.numbers(name);
  // Files are written with a limited number of digits.
  constexpr double rounding = 1e-6;
  const double range = expected.maxCoeff() - expected.minCoeff();
  for (Eigen::Index i = 0; i < values.size(); ++i) {
    if (std::abs(values(i) - expected(i)) <= rounding * std::max(range, 1e-3 * std::abs(expected(i)))) continue;
    throw std::runtime_error(fmt::format(
        "{}:{}: column \"{}\" is {}, but the input of that name is {} in this row; rows must stand in the same order",
        csv.name(), csv.line_of(i), name, values(i), expected(i)));
  }
}

}  // namespace

discovery::Parameter parse_parameter(const std::string& text) {
  const auto refuse = [&](const std::string& why) {
    throw std::invalid_argument(fmt::format("--parameter: \"{}\" {}, must be of the form mass=3.0[kg]", text, why));
  };
  const std::size_t equals = text.find('=');
  if (equals == std::string::npos || equals == 0) refuse("has no name and =");
  discovery::Parameter parameter;
  parameter.name = text.substr(0, equals);
  std::string number = text.substr(equals + 1);
  if (const std::size_t bracket = number.find('['); bracket != std::string::npos) {
    if (!number.ends_with(']')) refuse("has a [ that no ] closes at its end");
    parameter.unit = number.substr(bracket + 1, number.size() - bracket - 2);
    number.resize(bracket);
  }
  const char* end = number.data() + number.size();
  const char* begin = number.starts_with('+') ? number.data() + 1 : number.data();
  const auto [rest, error] = std::from_chars(begin, end, parameter.value);
  if (error != std::errc() || rest != end || !std::isfinite(parameter.value)) {
    refuse(fmt::format("has the value \"{}\", which is no finite number", number));
  }
  constexpr double typical = 0.1;
  parameter.scale = parameter.value == 0.0 ? 1.0 : typical * std::abs(parameter.value);
  return parameter;
}

std::vector<discovery::Parameter> parse_parameters(const std::vector<std::string>& texts) {
  std::vector<discovery::Parameter> parameters;
  for (const std::string& text : texts) {
    discovery::Parameter parameter = parse_parameter(text);
    if (std::ranges::find(parameters, parameter.name, &discovery::Parameter::name) != parameters.end()) {
      throw std::invalid_argument(fmt::format("--parameter: \"{}\" is given twice", parameter.name));
    }
    parameters.push_back(std::move(parameter));
  }
  return parameters;
}

ParameterTable read_parameter_table(const std::string& path, DecimalMark mark,
                                    const std::vector<discovery::Parameter>& given, const discovery::Inputs& inputs,
                                    const std::vector<std::string>& outputs) {
  const Csv csv = Csv::read(path, mark);
  if (csv.rows() != inputs.values.rows()) {
    throw std::runtime_error(
        fmt::format("{} has {} rows, the inputs have {}", csv.name(), csv.rows(), inputs.values.rows()));
  }
  ParameterTable table;
  std::vector<Column> columns;
  for (const std::string& name : csv.columns()) {
    const auto input = std::ranges::find(inputs.names, name);
    if (input != inputs.names.end()) {
      check_input(csv, name, inputs.values.col(input - inputs.names.begin()));
    } else {
      columns.push_back(column_of(csv, name, outputs));
    }
  }
  for (const Column& column : columns) {
    const auto place = std::ranges::find(table.parameters, column.parameter, &discovery::Parameter::name);
    const auto k = static_cast<std::size_t>(place - table.parameters.begin());
    if (place == table.parameters.end()) {
      const auto nominal = std::ranges::find(given, column.parameter, &discovery::Parameter::name);
      if (nominal == given.end()) table.without_nominal.push_back(column.parameter);
      table.parameters.push_back(nominal == given.end() ? discovery::Parameter{.name = column.parameter, .unit = ""}
                                                        : *nominal);
      table.derivatives.emplace_back(Eigen::MatrixXd::Zero(csv.rows(), std::ssize(outputs)));
    }
    table.derivatives[k].col(static_cast<Eigen::Index>(column.output)) = csv.numbers(column.name);
  }
  if (table.parameters.empty()) {
    throw std::runtime_error(fmt::format("{}: no columns of derivatives beside the inputs", csv.name()));
  }
  for (const discovery::Parameter& parameter : given) {
    if (std::ranges::find(table.parameters, parameter.name, &discovery::Parameter::name) != table.parameters.end()) {
      continue;
    }
    std::vector<std::string> names;
    for (const discovery::Parameter& known : table.parameters) names.push_back(known.name);
    throw std::invalid_argument(fmt::format("--parameter: {} has no derivatives by \"{}\"; there are {}", csv.name(),
                                            parameter.name, fmt::join(names, ", ")));
  }
  return table;
}

}  // namespace llmt::apps
