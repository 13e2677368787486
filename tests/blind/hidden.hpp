/// \file
/// Physical effects that a case may hide, each in the engine or formula of its own.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "blind/arms.hpp"
#include "blind/session.hpp"
#include "blind/statics.hpp"

namespace blind {

/// A true value. `location`: "joint2", or "" for the whole robot.
struct TrueParameter {
  std::string name, location;
  double value;
  std::string unit;
};

/// One hidden effect: what gives way (MuJoCo), or what changes in every row of a session (formulas), or neither.
struct Hidden {
  std::string kind;
  std::vector<std::string> locations;  ///< empty: the whole robot
  std::vector<TrueParameter> parameters;
  std::function<void(Elasticity&)> elastic;
  std::function<void(const Session&, std::vector<Change>&)> change;
};

/// What an effect is drawn for.
struct Scene {
  const Arm& arm;  ///< as built
  const Pieces& pieces;
  const ArmScale& scale;
  const Session& measured;
  const Elasticity& described;  ///< what the description already knows
  llmt::Random& random;

  int joints() const { return arm.size(); }
  int pick(int low, int high) const {
    return low + static_cast<int>(random.below(static_cast<std::uint64_t>(high - low + 1)));
  }
};

/// Draws an effect of that kind within the industrial ranges. Throws std::invalid_argument for an unknown kind.
Hidden draw(const std::string& kind, const Scene& scene);

/// Kinds of the catalogue that an arm can show, and kinds that are in no catalogue.
std::vector<std::string> catalogue_kinds(const Arm& arm);
std::vector<std::string> unknown_kinds();

/// Whether a tool can be asked for its name.
bool in_catalogue(const std::string& kind);

/// The name that a tool should give: of most kinds the kind itself.
std::string family(const std::string& kind);

/// Whether the description of a case with this kind holds the true compliance of two joints.
bool needs_elastic_description(const std::string& kind);

std::string joint_name(int joint);

// By source; each returns false if the kind is not its own.
bool draw_elastic(Hidden& hidden, const Scene& scene);
bool draw_drive(Hidden& hidden, const Scene& scene);
bool draw_frame(Hidden& hidden, const Scene& scene);
bool draw_unknown(Hidden& hidden, const Scene& scene);

}  // namespace blind
