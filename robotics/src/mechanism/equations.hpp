// The constraint equations of a mechanism, compiled.
#pragma once

#include <Eigen/Core>
#include <map>
#include <string>
#include <vector>

#include "expressions/expression.hpp"
#include "llmt/robotics/mechanism.hpp"

namespace llmt::robotics {

/// Evaluates f(d, c): d are all parameters, c all coordinates, in their units. One thread at a time.
class Equations {
 public:
  /// Of a validated mechanism.
  explicit Equations(const Mechanism& mechanism);

  Eigen::Index count() const { return std::ssize(equations_); }

  Eigen::VectorXd values(const Eigen::VectorXd& parameters, const Eigen::VectorXd& coordinates);

  /// df/dc and df/dd by central differences of fourth order, equations x coordinates and equations x parameters.
  Eigen::MatrixXd by_coordinates(const Eigen::VectorXd& parameters, const Eigen::VectorXd& coordinates);
  Eigen::MatrixXd by_parameters(const Eigen::VectorXd& parameters, const Eigen::VectorXd& coordinates);

  /// What a coordinate of that unit is measured against where mm and deg meet: the mechanism's largest length, 1 rad.
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

/// The values of the parameters, in their units.
Eigen::VectorXd values_of(const Mechanism& mechanism);

/// "a = b" as an expression that is 0: "(a) - (b)"; other texts as they are. The only "=" is that of the equation.
std::string as_zero(const std::string& equation);

/// Names that stand for numbers in the expressions of mechanisms: pi.
const std::map<std::string, double>& expression_constants();

}  // namespace llmt::robotics
