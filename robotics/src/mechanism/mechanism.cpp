#include "llmt/robotics/mechanism/mechanism.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <cmath>
#include <iterator>
#include <map>
#include <set>
#include <stdexcept>

#include "llmt/random.hpp"
#include "mechanism/assembler.hpp"

namespace llmt::robotics {
namespace {

[[noreturn]] void refuse(const std::string& what) { throw std::invalid_argument("llmt::robotics::Mechanism: " + what); }

bool is_identifier(const std::string& name) {
  const auto letter = [](unsigned char c) { return std::isalpha(c) != 0 || c == '_'; };
  if (name.empty() || name.size() > 100 || !letter(name.front())) return false;
  for (const unsigned char c : name) {
    if (!letter(c) && std::isdigit(c) == 0) return false;
  }
  return true;
}

// True if expressions take the name for a variable. muParser accepts the name of a function alone.
bool is_free_word(const std::string& name) {
  const auto reads = [](const std::string& text) {
    try {
      return Expression(text, expression_constants()).names() == std::vector<std::string>{};
    } catch (const ExpressionError&) {
      return false;
    }
  };
  return !reads(name) && !reads(name + "(1)") && !reads(name + "(1,1)");
}

void take_name(std::set<std::string>& names, const std::string& name) {
  if (!is_identifier(name)) refuse(fmt::format("\"{}\" is no name: letters, digits and _, a letter first", name));
  if (!is_free_word(name)) refuse(fmt::format("\"{}\" is a word of the expressions, it cannot be a name", name));
  if (!names.insert(name).second) refuse(fmt::format("the name \"{}\" is there twice", name));
}

void check_unit(const std::string& name, const std::string& unit) {
  if (unit != "mm" && unit != "deg" && unit != "1") {
    refuse(fmt::format("{}: the unit is \"{}\", must be mm, deg or 1", name, unit));
  }
}

void check_number(const std::string& name, const char* what, double value, bool is_right, const char* bound) {
  if (!std::isfinite(value) || !is_right) refuse(fmt::format("{}: {} is {}, must be {}", name, what, value, bound));
}

void check_parameter(const MechanismParameter& parameter) {
  check_unit(parameter.name, parameter.unit);
  check_number(parameter.name, "the value", parameter.value, true, "finite");
  if (parameter.prior_sigma) {
    check_number(parameter.name, "prior", *parameter.prior_sigma, *parameter.prior_sigma > 0.0, "> 0");
  }
}

void check_coordinate(const Coordinate& coordinate) {
  check_unit(coordinate.name, coordinate.unit);
  check_number(coordinate.name, "start", coordinate.start, true, "finite");
  if (coordinate.sigma) check_number(coordinate.name, "sigma", *coordinate.sigma, *coordinate.sigma >= 0.0, ">= 0");
  if (coordinate.has_limits()) {
    check_number(coordinate.name, "the upper limit", coordinate.upper, coordinate.upper > coordinate.lower,
                 "above the lower one");
  }
}

// The names that an expression uses.
std::vector<std::string> check_expression(const std::set<std::string>& names, const std::string& where,
                                          const std::string& text) {
  try {
    const Expression expression(text, expression_constants());
    for (const std::string& name : expression.names()) {
      if (!names.contains(name))
        refuse(fmt::format("{}: {} is no parameter, coordinate or earlier definition", where, name));
    }
    return expression.names();
  } catch (const ExpressionError& error) {
    refuse(fmt::format("{}: {}", where, error.what()));
  }
}

// Each side by itself, so that a message has the column in what was written.
std::vector<std::string> check_equation(const std::set<std::string>& names, const std::string& where,
                                        const std::string& equation) {
  const std::size_t sign = sign_of(equation);
  if (sign == std::string::npos) return check_expression(names, where, equation);
  std::vector<std::string> used = check_expression(names, where + ", left of =", equation.substr(0, sign));
  std::ranges::copy(check_expression(names, where + ", right of =", equation.substr(sign + 1)),
                    std::back_inserter(used));
  return used;
}

void check_use(const std::set<std::string>& used, const std::string& name) {
  if (!used.contains(name)) refuse(fmt::format("{} occurs in no equation: use it or remove it", name));
}

void check_shape(const Mechanism& mechanism, const Eigen::MatrixXd& known) {
  if (known.cols() != std::ssize(mechanism.coordinates)) {
    refuse(
        fmt::format("the poses have {} coordinates, the mechanism has {}", known.cols(), mechanism.coordinates.size()));
  }
  if (known.array().isInf().any()) refuse("a reading is infinite");
}

}  // namespace

void validate(const Mechanism& mechanism) {
  if (mechanism.coordinates.empty()) refuse("there are no joints and no outputs");
  if (mechanism.equations.empty()) refuse("there are no equations");
  std::set<std::string> names;
  for (const MechanismParameter& parameter : mechanism.parameters) {
    take_name(names, parameter.name);
    check_parameter(parameter);
  }
  for (const Coordinate& coordinate : mechanism.coordinates) {
    take_name(names, coordinate.name);
    check_coordinate(coordinate);
  }
  std::map<std::string, std::vector<std::string>> uses;  // of definitions
  for (const Definition& definition : mechanism.definitions) {
    uses[definition.name] = check_expression(names, "definition of " + definition.name, definition.text);
    take_name(names, definition.name);
  }
  std::vector<std::string> used;
  for (std::size_t i = 0; i < mechanism.equations.size(); ++i) {
    std::ranges::copy(check_equation(names, fmt::format("equation {}", i + 1), mechanism.equations[i]),
                      std::back_inserter(used));
  }
  std::set<std::string> reached;
  while (!used.empty()) {
    const std::string name = used.back();
    used.pop_back();
    if (reached.insert(name).second) std::ranges::copy(uses[name], std::back_inserter(used));
  }
  for (const MechanismParameter& parameter : mechanism.parameters) check_use(reached, parameter.name);
  for (const Coordinate& coordinate : mechanism.coordinates) check_use(reached, coordinate.name);
}

Eigen::VectorXd noise_of(const Mechanism& mechanism, const Eigen::MatrixXd& known) {
  check_shape(mechanism, known);
  const auto is_measured = [&](Eigen::Index i) { return known.col(i).array().isFinite().any(); };
  const Eigen::Index count = known.cols();
  Eigen::VectorXd sigma = Eigen::VectorXd::Zero(count);
  bool is_stated = false;
  bool has_output = false;
  for (Eigen::Index i = 0; i < count; ++i) {
    const Coordinate& coordinate = mechanism.coordinates[i];
    if (!is_measured(i)) continue;
    is_stated = is_stated || coordinate.sigma.has_value();
    has_output = has_output || coordinate.output;
    sigma(i) = coordinate.sigma.value_or(0.0);
  }
  if (is_stated) return sigma;
  const auto unknown = known.array().isNaN().rowwise().count();
  const bool is_redundant = known.rows() > 0 && unknown.minCoeff() < std::ssize(mechanism.equations);
  const Coordinate* first = nullptr;
  for (Eigen::Index i = 0; i < count; ++i) {
    const Coordinate& coordinate = mechanism.coordinates[i];
    if (!is_measured(i) || coordinate.output != has_output) continue;
    if (first == nullptr) first = &coordinate;
    if (is_redundant && coordinate.unit != first->unit) {
      refuse(fmt::format("{} is measured in {}, {} in {}: state the sigma of each", first->name, first->unit,
                         coordinate.name, coordinate.unit));
    }
    sigma(i) = 1.0;
  }
  return sigma;
}

Assembly assemble_again(const Mechanism& mechanism, const Eigen::MatrixXd& known, const Eigen::MatrixXd& before) {
  Assembler assembler(mechanism, noise_of(mechanism, known));
  Assembly assembly{.coordinates = Eigen::MatrixXd::Constant(known.rows(), known.cols(), NAN), .failures = {}};
  const auto has_one = [&](Eigen::Index row) { return before.size() > 0 && before.row(row).allFinite(); };
  for (Eigen::Index row = 0; row < before.rows(); ++row) {
    if (has_one(row)) assembler.remember(before.row(row));
  }
  for (Eigen::Index row = 0; row < known.rows(); ++row) {
    const Eigen::VectorXd hint = has_one(row) ? before.row(row).transpose() : Eigen::VectorXd();
    const SolvedPose pose = assembler.pose(known.row(row), hint);
    if (pose.ok()) assembly.coordinates.row(row) = pose.coordinates.transpose();
    assembly.failures.push_back(pose.failure);
  }
  return assembly;
}

Assembly assemble(const Mechanism& mechanism, const Eigen::MatrixXd& known) {
  validate(mechanism);
  return assemble_again(mechanism, known, {});
}

Eigen::MatrixXd random_poses(const Mechanism& mechanism, Eigen::Index count, std::uint64_t seed) {
  constexpr Eigen::Index most_draws_per_pose = 20;
  const auto& coordinates = mechanism.coordinates;
  if (std::ranges::none_of(coordinates, &Coordinate::has_limits)) refuse("no coordinate has limits to draw within");
  Random random(seed);
  Eigen::MatrixXd poses(count, std::ssize(coordinates));
  Eigen::Index found = 0;
  for (Eigen::Index draws = 0; found < count && draws < most_draws_per_pose * count; draws += count) {
    Eigen::MatrixXd known = Eigen::MatrixXd::Constant(count, poses.cols(), NAN);
    for (Eigen::Index row = 0; row < count; ++row) {
      for (Eigen::Index i = 0; i < known.cols(); ++i) {
        const Coordinate& coordinate = coordinates[i];
        if (coordinate.has_limits()) known(row, i) = random.uniform(coordinate.lower, coordinate.upper);
      }
    }
    const Assembly assembly = assemble(mechanism, known);
    for (Eigen::Index row = 0; row < count && found < count; ++row) {
      if (assembly.failures[row].empty()) poses.row(found++) = assembly.coordinates.row(row);
    }
  }
  if (found < count) {
    throw std::runtime_error(fmt::format("{}: only {} of {} random poses within the limits can be assembled",
                                         mechanism.name, found, most_draws_per_pose * count));
  }
  return poses;
}

}  // namespace llmt::robotics
