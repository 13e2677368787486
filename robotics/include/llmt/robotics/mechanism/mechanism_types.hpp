/// \file
/// The parts of a mechanism, and its configurations.
///
///     Mechanism crank{.name = "crank"};
///     crank.parameters = {{.name = "r", .unit = "mm", .value = 50.0}};
///     crank.coordinates = {{.name = "q", .unit = "deg"}, {.name = "x", .unit = "mm", .output = true}};
///     crank.equations = {"r*cos(q) = x"};
#pragma once

#include <Eigen/Core>
#include <limits>
#include <optional>
#include <string>
#include <vector>

#include "llmt/abi.hpp"

namespace llmt::robotics {

/// One of the parameters d: a dimension, a sensor's offset, a place of the measuring instrument.
struct MechanismParameter {
  std::string name;
  std::string unit = "mm";                    ///< "mm", "deg" or "1"; in expressions mm, rad and 1
  double value = 0.0;                         ///< in `unit`
  bool fixed = false;                         ///< calibration leaves it alone
  std::optional<double> prior_sigma = {};     ///< standard deviation about `value` of real ones, in `unit`; > 0
  std::optional<double> standard_error = {};  ///< written by calibration, in `unit`
};

/// A coordinate of a joint (s) or of the output (w). A table may have it or not: what is not measured is solved for.
struct Coordinate {
  std::string name;
  std::string unit = "deg";  ///< "mm", "deg" or "1"; in expressions mm, rad and 1
  double start = 0.0;        ///< in `unit`; all starts together are close to a configuration that can be assembled
  bool output = false;       ///< one of w
  std::optional<double> sigma = {};  ///< standard deviation of its readings in `unit`; 0: exact; empty: see noise_of()
  double lower = -std::numeric_limits<double>::infinity();  ///< limits of a drive, in `unit`
  double upper = std::numeric_limits<double>::infinity();

  bool has_limits() const { return lower > -std::numeric_limits<double>::infinity(); }
};

/// An abbreviation that equations and later definitions use.
struct Definition {
  std::string name;
  std::string text;
};

/// A mechanism. Expressions are those of llmt::Expression (muParser's language) in the names of parameters, coordinates
/// and earlier definitions, and pi; angles are in rad, lengths in mm.
struct Mechanism {
  std::string name;
  std::vector<MechanismParameter> parameters;
  std::vector<Coordinate> coordinates;
  std::vector<Definition> definitions = {};
  std::vector<std::string> equations;  ///< "left = right", or an expression that is 0
};

/// Configurations that meet the equations.
struct Assembly {
  Eigen::MatrixXd coordinates;        ///< poses x coordinates, in their units; NaN where it failed
  std::vector<std::string> failures;  ///< per pose: why there is no configuration; empty where there is
};

}  // namespace llmt::robotics
