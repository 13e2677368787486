/// \file
/// A crisp model as rules and as a tree, in text that a person reads.
#pragma once

#include <string>

#include "llmt/model.hpp"
#include "report/text/text.hpp"

namespace llmt::report {

/// True if a crisp model is what its rules say: no guard acts between the smallest and the largest value of each input,
/// and a missing value counts as the mean.
bool says_all(const Model& model);

/// The rules of every target, the tree that they come from, the inputs that they use, and what they leave unsaid. Lines
/// have at most 100 columns where names allow it. Throws std::runtime_error that says why if the model is not crisp:
/// its rules would not be its predictions. `name`: of the model, for the first line and for messages. `width`: of the
/// table of inputs.
std::string rules_text(const Model& model, const std::string& name, std::size_t width = no_width_limit);

}  // namespace llmt::report
