// What is the same in every exported robot; "@" stands for the name.
#pragma once

namespace llmt::robotics {

extern const char* const c_kinematics;  // the walk along the chain, loads
extern const char* const c_solution;    // forward model and step

}  // namespace llmt::robotics
