#include "llmt/robotics/mechanism.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <cmath>
#include <set>
#include <stdexcept>

#include "llmt/random.hpp"
#include "mechanism/equations.hpp"
#include "mechanism/pose_solver.hpp"

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

// Whether expressions take the name for a variable. muParser accepts the name of a function alone.
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

void check_expression(const std::set<std::string>& names, const std::string& where, const std::string& text) {
  try {
    const Expression expression(as_zero(text), expression_constants());
    for (const std::string& name : expression.names()) {
      if (!names.contains(name))
        refuse(fmt::format("{}: {} is no parameter, coordinate or earlier definition", where, name));
    }
  } catch (const ExpressionError& error) {
    refuse(fmt::format("{}: {}", where, error.what()));
  }
}

void check_shape(const Mechanism& mechanism, const Eigen::MatrixXd& known) {
  if (known.cols() != std::ssize(mechanism.coordinates)) {
    refuse(
        fmt::format("the poses have {} coordinates, the mechanism has {}", known.cols(), mechanism.coordinates.size()));
  }
  if (known.array().isInf().any()) refuse("a reading is infinite");
}

Eigen::VectorXd start_of(const Mechanism& mechanism) {
  Eigen::VectorXd start(std::ssize(mechanism.coordinates));
  for (Eigen::Index i = 0; i < start.size(); ++i) start(i) = mechanism.coordinates[i].start;
  return start;
}

// The solved pose whose coordinates are nearest in what is known.
const Eigen::VectorXd& nearest(const std::vector<Eigen::VectorXd>& solved, const Eigen::VectorXd& known,
                               const Eigen::VectorXd& typical) {
  const Eigen::VectorXd* best = &solved.front();
  double least = std::numeric_limits<double>::infinity();
  for (const Eigen::VectorXd& one : solved) {
    double distance = 0.0;
    for (Eigen::Index i = 0; i < known.size(); ++i) {
      const double gap = (known(i) - one(i)) / typical(i);
      if (!std::isnan(gap)) distance += gap * gap;
    }
    if (distance < least) {
      least = distance;
      best = &one;
    }
  }
  return *best;
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
  for (const Definition& definition : mechanism.definitions) {
    check_expression(names, "definition of " + definition.name, definition.text);
    take_name(names, definition.name);
  }
  for (std::size_t i = 0; i < mechanism.equations.size(); ++i) {
    check_expression(names, fmt::format("equation {}", i + 1), mechanism.equations[i]);
  }
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

Assembly assemble(const Mechanism& mechanism, const Eigen::MatrixXd& known) {
  constexpr std::size_t most_neighbours = 200;
  validate(mechanism);
  const Eigen::VectorXd sigma = noise_of(mechanism, known);
  Equations equations(mechanism);
  const Eigen::VectorXd parameters = values_of(mechanism);
  const SolvedPose home = nearest_configuration(equations, parameters, start_of(mechanism));
  if (!home.ok()) refuse("no configuration near the start values: " + home.failure);
  Assembly assembly{.coordinates = Eigen::MatrixXd::Constant(known.rows(), known.cols(), NAN), .failures = {}};
  std::vector<Eigen::VectorXd> solved = {home.coordinates};
  for (Eigen::Index row = 0; row < known.rows(); ++row) {
    const Eigen::VectorXd target = known.row(row);
    const PoseKinds kinds = kinds_of(target, sigma);
    std::string failure;
    if (std::ssize(kinds.unknown) > equations.count()) {
      failure = fmt::format("{} coordinates are not measured, {} equations cannot tell them", kinds.unknown.size(),
                            equations.count());
    } else if (equations.count() > std::ssize(kinds.unknown) + std::ssize(kinds.noisy)) {
      failure = fmt::format(
          "{} equations are beyond what is not measured, and {} readings have noise: state the sigma of more",
          equations.count() - std::ssize(kinds.unknown), kinds.noisy.size());
    } else {
      const Eigen::VectorXd& from = nearest(solved, target, equations.typical());
      SolvedPose pose = follow(equations, parameters, from, target, sigma);
      const bool is_checked = std::ssize(kinds.unknown) < equations.count();
      // A branch that contradicts the readings more than another one is the wrong branch.
      const auto take_better = [&](SolvedPose other) {
        if (!other.ok()) return;
        if (!pose.ok() || (is_checked && other.residual.norm() < pose.residual.norm())) pose = std::move(other);
      };
      if (!pose.ok() || is_checked) take_better(follow(equations, parameters, home.coordinates, target, sigma));
      if (is_checked) {
        take_better(solve_pose(equations, parameters, target, sigma, from));
        take_better(solve_pose(equations, parameters, target, sigma, home.coordinates));
      }
      failure = pose.failure;
      if (pose.ok()) {
        assembly.coordinates.row(row) = pose.coordinates.transpose();
        solved.insert(solved.begin() + 1, pose.coordinates);
        if (solved.size() > most_neighbours) solved.pop_back();
      }
    }
    assembly.failures.push_back(failure);
  }
  return assembly;
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
