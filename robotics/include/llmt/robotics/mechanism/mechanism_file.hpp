/// \file
/// Mechanisms in YAML, and their readings in CSV.
///
///     const Mechanism mechanism = read_mechanism("five_bar.yaml");
///     const MechanismTable table = read_mechanism_table("measured.csv", mechanism);
#pragma once

#include <Eigen/Core>
#include <string>
#include <vector>

#include "llmt/abi.hpp"
#include "llmt/csv.hpp"
#include "llmt/robotics/mechanism/mechanism.hpp"

namespace llmt::robotics {

/// Reads a mechanism. Units stand in the keys; a number without a unit has none:
///
///     mechanism: crank
///     parameters:                      # fixed, prior (a standard deviation about the value) and standard_error are
///     optional
///       - {name: r, value_mm: 50, prior_mm: 0.5, standard_error_mm: 0.01}
///       - {name: offset, value_deg: 0, fixed: true}
///     joints:                          # limits (of a drive) and sigma (noise of the readings) are optional
///       - {name: q, start_deg: 60, limits_deg: [0, 170], sigma_deg: 0.001}
///     outputs:
///       - {name: x, start_mm: 25}
///     definitions: {c: cos(q + offset)}   # optional; each may use those before it
///     equations:
///       - r*c = x
///
/// Throws std::runtime_error `path:line: where: what` for a file that cannot be read or is no YAML, for unknown,
/// repeated or missing keys, for more than 16 MiB, 1000 parameters or definitions, 100 joints or outputs, or 200
/// equations, and for whatever validate(Mechanism) refuses.
Mechanism read_mechanism(const std::string& path);

/// As read_mechanism(), from memory; `name` stands for the path in messages.
Mechanism parse_mechanism(const std::string& text, const std::string& name);

/// The description as text. Reading it gives the same mechanism, every number to the last bit.
std::string to_yaml(const Mechanism& mechanism);

/// Writes to_yaml() to a file that appears whole or not at all. Throws std::runtime_error naming the path.
void save(const Mechanism& mechanism, const std::string& path);

/// Poses of a mechanism as a table has them.
struct MechanismTable {
  Eigen::MatrixXd values;           ///< poses x coordinates, in their units; NaN where there is no reading
  std::vector<Eigen::Index> lines;  ///< of the file, per pose
  std::vector<std::string> unused;  ///< columns that are no coordinate
};

/// Reads a table whose columns are coordinates with their units: q_deg or q_rad, x_mm, x_m or x_um, a plain name for a
/// coordinate of unit 1. A coordinate without a column and an empty cell are not measured.
///
/// Throws std::runtime_error as Csv::read(), and with path, line and column for cells that are no numbers (nan and NA,
/// which programs write where something failed, among them), for a column
/// of a coordinate with a wrong unit or none, for two columns of one coordinate, and if there is no pose or no
/// coordinate.
MechanismTable read_mechanism_table(const std::string& path, const Mechanism& mechanism,
                                    DecimalMark mark = DecimalMark::point);

/// Poses as such a table: the coordinates named, in the units of the mechanism, every number to the last bit; an empty
/// cell for NaN. Throws std::invalid_argument for an unknown coordinate.
std::string to_csv(const Mechanism& mechanism, const Eigen::MatrixXd& poses, const std::vector<std::string>& names);

}  // namespace llmt::robotics
