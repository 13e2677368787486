/// \file
/// Splits on inputs in which the prediction is monotone: what the leaves on either side owe to one another
/// (docs/algorithms.md, monotone and sign constraints).
#pragma once

#include <Eigen/Core>
#include <vector>

#include "data/dataset.hpp"

namespace llmt {

/// An inequality between the local models [value, slopes] of two leaves of one output:
///   of_left . left model + of_right . right model >= bound.
struct LeafInequality {
  int left = 0;  ///< nodes
  int right = 0;
  Eigen::VectorXd of_left;
  Eigen::VectorXd of_right;
  double bound = 0.0;
};

/// The tree's splits on monotone inputs j, and the conditions under which the prediction of one output is monotone in
/// every one of them, everywhere. With f_l, f_r the guarded local models of a leaf on either side of such a split, the
/// prediction's derivative is a sum, weighted with validities, over splits and pairs of leaves of
///   share_l g f_l' + (1 - g) share_r f_r' + |g'| (f_r - f_l) / h,
/// so it is enough that none of these is negative where both leaves count (in a jump: f_r >= f_l). `share` is the part
/// of a leaf's slope that this split may use up: one over the number of such splits whose transitions overlap. As a
/// polynomial of x_j each is bounded from below by its Bernstein coefficients, and f_r - f_l, a sum of functions of one
/// input each, by their smallest values: pieces of parabolas, bounded in the same way.
///
/// Takes for granted that slopes have the sign, and what prepare_ordered_splits() does. Inner nodes' slopes, ranges and
/// half widths are those of `partition`; leaves' models are given anew each time.
class OrderedSplits {
 public:
  OrderedSplits(const Partition& partition, const TrainingRows& training, Eigen::Index output);

  bool empty() const { return pairs_.empty(); }

  /// The worst inequality of every left leaf, and of every right one, of every split that leaves less room than
  /// `least`: f_r - f_l could be lower by so much. `models`: of all nodes, [value, slopes] in columns; bounds such that
  /// there is `room` then.
  std::vector<LeafInequality> violated(const Eigen::MatrixXd& models, double least, double room) const;

  /// The smallest room that any inequality leaves, in the unit of the output. Not negative: the prediction is monotone.
  double room(const Eigen::MatrixXd& models) const;

  /// Moves the leaves on either side of every split apart, by the same value each, so that there is `room`. Going up
  /// from the lowest split no move undoes another.
  void separate(Eigen::MatrixXd& models, double room) const;

 private:
  /// f of a leaf as a function of its own coefficients: slope * deviation + the ancestors' part.
  struct Held {
    double deviation = 0.0;
    double rest = 0.0;
  };
  struct Term {
    Eigen::Index regressor;
    double left;
    double right;
  };
  /// A value of an input: part of f_r - f_l there, constant + sum of slope_r right - slope_l left.
  struct Option {
    double constant;
    Eigen::Index first;
    Eigen::Index count;
  };
  /// f_r - f_l + of_left f_l' + of_right f_r' >= 0.
  struct Coefficient {
    double of_left;
    double of_right;
  };
  struct Range {
    Eigen::Index first;
    Eigen::Index count;
  };
  struct Pair {
    int split;
    int left;
    int right;
    double sign;
    Eigen::Index regressor;  // of the split input; -1: none
    Range inputs;            // among groups_
    Range coefficients;
  };
  /// Where the worst point of a pair is.
  struct Worst {
    double room;
    Coefficient coefficient;
    std::vector<Option> options;
  };
  class Geometry;

  void add_pair(const Geometry& geometry, int split, int left, int right);
  void add_options(const Geometry& geometry, int input, int left, int right);
  void add_option(const Geometry& geometry, const std::vector<Eigen::Index>& regressors,
                  const std::vector<double>& deviations, int left, int right);
  void add_pieces(const Geometry& geometry, Eigen::Index regressor, double low, double high, int left, int right);
  Worst worst(const Pair& pair, const Eigen::MatrixXd& models) const;
  LeafInequality inequality(const Pair& pair, const Worst& worst, Eigen::Index size, double room) const;

  std::vector<Pair> pairs_;    // of one split one after the other
  std::vector<Range> groups_;  // options of an input of a pair
  std::vector<Option> options_;
  std::vector<Term> terms_;
  std::vector<Coefficient> coefficients_;
  std::vector<std::vector<int>> below_;  // leaves below each node
  std::vector<std::pair<int, int>> children_;
};

/// Whether some split is on an input in which the prediction is to be monotone.
bool has_ordered_splits(const Partition& partition, const TrainingRows& training);

/// Half widths on monotone inputs such that no transition leaves the range in which slopes count.
void limit_half_widths(Partition& partition, const TrainingRows& training);

/// Makes the guards of a tree with ordered splits simple where they matter: a leaf's own slope in a monotone input
/// counts wherever the leaf does, within the range of all rows; a missing value of another input counts as that input's
/// mean, or most frequent level, at every split and in every local model. The rows have no missing values.
void prepare_ordered_splits(Partition& partition, const TrainingRows& training);

}  // namespace llmt
