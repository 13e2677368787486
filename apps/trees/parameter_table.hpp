/// \file
/// Parameters of a simulation as a user gives them: values on the command line, derivatives of the outputs in a table.
#pragma once

#include <string>
#include <vector>

#include "llmt/csv.hpp"
#include "llmt/discovery/simulation.hpp"

namespace llmt::apps {

/// "mass=3.0[kg]": a name, the nominal value, and the unit or none. Throws std::invalid_argument that quotes the text.
discovery::Parameter parse_parameter(const std::string& text);

/// Parameters that texts as above give; throws also for a name that is there twice.
std::vector<discovery::Parameter> parse_parameters(const std::vector<std::string>& texts);

/// Derivatives by parameters, n x d each.
struct ParameterTable {
  std::vector<discovery::Parameter> parameters;
  std::vector<Eigen::MatrixXd> derivatives;
  std::vector<std::string> without_nominal;  ///< parameters that `given` does not have; their value is 0
};

/// Reads a table with a row for each row of the inputs. Columns of inputs must hold the same numbers as there. Every
/// other column is a derivative: "OUTPUT:PARAMETER", or "PARAMETER" where there is one output. An output without a
/// column does not depend on the parameter. Throws std::runtime_error that names the file, and line or column, for a
/// table that does not fit, and std::invalid_argument for a parameter in `given` that it does not have.
ParameterTable read_parameter_table(const std::string& path, DecimalMark mark,
                                    const std::vector<discovery::Parameter>& given, const discovery::Inputs& inputs,
                                    const std::vector<std::string>& outputs);

}  // namespace llmt::apps
