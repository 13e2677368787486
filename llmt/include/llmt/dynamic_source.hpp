/// \file
/// A model of a system that moves as C source, for controllers.
#pragma once

#include <string>

#include "llmt/abi.hpp"
#include "llmt/c_code.hpp"
#include "llmt/dynamic_model.hpp"

namespace llmt {

/// Simulator as C99: a struct NAME_state of fixed size and two functions
///
///     void NAME_start(struct NAME_state *state, int rows, const double *inputs, const double *outputs);
///     int NAME_step(struct NAME_state *state, const double *inputs, double *outputs);
///
/// They allocate no memory and do not recurse; a step takes a bounded time. Compiled as to_c() of a Model asks, a run
/// has the bytes of simulate(). NAME_step() returns 1 and changes nothing where a value is not finite. Throws
/// std::invalid_argument if `name` is no identifier of C.
CSource to_c(const DynamicModel& model, const std::string& name, const std::string& header_name);

}  // namespace llmt
