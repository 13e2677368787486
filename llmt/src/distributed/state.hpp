/// \file
/// What a distributed fit knows between two passes, as plain data that is written as bytes.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <tuple>
#include <vector>

#include "base/sums.hpp"
#include "llmt/distributed.hpp"
#include "llmt/limits.hpp"
#include "numerics/gram.hpp"

namespace llmt::distributed {

/// Categories of an input: as many as bins of a number may be.
inline constexpr std::size_t most_levels = most(Limit::categories_beyond_memory);

/// The joint equations of the sample's tree have at most so many unknowns: 8 MB.
inline constexpr Eigen::Index most_unknowns = 1000;

/// Text that base/sums.hpp writes.
using Text = std::vector<char>;

inline Text to_text(std::string_view from) { return {from.begin(), from.end()}; }
inline std::string to_string(const Text& from) { return {from.begin(), from.end()}; }
inline std::vector<std::string> to_strings(const std::vector<Text>& from) {
  std::vector<std::string> to;
  for (const Text& text : from) to.push_back(to_string(text));
  return to;
}

/// The options of a fit as they are written.
struct KeptOptions {
  Eigen::Index branch_rows = 0;
  Eigen::Index sample_rows = 0;  ///< no more than branch_rows
  Eigen::Index block_rows = 0;
  Eigen::Index weighted = 0;
  Eigen::Index may_have_codes = 0;
  Text fit;  ///< of kept()

  static auto fields(auto& self) {
    return std::tie(self.branch_rows, self.sample_rows, self.block_rows, self.weighted, self.may_have_codes, self.fit);
  }
};

/// What becomes of a node.
enum class Fate : Eigen::Index {
  open,    ///< has more rows than one memory holds; the sums of its bins are asked for
  inner,   ///< is split
  leaf,    ///< cannot be split: its local model is that of its sums
  branch,  ///< its rows are brought together and fit() finishes it
  done     ///< fit() has finished it
};

/// A node of the top of the tree. Its regressors are the inputs that are numbers, scaled: z = (x - mean) / scale.
struct TopNode {
  Fate fate = Fate::open;
  Eigen::Index left = -1;
  Eigen::Index right = -1;
  Eigen::Index input = -1;
  double threshold = 0.0;
  std::vector<Eigen::Index> level_side;  ///< of each level of a category that is split: -1 left, 1 right, 0 no row
  Eigen::Index rows = 0;
  double weight = 0.0;  ///< of the rows, see StateData::weight_scale
  /// Constant and slopes in z, of a model near that of the node: residuals in the sums are those of this model.
  Eigen::VectorXd base;
  std::vector<double> gram;      ///< of [1, z, residual], as GramShape has it, over all rows; empty: not known
  std::vector<double> held_out;  ///< the same over the rows of held-out blocks
  Eigen::VectorXd low;           ///< range of z over the rows
  Eigen::VectorXd high;
  Text branch;                 ///< done: the model that fit() made, as JSON
  double held_out_rmse = 0.0;  ///< done: of that model; NaN: none

  static auto fields(auto& self) {
    return std::tie(self.fate, self.left, self.right, self.input, self.threshold, self.level_side, self.rows,
                    self.weight, self.base, self.gram, self.held_out, self.low, self.high, self.branch,
                    self.held_out_rmse);
  }
};

struct StateData {
  KeptOptions options;
  std::vector<Text> input_names;
  Text output_name;
  std::vector<std::vector<Text>> levels;  ///< of every input: names of its categories; none: numbers
  Step step = Step::describe;
  Eigen::Index passes = 0;
  Eigen::Index blocks = 0;  ///< of the table, and its rows; known after the first pass
  Eigen::Index rows = 0;
  std::uint64_t fingerprint = 0;                  ///< of the rows: BlockSum::fingerprint
  double weight = 0.0;                            ///< of all rows; their number where they have no weights
  double weight_scale = 1.0;                      ///< what given weights are multiplied by
  std::vector<Extent> range;                      ///< of every input, and of the output
  Eigen::VectorXd mean;                           ///< of every input, and of the output
  Eigen::VectorXd scale;                          ///< what inputs are divided by, and the output
  std::vector<std::vector<double>> edges;         ///< of every input's bins: bin b holds edges[b - 1] < x <= edges[b]
  std::vector<std::vector<double>> level_weight;  ///< of every level of a category: of all rows; if the root has sums
  std::vector<TopNode> nodes;                     ///< children behind their parents, in pairs
  std::vector<Eigen::Index> asked;                ///< nodes of the next pass, ascending
  Extent root_residual;                           ///< of the root's model, in units of the output
  Text model;                   ///< of top and branches, or finished: JSON, with intervals if there are any
  Text sample_model;            ///< the tree of the sample, as fit() made it: JSON; empty: there is none
  double sample_rmse = 0.0;     ///< is_blended: its expected error on new rows (W.4)
  Eigen::Index is_blended = 0;  ///< finished: the model is the tree of the sample

  // Not part of the bytes.
  std::uint64_t mark = 0;       ///< a hash of the bytes: which state sums belong to
  std::optional<Model> result;  ///< of `model`
  std::optional<Model> sample;  ///< of `sample_model`, for the pass that fits it

  Eigen::Index inputs() const { return std::ssize(input_names); }
  bool is_category(Eigen::Index column) const { return column < inputs() && !levels[column].empty(); }
  bool is_weighted() const { return options.weighted != 0; }
  std::vector<Eigen::Index> numbers() const;  ///< the inputs that are no categories
  GramShape shape() const { return {std::ssize(numbers()) + 1, 1}; }
  /// Numbers of a row: inputs, output, and the weight if there is one.
  Eigen::Index row_columns() const { return inputs() + 1 + (is_weighted() ? 1 : 0); }

  static auto fields(auto& self) {
    return std::tie(self.options, self.input_names, self.output_name, self.levels, self.step, self.passes, self.blocks,
                    self.rows, self.fingerprint, self.weight, self.weight_scale, self.range, self.mean, self.scale,
                    self.edges, self.level_weight, self.nodes, self.asked, self.root_residual, self.model,
                    self.sample_model, self.sample_rmse, self.is_blended);
  }
};

/// Bins of an input: one more than edges, or the levels of a category.
inline Eigen::Index bins_of(const StateData& data, Eigen::Index input) {
  return data.is_category(input) ? std::ssize(data.levels[input]) : std::ssize(data.edges[input]) + 1;
}

/// Where an input's bins begin among those of a node; of the number of inputs: the number of bins.
std::vector<Eigen::Index> first_bins(const StateData& data);

/// Constant and slopes of a node's local model, in scaled columns. `rank`: of [1, z] over its rows.
Eigen::VectorXd model_of(const StateData& data, const TopNode& node, int& rank);

/// Unknowns of the joint equations of a tree; 0: there is none.
Eigen::Index unknowns_of(const StateData& data);

/// Makes a state of what is known: its mark, and its model.
State finish_state(StateData data);

/// `content` behind a header: format, version, what it is, length and checksum.
std::string sealed(char kind, const std::string& content);

/// The content. Throws std::runtime_error, starting with `name`, if the header does not go with `bytes`.
std::string_view unsealed(char kind, std::string_view bytes, const std::string& name);

/// The options of a branch's fit.
FitOptions branch_options(const KeptOptions& kept, int max_threads);

/// Throws std::invalid_argument for what sums over rows cannot do.
KeptOptions kept_options(const Options& options);

/// Names of categories, of every input. Throws std::invalid_argument naming the input.
std::vector<std::vector<Text>> kept_levels(const std::vector<std::vector<std::string>>& levels,
                                           const std::vector<Text>& inputs);

/// Throws std::runtime_error if the parts of a state do not go together.
void check_state(const StateData& data);

}  // namespace llmt::distributed
