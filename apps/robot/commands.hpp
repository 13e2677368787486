/// \file
/// The subcommands of the program llmt-robot. Each adds itself to the program and runs when it is called.
#pragma once

#include <CLI/CLI.hpp>
#include <string>

#include "llmt/csv.hpp"
#include "llmt/robotics/correction.hpp"
#include "llmt/robotics/measurements.hpp"
#include "llmt/robotics/robot.hpp"
#include "llmt/robotics/urdf.hpp"

namespace llmt::apps {

/// The robot's description. Throws as robotics::read_robot(), and std::invalid_argument if the description and the
/// measurements were exchanged.
robotics::Robot read_description(const std::string& robot, const std::string& measured,
                                 const robotics::UrdfLinks& links = {});

/// The arm as it moves, for those who command it: the description and its correction without errors of the instrument
/// or its session, which are named on standard error. Throws as robotics::read_corrected_robot().
robotics::CorrectedRobot read_arm(const std::string& path, const robotics::UrdfLinks& links);

/// --base-link and --tip-link: which part of a URDF is the arm.
void add_urdf_links(CLI::App& command, robotics::UrdfLinks& links);

/// A table of ours, whose cells are numbers, words without points and commas, and quoted names, with that mark in its
/// numbers: with a decimal comma its fields are separated by semicolons.
std::string with_decimal_mark(std::string csv, DecimalMark mark);

/// The links to read a URDF beside a robot with: those that were given or, without any, those that the robot's
/// description remembers; none for a file that is no URDF.
robotics::UrdfLinks links_for(const std::string& path, const robotics::UrdfLinks& given, const robotics::Robot& robot);

void add_paper(CLI::App& app);
void add_demo(CLI::App& app);
void add_simulate(CLI::App& app);
void add_poses(CLI::App& app);
void add_calibrate(CLI::App& app);
void add_check(CLI::App& app);
void add_mechanism(CLI::App& app);
void add_discover(CLI::App& app);
void add_predict(CLI::App& app);
void add_compensate(CLI::App& app);
void add_robot_export(CLI::App& app);

}  // namespace llmt::apps
