/// \file
/// A crisp model as rules and as a tree, in text that a person reads.
#pragma once

#include <string>

#include "llmt/model.hpp"

namespace llmt::apps {

/// The rules of every target, the tree that they come from, the inputs that they use, and what they leave unsaid. Lines
/// have at most 100 columns where names allow it. Throws std::runtime_error that says why if the model is not crisp:
/// its rules would not be its predictions. `path`: of the model, for messages.
std::string rules_text(const Model& model, const std::string& path);

}  // namespace llmt::apps
