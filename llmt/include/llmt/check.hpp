/// \file
/// Whether a model is still good on new rows, and what of these is not as in training.
///
///     const llmt::TableCheck found = llmt::check(llmt::load_with_intervals("cop.json"), inputs, outputs);
///     if (found.verdict == llmt::CheckVerdict::no_longer_good) std::puts(found.targets[0].name.c_str());
#pragma once

#include <Eigen/Core>
#include <string>
#include <string_view>
#include <vector>

#include "llmt/abi.hpp"
#include "llmt/boosted_model.hpp"
#include "llmt/intervals.hpp"

namespace llmt {

struct CheckOptions {
  /// Probability that a test says something although the new rows are drawn as those of training: over all tests of one
  /// check; from 0 to 0.5.
  double level = 0.05;
  /// Root mean square error up to which the model is good, one a target. Empty: a tenth above the promised one.
  std::vector<double> limits = {};
  Eigen::VectorXd weights = {};  ///< of the rows, as of Intervals::predict(); empty: the median one
  int max_threads = 0;           ///< 0: all
};

/// Of the intervals that are counted.
inline constexpr double checked_level = 0.9;

enum class CheckVerdict {
  good,                 ///< the errors are as promised, and the inputs as in training
  moved_within_limits,  ///< something changed, but the errors are within their limits
  no_longer_good,       ///< an error is beyond its limit
  not_evaluated         ///< the rows, or the model, allow no verdict on the errors
};

/// "good", "moved, within limits", "no longer good", "not evaluated".
std::string_view to_string(CheckVerdict verdict);

/// A leaf of the model whose rows are judged.
struct CheckedLeaf {
  std::size_t leaf = 0;      ///< index into Model::leaves() of the target's partition
  Eigen::Index rows = 0;     ///< new ones
  double rmse = 0.0;         ///< of these
  double promised = 0.0;     ///< that held-out rows in this leaf had, at the spreads of the new rows
  double probability = 1.0;  ///< of so large an error by chance, by Holm; NaN: too few rows
  bool is_worse = false;
};

/// The errors of a target.
struct CheckedTarget {
  std::string name;
  Eigen::Index rows = 0;                 ///< that have the target
  double rmse = 0.0;                     ///< of the model on them
  double promised = 0.0;                 ///< what held-out rows promise for rows like these, see check(); NaN: nothing
  double probability = 1.0;              ///< of so large an error by chance, by Holm; NaN: not tested
  double limit = 0.0;                    ///< up to which `rmse` is good
  double covered = 0.0;                  ///< share of the rows in their intervals; NaN: there are none
  double covered_probability = 1.0;      ///< of so few by chance, by Holm; NaN: not tested
  bool is_worse = false;                 ///< beyond chance
  bool is_good = true;                   ///< within the limits
  std::vector<CheckedLeaf> leaves = {};  ///< with rows, in the order of the model; empty for sums of trees
};

/// An input that the model uses.
struct CheckedInput {
  std::size_t input = 0;  ///< index into the model's
  std::string name;
  Eigen::Index below = 0;    ///< values below those of training; 0 for categories
  Eigen::Index above = 0;    ///< values above
  Eigen::Index unknown = 0;  ///< categories or codes that training had not
  Eigen::Index missing = 0;  ///< empty cells
  double mean = 0.0;         ///< of the values; NaN for categories, and without values
  double training_mean = 0.0;
  double shift = 0.0;  ///< of the mean, in standard deviations in training; NaN: not known
  double missing_share = 0.0;
  double training_missing_share = 0.0;
  double probability = 1.0;  ///< of so different values by chance, by Holm; NaN: the file has no record of the input
  bool has_moved = false;    ///< beyond chance, or there are unknown categories
};

struct TableCheck {
  CheckVerdict verdict = CheckVerdict::good;
  std::string reason = {};  ///< why it is not evaluated, in a sentence; else empty
  Eigen::Index rows = 0;
  std::vector<Eigen::Index> outside = {};  ///< rows outside of the training range of an input, ascending
  std::vector<CheckedTarget> targets = {};
  std::vector<CheckedInput> inputs = {};
  Eigen::Index tests = 0;   ///< that were made
  bool has_record = false;  ///< the file knows the training rows; else inputs are not tested, and leaves are not
};

/// Judges a model by new rows. `inputs`: as of Model::predict(); `outputs`: rows x outputs, NaN where not measured.
///
/// The error. With f the model, s the mean Spread of its held-out rows' parts and S_i = |y_i - f(x_i)| / s(x_i), the
/// file promises new rows the error
///   promised^2 = mean s(x_i)^2 . mean S_h^2,  S_h those of the held-out rows of the fit.
/// If nothing changed, S_i and S_h are exchangeable, but for that f has seen all rows and the folds' models fewer,
/// which is on the safe side: the permutation test of the means of S^2 is exact whatever the noise. The 90 % intervals
/// are judged by the number of rows outside of theirs, beta-binomial as that of split conformal intervals is.
///
/// Limits. A target is good up to its limit, or if none is stated unless its error is beyond chance and a tenth above
/// the promised one, or its intervals hold fewer rows beyond chance and fewer than 85 %, half of the way to what CV+
/// guarantees.
///
/// Leaves. Mean squares of S in a leaf are compared with those of held-out rows there by an F test, its degrees of
/// freedom corrected for the kurtosis of S (Box 1953); 10 rows of either kind are needed.
///
/// Inputs. Numbers by Lepage's test of location and scale and by how many lie beyond the largest and the smallest value
/// of training, categories by chi square, empty cells by Fisher's exact test; the smallest probability times their
/// number. Unknown categories count without a test.
///
/// All probabilities of one check are corrected together (Holm 1979). Rows are taken for independent: repeats, and rows
/// that follow each other in time, make chance look smaller than it is.
///
/// Not evaluated: no target, fewer than 10 rows that have one, or fewer than 10 held-out rows in the file. Inputs are
/// judged all the same. Throws std::invalid_argument for options out of range, other numbers of outputs, rows or limits
/// than the model's, infinite outputs, and as Model::predict().
TableCheck check(const ModelWithIntervals& model, const Eigen::Ref<const Eigen::MatrixXd>& inputs,
                 const Eigen::Ref<const Eigen::MatrixXd>& outputs, const CheckOptions& options = {});

/// The same of a sum of trees, which has no leaves to name.
TableCheck check(const BoostedModel& model, const Eigen::Ref<const Eigen::MatrixXd>& inputs,
                 const Eigen::Ref<const Eigen::MatrixXd>& outputs, const CheckOptions& options = {});

}  // namespace llmt
