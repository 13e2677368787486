/// \file
/// Bounds of what is read, so that no file takes all memory, all time or the stack. One table for all formats, those of
/// robots too: the readers take their numbers from it, docs/threat-model.md prints it, and a test asks each of them.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <string_view>

namespace llmt {

/// What is bounded; limit_table says it in words.
enum class Limit {
  table_line,
  arrow_metadata,
  arrow_columns,
  arrow_batches,
  arrow_word,
  magnitude,
  quadratic_magnitude,
  categories,
  categories_beyond_memory,
  model_bytes,
  model_values,
  json_levels,
  json_members,
  model_splits_above_leaf,
  listed_sides,
  sum_leaf_slopes,
  sum_trials,
  description_bytes,
  yaml_nodes,
  expression_characters,
  mechanism_parameters,
  mechanism_coordinates,
  mechanism_equations,
  robot_joints,
  robot_effects,
  robot_effect_values,
  urdf_levels,
  urdf_attributes,
  urdf_nodes,
  urdf_links,
  simulated_poses,
  symbolic_links,
  message_bytes,
};

/// How a limit is printed.
enum class LimitUnit { count, bytes, power };

struct LimitRow {
  Limit limit = Limit::table_line;
  std::string_view what;  ///< in the words of docs/threat-model.md
  double most = 0.0;      ///< what is still taken
  LimitUnit unit = LimitUnit::count;
  std::string_view beyond;  ///< what happens to more
};

inline constexpr std::array limit_table = std::to_array<LimitRow>({
    {Limit::table_line, "line of a table; with `--stream` also a row with line breaks in quotes", 16 << 20,
     LimitUnit::bytes, "refused"},
    {Limit::arrow_metadata, "metadata of an Arrow file: its footer, and those of a batch", 1 << 28, LimitUnit::bytes,
     "refused with file and batch"},
    {Limit::arrow_columns, "columns of an Arrow file", 1'000'000, LimitUnit::count, "refused"},
    {Limit::arrow_batches, "batches of an Arrow file, and its dictionaries", 1'000'000, LimitUnit::count, "refused"},
    // A row names a word in one byte, and 65 536 rows are read at a time: 256 MiB.
    {Limit::arrow_word, "word of a dictionary of an Arrow file, bytes", 4096, LimitUnit::count,
     "refused with file and column where it is read"},
    {Limit::magnitude, "magnitude of a number to learn from", 1e150, LimitUnit::power,
     "refused with file, line and column"},
    {Limit::quadratic_magnitude, "the same with `--local-models quadratic`", 1e70, LimitUnit::power,
     "refused with file, line and column"},
    {Limit::categories, "categories of an input, in a table and in a model", 10'000, LimitUnit::count,
     "refused with file, line and column, or place"},
    {Limit::categories_beyond_memory, "categories of an input of a fit beyond one memory", 255, LimitUnit::count,
     "refused with the input's name"},
    {Limit::model_bytes, "model (JSON)", 1 << 28, LimitUnit::bytes, "refused, and not written"},
    // A value takes up to 64 bytes, as an empty text does, however short it is in the file.
    {Limit::model_values, "values of a model, containers counted", 1 << 24, LimitUnit::count,
     "refused, and not written"},
    {Limit::json_levels, "levels of JSON within each other", 32, LimitUnit::count, "refused"},
    {Limit::json_members, "members of a JSON object", 100, LimitUnit::count, "refused"},
    // Explaining a prediction and writing rules cost time in proportion to leaves times levels.
    {Limit::model_splits_above_leaf, "splits above a leaf of a tree, also of a sum of trees", 2000, LimitUnit::count,
     "refused with file and place"},
    // Some 400 MB: in a chain of oblique splits the leaves have as many sides as the square of their number.
    {Limit::listed_sides, "sides and levels of the boxes of all leaves, where they are listed", 100'000'000,
     LimitUnit::count, "refused with the tree's number"},
    {Limit::sum_leaf_slopes, "slopes in a leaf of a sum of trees", 12, LimitUnit::count, "refused with file and place"},
    // A leaf of 12 slopes at its limits may need 4095, the trees of fits need some ten.
    {Limit::sum_trials, "inputs taken one by one to explain a tree of a sum, for a row and a row of the background",
     10'000, LimitUnit::count, "refused with the tree's place"},
    {Limit::description_bytes, "robot description, mechanism, catalogue, terms", 1 << 24, LimitUnit::bytes, "refused"},
    {Limit::yaml_nodes, "keys, values and lists of a YAML file", 300'000, LimitUnit::count,
     "refused with file and line"},
    {Limit::expression_characters, "expression, characters", 10'000, LimitUnit::count, "refused with file and line"},
    {Limit::mechanism_parameters, "parameters of a mechanism, and its definitions", 1000, LimitUnit::count,
     "refused with file and line"},
    {Limit::mechanism_coordinates, "joints of a mechanism, and its outputs", 100, LimitUnit::count,
     "refused with file and line"},
    {Limit::mechanism_equations, "equations of a mechanism", 200, LimitUnit::count, "refused with file and line"},
    {Limit::robot_joints, "joints of a robot", 100, LimitUnit::count, "refused with file and line"},
    {Limit::robot_effects, "effects of a robot", 1000, LimitUnit::count, "refused with file and line"},
    {Limit::robot_effect_values, "values of all effects of a robot", 10'000, LimitUnit::count,
     "refused with file and line"},
    {Limit::urdf_levels, "levels of elements of a URDF", 100, LimitUnit::count, "refused with file, line and column"},
    {Limit::urdf_attributes, "attributes of an element of a URDF", 100, LimitUnit::count,
     "refused with file, line and column"},
    {Limit::urdf_nodes, "elements, comments and the like of a URDF", 300'000, LimitUnit::count,
     "refused with file, line and column"},
    {Limit::urdf_links, "links of a URDF", 5000, LimitUnit::count, "refused with file, line and column"},
    {Limit::simulated_poses, "poses of `--poses` and `--simulate`", 1'000'000, LimitUnit::count, "refused"},
    {Limit::symbolic_links, "symbolic links from an output to its file", 40, LimitUnit::count, "refused"},
    {Limit::message_bytes, "message, bytes", 2000, LimitUnit::count, "its middle is left out"},
});

// The rows stand in the order of the enumeration.
static_assert([] {
  for (std::size_t k = 0; k < limit_table.size(); ++k) {
    if (limit_table[k].limit != static_cast<Limit>(k)) return false;
  }
  return true;
}());

/// What is still taken.
constexpr double bound(Limit limit) { return limit_table[static_cast<std::size_t>(limit)].most; }

/// The same of a number that is whole.
constexpr std::int64_t most(Limit limit) { return static_cast<std::int64_t>(bound(limit)); }

}  // namespace llmt
