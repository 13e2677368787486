/// \file
/// The search for the physical effect that a robot model lacks: find the gap to the measurements, name it, add it,
/// verify.
///
///     const Robot robot = read_robot("arm.yaml");
///     const Discovery found = discover(robot, read_measurements("measured.csv", robot));
///     for (const FoundEffect& effect : found.effects) std::puts(effect.title.c_str());
///     save(found.improved.robot, "improved.yaml");
#pragma once

#include <optional>

#include "llmt/robotics/discovery/discovery_options.hpp"
#include "llmt/robotics/discovery/discovery_result.hpp"
#include "llmt/robotics/measurements.hpp"

namespace llmt::robotics {

/// Finds the effects that are missing from the robot. `test` is used once, at the end, to verify; without it a share of
/// the measurements is set aside for that. The improved robot is fitted to all other measurements.
///
/// Throws as calibrate(), and std::invalid_argument if there are too few poses to leave any freedom.
Discovery discover(const Robot& robot, const Measurements& measurements, const std::optional<Measurements>& test = {},
                   const DiscoveryOptions& options = {});

}  // namespace llmt::robotics
