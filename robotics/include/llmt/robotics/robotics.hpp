/// \file
/// Umbrella header of llmt::robotics.
///
///     const Robot arm = read_robot("arm.yaml");
///     const Measurements seen = read_measurements("measured.csv", arm);
///     const CalibrationReport report = report_calibration(arm, seen);
#pragma once

#include "llmt/abi.hpp"
#include "llmt/robotics/calibration.hpp"
#include "llmt/robotics/calibration_options.hpp"
#include "llmt/robotics/calibration_problem.hpp"
#include "llmt/robotics/calibration_quality.hpp"
#include "llmt/robotics/calibration_report.hpp"
#include "llmt/robotics/catalogue.hpp"
#include "llmt/robotics/chain.hpp"
#include "llmt/robotics/compensation.hpp"
#include "llmt/robotics/correction.hpp"
#include "llmt/robotics/correction_model.hpp"
#include "llmt/robotics/discovery/discovery.hpp"
#include "llmt/robotics/discovery/discovery_options.hpp"
#include "llmt/robotics/discovery/discovery_result.hpp"
#include "llmt/robotics/discovery/discriminating_poses.hpp"
#include "llmt/robotics/effect_type.hpp"
#include "llmt/robotics/effects.hpp"
#include "llmt/robotics/kinematics.hpp"
#include "llmt/robotics/likely_mistake.hpp"
#include "llmt/robotics/measurements.hpp"
#include "llmt/robotics/mechanism/mechanism.hpp"
#include "llmt/robotics/mechanism/mechanism_calibration.hpp"
#include "llmt/robotics/mechanism/mechanism_file.hpp"
#include "llmt/robotics/mechanism/mechanism_types.hpp"
#include "llmt/robotics/observability.hpp"
#include "llmt/robotics/orientation.hpp"
#include "llmt/robotics/pose_selection.hpp"
#include "llmt/robotics/pose_selection_options.hpp"
#include "llmt/robotics/rigid_arm.hpp"
#include "llmt/robotics/robot.hpp"
#include "llmt/robotics/robot_c_source.hpp"
#include "llmt/robotics/robot_check.hpp"
#include "llmt/robotics/robot_file.hpp"
#include "llmt/robotics/robot_types.hpp"
#include "llmt/robotics/simulation.hpp"
#include "llmt/robotics/urdf.hpp"
