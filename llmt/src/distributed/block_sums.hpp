/// \file
/// What is summed over the rows of a block.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <map>
#include <memory>
#include <tuple>
#include <vector>

#include "base/sum_over.hpp"
#include "distributed/block.hpp"
#include "distributed/sample_tree.hpp"
#include "distributed/state.hpp"
#include "llmt/distributed.hpp"

namespace llmt::distributed {

/// What describes the columns, over the rows whose weight is not 0.
struct Description {
  Eigen::Index rows = 0;
  double weight = 0.0;
  Eigen::Index fractional = 0;        ///< rows whose weight is no whole number
  std::vector<Extent> range;          ///< inputs, output
  std::vector<double> total;          ///< of the values that are not missing, times their weights
  std::vector<Eigen::Index> missing;  ///< of every input
  Sample sample;

  static auto fields(auto& self) {
    return std::tie(self.rows, self.weight, self.fractional, self.range, self.total, self.missing, self.sample);
  }
};

/// Sums over the rows of a node that is to be split, in the layout of GramShape.
struct NodeSums {
  std::vector<double> grams;         ///< inputs x bins, one input after the other
  std::vector<Eigen::Index> counts;  ///< rows of every bin
  std::vector<double> held_out;      ///< Gram matrix of the rows in held-out blocks
  std::vector<Extent> range;         ///< of every regressor

  static auto fields(auto& self) { return std::tie(self.grams, self.counts, self.held_out, self.range); }
};

/// Rows of a branch: inputs, output, weight if there is one; one row after the other; in pieces, so that sums are
/// merged without copies.
struct BranchRows {
  std::vector<std::vector<double>> pieces;

  BranchRows& operator+=(BranchRows&& next);
  static auto fields(auto& self) { return std::tie(self.pieces); }
};

/// All sums of a block, of which a step of the fit fills a part.
struct BlockSum {
  std::uint64_t fingerprint = 0;  ///< of the rows: another one if a value changes or a row moves
  Description description;
  Extent root_residual;
  std::map<Eigen::Index, NodeSums> nodes;
  std::map<Eigen::Index, BranchRows> branches;
  JointSums joint;

  static auto fields(auto& self) {
    return std::tie(self.fingerprint, self.description, self.root_residual, self.nodes, self.branches, self.joint);
  }
};

/// Sums over blocks that follow each other.
struct Run {
  Eigen::Index first = 0;
  Eigen::Index last = 0;  ///< behind the last block
  BlockSums<BlockSum> sums;

  static auto fields(auto& self) { return std::tie(self.first, self.last, self.sums); }
};

struct SumsData {
  std::uint64_t mark = 0;  ///< of the state that asked
  Step step = Step::describe;
  Eigen::Index inputs = 0;
  Eigen::Index regressors = 0;  ///< inputs that are numbers
  Eigen::Index columns = 0;     ///< StateData::row_columns()
  Eigen::Index bins = 0;        ///< of all inputs together
  Eigen::Index unknowns = 0;    ///< of the sample's tree
  std::vector<Run> runs;        ///< ascending, with gaps between them

  static auto fields(auto& self) {
    return std::tie(self.mark, self.step, self.inputs, self.regressors, self.columns, self.bins, self.unknowns,
                    self.runs);
  }
};

/// Throws std::runtime_error if sizes or numbers of blocks do not go together.
void check_sums(const SumsData& data);

/// Whether the rows of a block are held out: every eighth block.
inline bool is_held_out(Eigen::Index block) { return block % 8 == 7; }

}  // namespace llmt::distributed
