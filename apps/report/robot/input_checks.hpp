/// \file
/// What is said of inputs that do not suit a robot, with the names of their files.
#pragma once

#include <functional>
#include <optional>
#include <string>

#include "llmt/finding.hpp"
#include "llmt/robotics/correction.hpp"
#include "llmt/robotics/measurements.hpp"
#include "llmt/robotics/robot.hpp"

namespace llmt::report {

/// Takes what people should know although the work goes on.
using Warn = std::function<void(const Finding& finding)>;

/// Throws std::runtime_error, with the name of the robot's file, if a tool position at these poses makes no sense.
void check_positions(const std::string& file, const robotics::Robot& robot, const robotics::Poses& poses);

/// Throws std::runtime_error, with file and line, where measurements name a session or a target that the robot does not
/// have. `advice` ends the message.
void check_frames(const std::string& file, const robotics::Robot& robot, const robotics::Measurements& measurements,
                  const std::string& advice);

/// A finding if half or more of the test readings stand among the measurements, number by number: they took part, and
/// their error is no test.
std::optional<Finding> tests_that_took_part(const robotics::Measurements& measurements,
                                            const robotics::Measurements& test);

/// The arm as it moves, for those who command it: without errors of the instrument or its session. `warn` gets their
/// names. `file`: of the robot.
robotics::CorrectedRobot arm_alone(const std::string& file, robotics::CorrectedRobot robot, const Warn& warn);

/// Warns of the columns that effects need and that were not given.
void name_made_up(const robotics::Poses& given, const robotics::Poses& completed, const Warn& warn);

/// Warns of poses beyond the ranges that the robot was calibrated in.
void name_uncovered(const robotics::Robot& robot, const robotics::Poses& used, const Warn& warn);

/// What positions of the arm are, and in which frame: "of the tool, in the frame of the instrument". `used`: what the
/// rows name, none: the chain's own frames.
std::string frames_text(const robotics::Chain& chain, const robotics::Poses& used = {});

/// What orientations of the file are used for, in two sentences; empty if there are none.
std::string use_of_orientations(const robotics::Measurements& measurements, const Face& face);

}  // namespace llmt::report
