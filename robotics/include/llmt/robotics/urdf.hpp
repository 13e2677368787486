/// \file
/// Arms as URDF files describe them.
#pragma once

#include <string>

#include "llmt/abi.hpp"
#include "llmt/robotics/chain.hpp"
#include "llmt/robotics/urdf_links.hpp"

namespace llmt::robotics {

/// Whether the name of a file ends in ".urdf", in any case, or a file of that name begins as XML does, with "<".
bool is_urdf(const std::string& path);

/// The arm between two links of a URDF as a chain in modified Denavit-Hartenberg convention, exact to rounding: any
/// origin and any axis becomes alpha, a, b, beta, theta, d of Convention::mdh. Frames lie on the common normals of
/// consecutive axes (then b and beta are zero), or, where axes are within 5 degrees of parallel, at the height of the
/// frame before. Joint values keep their zero and direction, joints their names. World is the base link: Chain::base
/// leads from there to the first frame, Chain::tool from the last one to the tip link.
///
/// Fixed joints are folded into origins. Masses are those of the links that a joint carries up to the next one, side
/// branches such as fingers included, at zero. Limits and mimics are kept; a continuous joint has no limits. Meshes,
/// transmissions, friction and inertias about the centres of mass do not matter.
///
/// Throws std::runtime_error `name:line:column: ...` for text that is no XML in UTF-8, has a document type, is nested
/// deeper than 100 elements, or has more than 5000 links or 300 000 elements and comments; and `name: ...` with what is
/// wrong for XML that is no URDF, for links that do not exist or are not joined, have two parents or form a loop,
/// several candidates for the tip (all are listed), more than 100 joints that move, joints that are planar or floating
/// or mimic one that is not between the links, axes of length 0, masses that are no finite number, and a lower limit
/// that is not below the upper one. Limits of 0 and 0 are none, as programs write them that know no limits.
Chain parse_urdf(const std::string& text, const std::string& name, const UrdfLinks& links = {});

/// Reads a file; throws as parse_urdf().
Chain read_urdf(const std::string& path, const UrdfLinks& links = {});

/// A URDF with identified values.
struct IdentifiedUrdf {
  std::string text;
  bool has_tool = false;  ///< the tip link is where the identified tool is
};

/// The URDF `text` with the origins of the joints that move as in `identified`, a chain that began as
/// parse_urdf(text, name, links). Where a fixed joint holds the tip link, and no further links hang on this, the joint
/// gets the identified tool. Everything else in the file stays, comments as well. The base of `identified` does not
/// matter: a URDF has no place for the frame of an instrument. Throws as parse_urdf(), and std::invalid_argument if
/// convention, names, types or directions of the joints are others.
IdentifiedUrdf to_urdf(const std::string& text, const std::string& name, const UrdfLinks& links,
                       const Chain& identified);

}  // namespace llmt::robotics
