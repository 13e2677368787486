#include "fit/named.hpp"

#include <algorithm>
#include <string>
#include <vector>

namespace llmt {

Model named(const Model& model, const TrainingData& data) {
  if (data.input_names.empty() && data.output_names.empty() && data.levels.empty()) return model;
  std::vector<std::string> inputs = data.input_names;
  std::vector<std::string> outputs = data.output_names;
  std::vector<std::vector<std::string>> levels = data.levels;
  levels.resize(model.inputs().size());
  for (std::size_t j = 0; j < levels.size(); ++j) {
    const InputColumn& input = model.inputs()[j];
    if (data.input_names.empty()) inputs.push_back(input.name);
    if (levels[j].empty() && input.codes.empty()) levels[j] = input.levels;
    if (input.has_empty_level() && levels[j].size() + 1 == input.levels.size()) levels[j].emplace_back();
    levels[j].resize(std::min(levels[j].size(), input.levels.size()));
  }
  for (std::size_t o = 0; o < model.outputs().size() && data.output_names.empty(); ++o) {
    outputs.push_back(model.outputs()[o].name);
  }
  return model.named(inputs, outputs, levels);
}

}  // namespace llmt
