/// \file
/// Long calls that Ctrl-C ends.
#pragma once

#include <nanobind/nanobind.h>

#include <functional>

#include "llmt/progress.hpp"

namespace llmt::python {

namespace nb = nanobind;

/// Runs `work` in a thread of its own while this thread, which holds the interpreter's lock only for moments, looks for
/// signals and hands progress to `report(done, total, step)`, a callable or None. If a signal's handler or `report`
/// raises, the work is cancelled and the exception leaves this call after the work has ended. The thread has ended when
/// the call returns.
void interruptible(const std::function<void(const Progress&)>& work, const nb::object& report);

/// Raises what the handlers of pending signals raise.
void check_signals();

/// How often check_signals() was called.
long looks_for_signals();

}  // namespace llmt::python
