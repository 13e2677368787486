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
#include "numerics/gram.hpp"

namespace llmt::distributed {

/// Text that base/sums.hpp writes.
using Text = std::vector<char>;

inline Text to_text(std::string_view from) { return {from.begin(), from.end()}; }
inline std::string to_string(const Text& from) { return {from.begin(), from.end()}; }

/// Options that a branch may have, as numbers.
struct KeptOptions {
  Eigen::Index branch_rows = 0;
  Eigen::Index block_rows = 0;
  Eigen::Index max_leaves = 0;
  Eigen::Index min_leaf_samples = 0;
  double significance = -1.0;
  Eigen::Index pruning = 0;
  Eigen::Index validity = 0;
  Eigen::Index sparse = 0;
  Eigen::Index estimation = 0;
  Eigen::Index folds = 0;
  Eigen::Index fold_kind = 0;
  std::uint64_t seed = 0;
  Eigen::Index intervals = 0;
  std::vector<double> widths;
  std::vector<double> jumps;
  std::vector<double> ridges;
  std::vector<double> shrinkages;

  static auto fields(auto& self) {
    return std::tie(self.branch_rows, self.block_rows, self.max_leaves, self.min_leaf_samples, self.significance,
                    self.pruning, self.validity, self.sparse, self.estimation, self.folds, self.fold_kind, self.seed,
                    self.intervals, self.widths, self.jumps, self.ridges, self.shrinkages);
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

/// A node of the top of the tree. Regressors are scaled, z_j = (x_j - mean_j) / scale_j.
struct TopNode {
  Fate fate = Fate::open;
  Eigen::Index left = -1;
  Eigen::Index right = -1;
  Eigen::Index input = -1;
  double threshold = 0.0;
  Eigen::Index rows = 0;
  /// Constant and slopes in z, of a model near that of the node: residuals in the sums are those of this model.
  Eigen::VectorXd base;
  std::vector<double> gram;      ///< of [1, z, residual], as GramShape has it, over all rows; empty: not known
  std::vector<double> held_out;  ///< the same over the rows of held-out blocks
  Eigen::VectorXd low;           ///< range of z over the rows
  Eigen::VectorXd high;
  Text branch;                 ///< done: the model that fit() made, as JSON
  double held_out_rmse = 0.0;  ///< done: of that model; NaN: none

  static auto fields(auto& self) {
    return std::tie(self.fate, self.left, self.right, self.input, self.threshold, self.rows, self.base, self.gram,
                    self.held_out, self.low, self.high, self.branch, self.held_out_rmse);
  }
};

struct StateData {
  KeptOptions options;
  std::vector<Text> input_names;
  Text output_name;
  Step step = Step::describe;
  Eigen::Index passes = 0;
  Eigen::Index blocks = 0;  ///< of the table, and its rows; known after the first pass
  Eigen::Index rows = 0;
  std::vector<Extent> range;               ///< of every input, and of the output
  Eigen::VectorXd mean;                    ///< of every input, and of the output
  Eigen::VectorXd scale;                   ///< what inputs are divided by, and the output
  std::vector<std::vector<double>> edges;  ///< of every input's bins: bin b holds edges[b - 1] < x <= edges[b]
  std::vector<TopNode> nodes;              ///< children behind their parents, in pairs
  std::vector<Eigen::Index> asked;         ///< nodes of the next pass, ascending
  Extent root_residual;                    ///< of the root's model, in units of the output
  Text model;                              ///< finished: JSON, with intervals if there are any

  // Not part of the bytes.
  std::uint64_t mark = 0;       ///< a hash of the bytes: which state sums belong to
  std::optional<Model> result;  ///< of `model`

  Eigen::Index inputs() const { return std::ssize(input_names); }
  GramShape shape() const { return {inputs() + 1, 1}; }

  static auto fields(auto& self) {
    return std::tie(self.options, self.input_names, self.output_name, self.step, self.passes, self.blocks, self.rows,
                    self.range, self.mean, self.scale, self.edges, self.nodes, self.asked, self.root_residual,
                    self.model);
  }
};

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

/// Throws std::runtime_error if the parts of a state do not go together.
void check_state(const StateData& data);

}  // namespace llmt::distributed
