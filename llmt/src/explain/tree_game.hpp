/// \file
/// Shapley values of the inputs in one boosted tree, for a row and a row of the background.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <optional>
#include <vector>

#include "explain/game_rule.hpp"
#include "llmt/boosted_model.hpp"
#include "llmt/progress.hpp"

namespace llmt {

/// The two rows that inputs are taken from, and the features that follow.
///
/// A tree is a sum of leaves. What comes to a leaf is a product over the inputs, with a factor for an input that is
/// taken from the row and another one for an input of the background:
///   f(p) = product of q_i(p), q_i(p) = row_i p + background_i (1 - p)
/// if each input is taken from the row with the probability p. The Shapley value of an input i is the integral of
/// df / dp_i over p from 0 to 1 (Owen 1972), a polynomial.
class TwoRows {
 public:
  /// `x` and `background`: the inputs of either row. `work`: is asked now and then, so that a long walk can be stopped.
  TwoRows(const BoostedModel& model, const BoostedSum& sum, const double* x, const double* background, Work& work);

  /// Adds `scale` times the Shapley values of the inputs in the tree to `values`, one for each input. `rule`: of
  /// order_for() at least. False if that needs more trials than a tree may take (Limit::sum_trials); `values`
  /// is then of no use.
  [[nodiscard]] bool add_values(const BoostedTree& tree, const GameRule& rule, double scale,
                                Eigen::Ref<Eigen::VectorXd> values);

 private:
  // The factors of what comes to a node if an input is taken from the row, and from the background. An input with one
  // factor 0 is decided.
  struct Factors {
    double row = 1.0;
    double background = 1.0;

    bool are_one() const { return row == 1.0 && background == 1.0; }
  };

  struct Input {
    double standardised[2];  // of the row and of the background
    bool differs;
    bool is_open;  // it differs and is not decided
    int side;      // 0: the row, also where it does not matter; 1: decided to be of the background
    Factors factors;

    void set(const Factors& changed) {
      factors = changed;
      is_open = differs && changed.row != 0.0 && changed.background != 0.0;
      side = changed.row != 0.0 ? 0 : 1;
    }
  };

  struct Feature {
    BoostedFeature is;
    double of[2];  // if all inputs are of the row, and of the background
  };

  struct Range {
    double low;
    double high;
  };

  // The open inputs of a feature: the first of them, -1: none, and how many there are.
  struct Open {
    int first = -1;
    int count = 0;
  };

  // The values of a feature between which it lies however its open inputs are taken. With one open input: from the row,
  // and from the background.
  struct Ends {
    double z[2];
  };

  // What is still to be done: to go on at a node, with other factors of an input (-1: the same), or to go back to the
  // factors that an input had.
  struct Task {
    enum class Kind : unsigned char { go, go_back } kind;
    int at;
    double share;
    int input;
    Factors factors;
  };

  double value(int feature) const;
  Open open_of(const BoostedFeature& feature) const;
  std::optional<Ends> ends_of(const Feature& feature, const Open& open) const;
  Range range_of(double share) const;
  std::optional<double> right_of(const BoostedSplit& split, double z, double share) const;
  int last_open() const;
  void walk(int at, double share);
  int branch(const BoostedSplit& split, double share, int input, const Factors& right);
  void decide(int input, int at, double share);
  void go_to(int input, const Factors& factors);
  void go_back(int input, const Factors& factors);
  void end_in(const BoostedLeaf& leaf, int at, double share);
  int deciding_input(const BoostedLeaf& leaf, double& value);
  void forget_changes();

  // At the nodes of the quadrature, for the innermost change of an input's factors: the product of all q_i, the sum of
  // what came to leaves since then, and the weights that its integral for the input has.
  double* products() { return levels_.data() + 3 * level_ * order(); }
  double* sums() { return products() + order(); }
  double* weights() { return sums() + order(); }
  std::size_t order() const { return 2 * half_order_; }

  Work& work_;
  std::vector<Input> inputs_;
  std::vector<Feature> features_;
  std::vector<Task> tasks_;
  std::vector<int> touched_;  // inputs whose factors are not 1
  std::vector<double> levels_;
  std::size_t level_ = 0;
  std::size_t half_order_ = 1;
  std::vector<double> changes_;  // of a leaf's value by each open input
  std::vector<int> changing_;
  const BoostedTree* tree_ = nullptr;
  const GameRule* rule_ = nullptr;
  double scale_ = 1.0;
  double* values_ = nullptr;
  std::int64_t trials_ = 0;  // how often an input was decided, in this tree
  std::int64_t steps_ = 0;
};

}  // namespace llmt
