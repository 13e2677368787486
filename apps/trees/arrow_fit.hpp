/// \file
/// `llmt fit` of a table in Arrow files, or in several files, which need not fit into memory.
#pragma once

#include <CLI/CLI.hpp>
#include <string>
#include <utility>
#include <vector>

#include "llmt/distributed.hpp"
#include "trees/learning.hpp"

namespace llmt::apps {

struct ArrowFitArguments {
  LearningArguments learning;
  std::string output;
  bool json = false;
  std::vector<std::string> more;  ///< files behind learning.data
  std::string memory;             ///< "4G"; empty: half of the machine's
  std::string checkpoint;         ///< file of the state after every pass; empty: none
  bool resume = false;            ///< begin with the checkpoint

  std::vector<std::string> files() const;
};

/// Bytes from a number with K, M, G or T: "4G", "500M". Throws std::invalid_argument naming the option.
double read_memory(const std::string& text);

/// Adds further files, --memory, --checkpoint and --resume.
void add_arrow_fit_options(CLI::App& command, ArrowFitArguments& arguments);

/// The processes that share every pass over a table. Here it is one.
class Processes {
 public:
  Processes() = default;
  Processes(const Processes&) = delete;
  Processes& operator=(const Processes&) = delete;
  virtual ~Processes() = default;

  virtual Eigen::Index rank() const { return 0; }
  virtual Eigen::Index count() const { return 1; }

  /// The sums over the blocks of all processes at rank 0, over none elsewhere.
  virtual distributed::Sums merged(distributed::Sums own) { return own; }

  /// The bytes that rank 0 gives, at all ranks.
  virtual std::string of_first(std::string bytes) { return bytes; }

  /// What the messages cost, for people; empty: nothing.
  virtual std::string cost() const { return ""; }
};

/// Learns from the table. `command`: to refuse options of `llmt fit` that are not for such tables. Rank 0 reads and
/// writes checkpoints, fits branches, writes the model and prints.
void arrow_fit_command(const CLI::App& command, const ArrowFitArguments& arguments, Processes& processes);

}  // namespace llmt::apps
