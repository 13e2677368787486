/// \file
/// A tree of more rows than one memory holds, by three functions that any engine can call: sums over some rows, sums of
/// sums, and the next state of the tree. docs/algorithms/distributed.md has the equations.
///
///     namespace distributed = llmt::distributed;
///     distributed::State state = distributed::start({"x1", "x2"}, "y", {.branch_rows = 4'000'000});
///     while (!state.finished()) {
///       // Shards are summed on any machine and merged in any order.
///       distributed::Sums all = distributed::sums({inputs.topRows(65536), output.col(0).head(65536), 0}, state);
///       all = merge(std::move(all), distributed::sums({inputs.bottomRows(99), output.col(0).tail(99), 1}, state));
///       state = distributed::advance(state, std::move(all));  // to_bytes() of it is a checkpoint
///     }
///     save(state.model(), "model.json");
#pragma once

#include <Eigen/Core>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "llmt/abi.hpp"
#include "llmt/model.hpp"
#include "llmt/names.hpp"
#include "llmt/options.hpp"
#include "llmt/progress.hpp"

namespace llmt::distributed {

struct Options {
  /// A branch of the tree with at most this many rows is brought into one memory, where fit() finishes it. At least
  /// 100, and no fewer than sample_rows. A table with no more rows becomes the model of fit(), to the byte.
  Eigen::Index branch_rows = 4'000'000;
  /// Rows of the sample that the first pass brings into one memory, at least 100. Bins are cut and a first tree is
  /// grown from it.
  Eigen::Index sample_rows = 131072;
  Eigen::Index block_rows = 65536;  ///< of a block, of which sums are made; see Rows
  bool weighted = false;            ///< whether rows have weights
  /// For each input the names of its categories, which its values number from 0 on, as TrainingData::levels; at most
  /// 255, in all of the table. No names: a number. Empty: all are numbers.
  std::vector<std::vector<std::string>> levels = {};
  /// Of the branches. What start() refuses is not possible beyond one memory; max_threads may differ from pass to pass
  /// and is not kept. OptionField::beyond_memory says which options are taken.
  FitOptions fit = {};
  /// TrainingData::may_have_codes of a table with no more rows than branch_rows. Larger tables have no codes.
  bool may_have_codes = true;
};

/// Some rows of the table. They make the blocks first_block, first_block + 1, ... of Options::block_rows rows each; the
/// last one may have fewer. All blocks 0, 1, 2, ... of the table take part in every pass, each once. A shard without
/// rows has no block. The model depends on how the table is cut into blocks, and on nothing else of who sums what.
struct Rows {
  Eigen::Ref<const Eigen::MatrixXd> inputs;  ///< rows x inputs, finite; NaN: missing, see advance()
  Eigen::Ref<const Eigen::VectorXd> output;  ///< one a row, finite
  Eigen::Index first_block = 0;
  /// One a row, from 0 to 1e150, if Options::weighted says so. As TrainingData::weights: a row of weight 0 takes no
  /// part.
  Eigen::VectorXd weights = {};
};

/// What a state is about to do.
enum class Step {
  describe,  ///< the next pass finds means, ranges and a sample of the rows
  grow,      ///< the next pass sums bins of the nodes that are split next
  gather,    ///< the next pass brings the rows of some branches together
  blend,     ///< the next pass fits the tree of the sample to all rows
  finished   ///< there is a model
};

}  // namespace llmt::distributed

namespace llmt {
template <>
std::span<const Choice<distributed::Step>> choices();
}  // namespace llmt

namespace llmt::distributed {

/// How far a fit is.
struct Counts {
  Eigen::Index passes = 0;         ///< over the rows, so far
  Eigen::Index rows = 0;           ///< of the table; 0 before the first pass
  Eigen::Index top_leaves = 0;     ///< leaves of the top of the tree
  Eigen::Index branches = 0;       ///< those of them that fit() finishes, or has finished
  Eigen::Index branches_done = 0;  ///< and has finished
  Eigen::Index rows_to_come = 0;   ///< rows that the next pass brings together
  double held_out_rmse = 0.0;      ///< of the model: of branches and leaves, weighted by rows; NaN: nothing held out
  bool is_of_sample = false;       ///< the model is the tree of the sample, in place of top and branches
};

struct StateData;
struct SumsData;

/// The tree so far and what is asked next. A value; copies share everything.
class State {
 public:
  Step step() const;
  bool finished() const { return step() == Step::finished; }
  Counts counts() const;

  /// Options::levels, one entry an input.
  std::vector<std::vector<std::string>> levels() const;

  /// Throws std::invalid_argument before the last pass.
  const Model& model() const;

  /// The model as llmt::save() writes it, with intervals if one fit() made all of it. Throws as model().
  std::string model_json() const;

  /// Whether this is a later state of the fit that began with `first`: the same columns and options.
  bool continues(const State& first) const;

  /// For other processes of the same version, and to go on after an end: a header with format, version, length and a
  /// checksum, then the numbers as the machine has them.
  std::string to_bytes() const;

  /// Throws std::runtime_error, starting with `name`, for bytes that to_bytes() did not write: another format or
  /// version, cut off, changed, or parts that do not go together.
  static State from_bytes(std::string_view bytes, const std::string& name = "state");

  /// For the library.
  explicit State(std::shared_ptr<const StateData> data) : data_(std::move(data)) {}
  const StateData& data() const { return *data_; }

 private:
  std::shared_ptr<const StateData> data_;
};

/// Sums over some blocks; by default over none.
class Sums {
 public:
  Sums();
  Sums(Sums&&) noexcept;
  Sums& operator=(Sums&&) noexcept;
  ~Sums();

  /// As those of State.
  std::string to_bytes() const;
  static Sums from_bytes(std::string_view bytes, const std::string& name = "sums");

  /// For the library.
  explicit Sums(std::unique_ptr<SumsData> data);
  SumsData* data() { return data_.get(); }

 private:
  std::unique_ptr<SumsData> data_;  // null: over no block
};

/// The state before the first pass. Throws std::invalid_argument naming argument, value and bound: no input, repeated
/// names, an option of fit() out of range. Throws OptionRefused (option_fields.hpp), which names the option and says
/// what to do, for growth rules other than rd, exact search, quadratic local models, trends, Gaussians, Tukey's loss
/// and lists of inputs.
State start(std::vector<std::string> input_names, std::string output_name, const Options& options = {});

/// The sums that `state` asks of these rows: over each block in the order of its rows, then over blocks as a fixed
/// binary tree (base/sum_over.hpp). The same bytes at any number of threads (0: all).
///
/// Throws std::invalid_argument: shapes that do not fit, a negative block, an output or an input that is not finite
/// (naming the row, counted from 0 in `rows`, and the column), a state that is finished.
Sums sums(const Rows& rows, const State& state, int max_threads = 0);

/// The sums over the blocks of both, the same bytes in whatever order sums are merged. Throws std::invalid_argument if
/// they belong to different states or have a block in common.
Sums merge(Sums a, Sums b);

/// The state after a pass. `sums`: over all blocks. Throws std::invalid_argument naming them if blocks are missing, and
/// if the sums belong to another state; std::runtime_error if the rows are more than Options::branch_rows and an input
/// has missing values, or if there are no rows or another number than in the first pass. `progress`: of the fits of
/// branches.
State advance(const State& state, Sums sums, const Progress& progress = {}, int max_threads = 0);

}  // namespace llmt::distributed
