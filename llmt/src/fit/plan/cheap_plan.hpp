/// \file
/// The plan by which forms of the inputs are compared: fewer of them, or some as categories.
#pragma once

#include "fit/plan/defaults.hpp"

namespace llmt {

/// plan_of() with few candidates, the same for all forms, and small trees.
Plan cheap_plan(const Training& training);

}  // namespace llmt
