// Patterns that no cause of the catalogue need have: they carry the answer "unknown effect".
#pragma once

#include <vector>

#include "hypotheses/hypothesis.hpp"
#include "hypotheses/scene.hpp"

namespace llmt::robotics {

/// Patterns: smooth in one joint, local in one joint, of two joints, of the load, of the tool's orientation, of
/// covariates.
std::vector<Hypothesis> pattern_hypotheses(const Scene& scene);

}  // namespace llmt::robotics
