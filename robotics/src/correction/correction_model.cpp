#include "llmt/robotics/correction_model.hpp"

#include <fmt/format.h>

#include <stdexcept>

namespace llmt::robotics {

namespace {

bool is_sum(const std::string& text) { return text.find("\"llmt-boosted-model\"") != std::string::npos; }

bool is_tree(const std::string& text) { return text.find("\"llmt-model\"") != std::string::npos; }

}  // namespace

const std::vector<InputColumn>& inputs_of(const Correction& correction) {
  return std::visit([](const auto& model) -> const std::vector<InputColumn>& { return model.inputs(); }, correction);
}

const std::vector<OutputColumn>& outputs_of(const Correction& correction) {
  return std::visit([](const auto& model) -> const std::vector<OutputColumn>& { return model.outputs(); }, correction);
}

std::string to_json(const Correction& correction) {
  return std::visit([](const auto& model) { return llmt::to_json(model); }, correction);
}

bool is_correction(const std::string& text) { return is_sum(text) || is_tree(text); }

Correction correction_from_json(const std::string& text, const std::string& name) {
  if (is_sum(text)) return boosted_from_json(text, name);
  if (!is_tree(text)) throw std::runtime_error(fmt::format("{} is no model", name));
  return from_json(text, name);
}

}  // namespace llmt::robotics
