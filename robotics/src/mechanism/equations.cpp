#include "mechanism/equations.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <numbers>

namespace llmt::robotics {
namespace {

double factor_of(const std::string& unit) { return unit == "deg" ? std::numbers::pi / 180.0 : 1.0; }

// The largest length that the description knows, 1 mm if it knows none.
double largest_length(const Mechanism& mechanism) {
  double largest = 0.0;
  for (const MechanismParameter& parameter : mechanism.parameters) {
    if (parameter.unit == "mm") largest = std::max(largest, std::abs(parameter.value));
  }
  for (const Coordinate& coordinate : mechanism.coordinates) {
    if (coordinate.unit == "mm") largest = std::max(largest, std::abs(coordinate.start));
  }
  return largest > 0.0 ? largest : 1.0;
}

// True if a turn changes the equations by no more than the rounding of the changes of a part of a turn.
bool turns(Equations& equations, const Eigen::VectorXd& parameters, const Eigen::VectorXd& at, Eigen::Index which) {
  constexpr double rounding = 1e-9;
  const auto change = [&](double angle) -> Eigen::ArrayXd {
    Eigen::VectorXd turned = at;
    turned(which) += angle;
    return (equations.values(parameters, turned) - equations.values(parameters, at)).array().abs();
  };
  const Eigen::ArrayXd largest = change(90.0).max(change(180.0)).max(change(270.0));
  return (change(360.0) <= rounding * largest).all() && (change(-360.0) <= rounding * largest).all();
}

}  // namespace

const std::map<std::string, double>& expression_constants() {
  static const std::map<std::string, double> constants = {{"pi", std::numbers::pi}};
  return constants;
}

Eigen::VectorXd start_of(const Mechanism& mechanism) {
  Eigen::VectorXd start(std::ssize(mechanism.coordinates));
  for (Eigen::Index i = 0; i < start.size(); ++i) start(i) = mechanism.coordinates[i].start;
  return start;
}

Eigen::VectorXd values_of(const Mechanism& mechanism) {
  Eigen::VectorXd values(std::ssize(mechanism.parameters));
  for (Eigen::Index k = 0; k < values.size(); ++k) values(k) = mechanism.parameters[k].value;
  return values;
}

std::size_t sign_of(const std::string& equation) {
  const auto compares = [&](std::size_t at) {
    const bool follows = at > 0 && std::string("=!<>").find(equation[at - 1]) != std::string::npos;
    return follows || (at + 1 < equation.size() && equation[at + 1] == '=');
  };
  for (std::size_t at = 0; at < equation.size(); ++at) {
    if (equation[at] == '=' && !compares(at)) return at;
  }
  return std::string::npos;
}

std::string as_zero(const std::string& equation) {
  const std::size_t sign = sign_of(equation);
  if (sign == std::string::npos) return equation;
  return "(" + equation.substr(0, sign) + ") - (" + equation.substr(sign + 1) + ")";
}

Equations::Equations(const Mechanism& mechanism) {
  std::map<std::string, Eigen::Index> places;
  std::vector<double> factors;
  std::vector<double> scales;
  const double length = largest_length(mechanism);
  const auto add = [&](const std::string& name, const std::string& unit, double value) {
    places.emplace(name, std::ssize(places));
    factors.push_back(factor_of(unit));
    scales.push_back(unit == "mm" ? length : unit == "deg" ? 1.0 : std::max(1.0, std::abs(value)));
  };
  for (const MechanismParameter& parameter : mechanism.parameters) add(parameter.name, parameter.unit, parameter.value);
  const Eigen::Index parameters = std::ssize(places);
  for (const Coordinate& coordinate : mechanism.coordinates) add(coordinate.name, coordinate.unit, coordinate.start);
  factors_ = Eigen::Map<const Eigen::VectorXd>(factors.data(), std::ssize(factors));
  const Eigen::VectorXd sizes = Eigen::Map<const Eigen::VectorXd>(scales.data(), std::ssize(scales));
  typical_ = (sizes.array() / factors_.array()).tail(sizes.size() - parameters);
  // Truncation and rounding of the differences are equal here, some 1e-12 of the derivative.
  steps_ = std::pow(std::numeric_limits<double>::epsilon(), 0.2) * sizes;
  const auto compile = [&](const std::string& text) {
    Compiled compiled{.expression = Expression(text, expression_constants()), .places = {}, .variables = {}};
    for (const std::string& name : compiled.expression.names()) compiled.places.push_back(places.at(name));
    compiled.variables.resize(compiled.places.size());
    return compiled;
  };
  for (const Definition& definition : mechanism.definitions) {
    definitions_.push_back(compile(definition.text));
    places.emplace(definition.name, std::ssize(places));
  }
  for (const std::string& equation : mechanism.equations) equations_.push_back(compile(as_zero(equation)));
  symbols_ = Eigen::VectorXd::Zero(std::ssize(places));
}

void Equations::set(const Eigen::VectorXd& parameters, const Eigen::VectorXd& coordinates) {
  symbols_.head(parameters.size()) = parameters;
  symbols_.segment(parameters.size(), coordinates.size()) = coordinates;
  symbols_.head(factors_.size()).array() *= factors_.array();
}

Eigen::VectorXd Equations::evaluate() {
  const auto value = [&](Compiled& compiled) {
    for (std::size_t k = 0; k < compiled.places.size(); ++k) compiled.variables[k] = symbols_(compiled.places[k]);
    return compiled.expression.value(compiled.variables);
  };
  Eigen::Index next = factors_.size();
  for (Compiled& definition : definitions_) symbols_(next++) = value(definition);
  Eigen::VectorXd values(count());
  for (std::size_t i = 0; i < equations_.size(); ++i) values(i) = value(equations_[i]);
  return values;
}

Eigen::MatrixXd Equations::differences(Eigen::Index first, Eigen::Index count) {
  Eigen::MatrixXd result(this->count(), count);
  for (Eigen::Index k = 0; k < count; ++k) {
    double& symbol = symbols_(first + k);
    const double here = symbol;
    const double step = steps_(first + k);
    const auto change = [&](double by) -> Eigen::VectorXd {
      symbol = here + by;
      const Eigen::VectorXd above = evaluate();
      symbol = here - by;
      return above - evaluate();
    };
    result.col(k) = (8.0 * change(step) - change(2.0 * step)) * factors_(first + k) / (12.0 * step);
    symbol = here;
  }
  return result;
}

Eigen::VectorXd Equations::values(const Eigen::VectorXd& parameters, const Eigen::VectorXd& coordinates) {
  set(parameters, coordinates);
  return evaluate();
}

Eigen::MatrixXd Equations::by_coordinates(const Eigen::VectorXd& parameters, const Eigen::VectorXd& coordinates) {
  set(parameters, coordinates);
  return differences(parameters.size(), coordinates.size());
}

Eigen::MatrixXd Equations::by_parameters(const Eigen::VectorXd& parameters, const Eigen::VectorXd& coordinates) {
  set(parameters, coordinates);
  return differences(0, parameters.size());
}

std::vector<Eigen::Index> turning_coordinates(const Mechanism& mechanism) {
  constexpr int places = 3;
  Equations equations(mechanism);
  const Eigen::VectorXd parameters = values_of(mechanism);
  std::vector<Eigen::Index> turning;
  for (std::size_t i = 0; i < mechanism.coordinates.size(); ++i) {
    bool is_turning = mechanism.coordinates[i].unit == "deg";
    for (int place = 0; is_turning && place < places; ++place) {
      // Away from the start, too, where symmetry may hide what a turn changes.
      const Eigen::VectorXd at = start_of(mechanism) + 0.1 * place * equations.typical();
      is_turning = turns(equations, parameters, at, static_cast<Eigen::Index>(i));
    }
    if (is_turning) turning.push_back(static_cast<Eigen::Index>(i));
  }
  return turning;
}

}  // namespace llmt::robotics
