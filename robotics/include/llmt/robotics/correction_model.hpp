/// \file
/// The model of a residual correction, a tree or a sum of trees, and its file.
#pragma once

#include <string>
#include <variant>
#include <vector>

#include "llmt/abi.hpp"
#include "llmt/boosted_model.hpp"
#include "llmt/model.hpp"

namespace llmt::robotics {

/// A tree for each output, or a sum of hundreds of small trees.
using Correction = std::variant<Model, BoostedModel>;

const std::vector<InputColumn>& inputs_of(const Correction& correction);
const std::vector<OutputColumn>& outputs_of(const Correction& correction);

/// The text of its file, see to_json() of the two.
std::string to_json(const Correction& correction);

/// Whether a text is such a file by its first words. A description may name any file, and a message about one that is
/// no model must not show its content.
bool is_correction(const std::string& text);

/// Reads it. `name` stands in messages. Throws std::runtime_error as from_json() and boosted_from_json(); for a text
/// that is neither the message shows nothing of it.
Correction correction_from_json(const std::string& text, const std::string& name = "correction");

}  // namespace llmt::robotics
