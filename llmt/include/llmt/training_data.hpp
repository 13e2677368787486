/// \file
/// What a model is learned from.
///
///     llmt::TrainingData data{inputs, output};
///     data.input_names = {"age", "colour"};
///     data.output_names = {"price"};
///     llmt::set_categories(data, 1, words);              // the second column holds categories, given in words
///     data.weights = weights;
///     const llmt::Model learnt = llmt::fit(data).model;  // has the names
///     Eigen::MatrixXd asked = new_inputs;
///     asked.col(1) = llmt::category_values(new_words, learnt.inputs()[1].levels);
///     const Eigen::MatrixXd predicted = learnt.predict(asked);
#pragma once

#include <Eigen/Core>
#include <span>
#include <string>
#include <vector>

#include "llmt/abi.hpp"

namespace llmt {

/// Matrices, and what is known of their rows and columns. What is empty is not known. Column indices count from 0.
struct TrainingData {
  Eigen::MatrixXd inputs = {};   ///< rows x inputs; NaN: missing, of a category a level of its own
  Eigen::MatrixXd outputs = {};  ///< rows x outputs
  /// One a row, from 0 to 1e150; a row of weight 0 takes no part. Empty: all 1. If all are whole numbers, at most 10 on
  /// average over those that are not 0, they are counts: a row of weight k is k equal rows, to the last byte of the
  /// result. Of other weights only the ratios matter (docs/algorithms/data.md).
  Eigen::VectorXd weights = {};
  /// One label a row: rows with equal labels, such as repeats of a pose, are held out together. Empty: the fit looks
  /// for repeats.
  std::vector<double> groups = {};
  /// Rows, counted from 0, on which the fit chooses, in place of folds: leaves, validities, inputs, codes and all that
  /// held-out rows decide elsewhere. The model is fitted to the other rows alone. FitOptions::folds, whose count must
  /// not be 0, and groups then deal nothing. Intervals are those of these rows (split conformal prediction). Empty: the
  /// fit deals folds, and fits to all rows.
  std::vector<Eigen::Index> held_out = {};
  std::vector<int> categorical_inputs = {};  ///< columns whose values are categories 0, 1, 2, ...
  /// For each input the names of its categories, which its values number from 0 on. No names: a number, or categories
  /// without names. An input with names is categorical. A category above the largest one that takes part in the fit is
  /// not in the model, and is unknown there. Where values are missing, the model has one level more, without a name.
  std::vector<std::vector<std::string>> levels = {};
  /// Whether inputs of few whole numbers may be codes of categories (docs/algorithms/codes.md). They are taken for
  /// codes where that lowers the held-out error beyond chance: by RD, RETIS and RA with crisp leaves or blends, with
  /// two folds or more or with `held_out`, where none of FitOptions::split_inputs, regression_inputs and trends is
  /// given.
  bool may_have_codes = true;
  std::vector<std::string> input_names = {};
  std::vector<std::string> output_names = {};
};

/// Makes a column categorical: its values become the places of `words`, one a row, in the sorted list of the different
/// words, and `data.levels` takes this list. An empty word is a missing value (NaN). Throws std::invalid_argument if
/// there is no such column, or if there are more or fewer words than rows.
void set_categories(TrainingData& data, int input, std::span<const std::string> words);

/// The values of a categorical input: the place of each word among the levels, NaN (missing) for an empty word, and -1,
/// which is no level, for another word that is not there.
Eigen::VectorXd category_values(std::span<const std::string> words, std::span<const std::string> levels);

}  // namespace llmt
