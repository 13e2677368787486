// The constraint equations of a mechanism, compiled.
#pragma once

#include <Eigen/Core>
#include <cmath>
#include <map>
#include <string>
#include <vector>

#include "expressions/expression.hpp"
#include "llmt/robotics/mechanism/mechanism_types.hpp"

namespace llmt::robotics {

/// Evaluates f(d, c): d are all parameters, c all coordinates, in their units. One thread at a time.
class Equations {
 public:
  /// The mechanism must be validated.
  explicit Equations(const Mechanism& mechanism);

  Eigen::Index count() const { return std::ssize(equations_); }

  Eigen::VectorXd values(const Eigen::VectorXd& parameters, const Eigen::VectorXd& coordinates);

  /// df/dc and df/dd by central differences of fourth order, equations x coordinates and equations x parameters.
  Eigen::MatrixXd by_coordinates(const Eigen::VectorXd& parameters, const Eigen::VectorXd& coordinates);
  Eigen::MatrixXd by_parameters(const Eigen::VectorXd& parameters, const Eigen::VectorXd& coordinates);

  /// The scale of each coordinate where mm and deg meet: the mechanism's largest length, 1 rad.
  const Eigen::VectorXd& typical() const { return typical_; }

 private:
  // An expression and where its variables stand in symbols_.
  struct Compiled {
    Expression expression;
    std::vector<Eigen::Index> places;
    std::vector<double> variables;
  };

  Eigen::VectorXd factors_;  // from the units of parameters and coordinates to mm, rad, 1
  Eigen::VectorXd typical_;  // per coordinate
  Eigen::VectorXd symbols_;  // parameters, coordinates, definitions
  Eigen::VectorXd steps_;    // of differences, per parameter and coordinate, in mm, rad, 1
  std::vector<Compiled> definitions_;
  std::vector<Compiled> equations_;

  void set(const Eigen::VectorXd& parameters, const Eigen::VectorXd& coordinates);
  Eigen::VectorXd evaluate();
  Eigen::MatrixXd differences(Eigen::Index first, Eigen::Index count);
};

/// The coordinates in degrees whose whole turns change no equation: tried at some configurations about the start
/// values. The angle of a leadscrew is none of them.
std::vector<Eigen::Index> turning_coordinates(const Mechanism& mechanism);

/// The whole turns, in degrees, that are nearest to an angle in degrees.
inline double whole_turns(double angle) { return 360.0 * std::round(angle / 360.0); }

/// The start values of the coordinates, in their units.
Eigen::VectorXd start_of(const Mechanism& mechanism);

/// The values of the parameters, in their units.
Eigen::VectorXd values_of(const Mechanism& mechanism);

/// The place of an equation's "=" that is no part of a comparison; npos if there is none.
std::size_t sign_of(const std::string& equation);

/// "a = b" as an expression that is 0: "(a) - (b)"; other texts as they are. The only "=" is that of the equation.
std::string as_zero(const std::string& equation);

/// Names that stand for numbers in the expressions of mechanisms: pi.
const std::map<std::string, double>& expression_constants();

}  // namespace llmt::robotics
