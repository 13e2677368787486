/// \file
/// Shapley values of the inputs in one boosted tree, for a row and a row of the background.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "llmt/boosted_model.hpp"

namespace llmt {

/// The two rows that inputs are taken from, and the features that follow.
class TwoRows {
 public:
  /// `x` and `background`: the inputs of either row.
  TwoRows(const BoostedModel& model, const BoostedSum& sum, const double* x, const double* background);

  /// Adds `scale` times the Shapley values of the inputs in the tree to `values`, one for each input.
  void add_values(const BoostedTree& tree, double scale, Eigen::Ref<Eigen::VectorXd> values);

 private:
  enum class Source : unsigned char { open, row, background };

  struct Input {
    double standardised[2];  // of the row and of the background
    bool differs;
    Source source;
  };

  bool is_open(int input) const { return inputs_[input].differs && inputs_[input].source == Source::open; }
  double value(int feature) const;
  double value(int feature, bool of_row) const { return features_[feature].of[of_row ? 0 : 1]; }
  int first_open(int feature) const;
  bool is_same_way(const BoostedSplit& split) const;
  void walk(int at, double share);
  void decide(int input, int at, double share);
  void end_in(const BoostedLeaf& leaf, int at, double share);
  int deciding_input(const BoostedLeaf& leaf, double& value);
  void add(double value, int more = -1);

  struct Feature {
    BoostedFeature is;
    double of[2];  // if all inputs are of the row, and of the background
  };

  std::vector<Input> inputs_;
  std::vector<Feature> features_;
  std::vector<int> of_row_;         // inputs that are taken from the row, in the order in which that was decided
  std::vector<int> of_background_;  // and from the background
  std::vector<double> changes_;     // of a leaf's value by each open input
  std::vector<int> changing_;
  const BoostedTree* tree_ = nullptr;
  double scale_ = 1.0;
  double* values_ = nullptr;
};

}  // namespace llmt
