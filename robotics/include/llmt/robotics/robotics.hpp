#pragma once

/// \file
/// Umbrella header of llmt::robotics.

#include "llmt/abi.hpp"
