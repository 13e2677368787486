/// \file
/// The rows of a fit, made ready: checked, without copies, weighted, dealt to folds, described.
///
/// A fit checks, hashes and sorts a caller's rows once, by checked(). All later forms of them (other weights, fewer
/// rows, other columns) are made from the result.
#pragma once

#include <Eigen/Core>
#include <functional>
#include <memory>
#include <optional>
#include <vector>

#include "data/equal_rows.hpp"
#include "data/fold_rows.hpp"
#include "data/table.hpp"
#include "llmt/options.hpp"

namespace llmt {

/// A matrix that either views the caller's numbers or shares its own.
struct SharedMatrix {
  Eigen::Ref<const Eigen::MatrixXd> values;
  std::shared_ptr<const Eigen::MatrixXd> owned = nullptr;  ///< what `values` views; null: the caller's
};

/// Takes over a matrix.
SharedMatrix shared(Eigen::MatrixXd matrix);

/// Rows to learn from. `weights`, `groups` and `loss_weights` have one entry a row, or none.
struct GivenRows {
  SharedMatrix inputs;
  SharedMatrix outputs;
  Eigen::VectorXd weights = {};     ///< not negative; a row of weight 0 takes no part. Empty: all 1
  std::vector<double> groups = {};  ///< rows of one group share a fold. Empty: each row stands alone
  std::vector<bool> held_out = {};  ///< of each row, whether it is of the only fold. Empty: the fit deals folds
  /// True if weights are counts: a row of weight k is k equal rows (docs/algorithms/data.md, "Row weights"). Set by
  /// checked().
  bool are_counts = false;
  std::vector<int> categorical = {};  ///< inputs whose values are categories 0, 1, 2, ...
  /// Of each input whose last category is that of its missing values, the number of categories; of others 0. May be
  /// empty: all 0.
  std::vector<std::size_t> empty_levels = {};
  bool may_have_codes = true;              ///< as TrainingData
  Eigen::VectorXd loss_weights = {};       ///< in training, not in errors, a row's weight is times this. Empty: all 1
  std::optional<RowNumbers> numbers = {};  ///< which rows are equal; none: nobody has looked
};

/// The rows with inputs made the same that are equal up to rounding, without_rounding(), but for those held out.
GivenRows settled(GivenRows given, int max_threads);

/// Checks and settles the rows, decides whether weights are counts, and looks for equal ones where that is not yet done
/// and makes a difference: where rows are held out and there are no groups. Throws std::invalid_argument as fit().
GivenRows checked(GivenRows rows, const FitOptions& options);

/// The numbers of some of the rows, if these have any.
std::optional<RowNumbers> numbers_at(const GivenRows& given, const std::vector<Eigen::Index>& rows);

/// The rows that take part, ascending. Where weights are counts, a row is there as often as its weight says. Throws
/// std::invalid_argument if no weight is positive.
std::vector<Eigen::Index> counted_rows(const GivenRows& given);

/// Some of the counted_rows(): where weights are counts, each has the weight 1.
GivenRows counted_rows_at(const GivenRows& given, const std::vector<Eigen::Index>& rows);

/// Some of the rows.
GivenRows rows_at(const GivenRows& given, const std::vector<Eigen::Index>& rows);

/// One of the counted_rows(), and the kept row that it is or copies.
struct RowPlace {
  int given = 0;
  int kept = 0;
};

/// The rows that take part, counted_rows(). Where rows are held out, copies of a row (find_equal_rows()) only add to
/// its weight, and repeats of a measurement share a fold. Nothing is copied where each of the given rows is kept once.
struct KeptRows {
  SharedMatrix inputs;
  SharedMatrix outputs;
  Eigen::VectorXd weights = {};         ///< positive, those of copies added, the largest 1
  Eigen::VectorXd precisions = {};      ///< weights as given, if they are no counts; empty: none
  Eigen::VectorXd loss_weights = {};    ///< as GivenRows
  std::vector<double> groups = {};      ///< as GivenRows
  std::vector<Eigen::Index> rows = {};  ///< their places among the given rows, ascending
  std::vector<RowPlace> places = {};    ///< one a counted row
  std::vector<Fold> folds = {};         ///< selection_folds(), or that of GivenRows::held_out
  Eigen::Index copies = 0;              ///< the number of given rows that are copies of others
  bool has_repeats = false;             ///< whether rows with equal inputs are repeats
  std::vector<int> kind = {};           ///< equal numbers for equal inputs; empty: all differ, or nobody has looked
  bool is_fold_given = false;           ///< the model is fitted to the rows that the only fold does not hold out

  Eigen::Index count() const { return weights.size(); }
};

/// Throws std::invalid_argument as selection_folds().
KeptRows keep(const GivenRows& given, const FoldOptions& folds);

/// How often each kept row counts: it, and its copies.
std::vector<int> copies_of(const KeptRows& kept);

/// The number of given rows that the model is fitted to, copies included.
Eigen::Index learned_rows(const KeptRows& kept);

/// The given rows that each fold holds out, ascending: those that are copies of a kept row too. A row that counts more
/// than once may be in several folds.
std::vector<std::vector<Eigen::Index>> held_out_rows(const KeptRows& kept);

struct TaughtTables;

/// The rows of a fit in all forms that the stages of the fit read. Its parts share tables, so that it may be copied and
/// moved.
struct Training {
  FitOptions options;            ///< by which the columns are described
  std::vector<int> categorical;  ///< inputs, those with codes included
  std::shared_ptr<const KeptRows> kept;
  SharedMatrix inputs;                                   ///< of the kept rows, or positions where some inputs are codes
  std::shared_ptr<const Table> table;                    ///< with the weights that rows have in errors
  std::shared_ptr<const Table> weighted;                 ///< with the weights that rows have in training
  TrainingRows all;                                      ///< that the model is fitted to, of the table `weighted`
  TrainingRows measured;                                 ///< the same rows and columns with the weights of `table`
  std::vector<FoldRows> folds;                           ///< held-out rows are measured
  std::shared_ptr<const TaughtTables> taught = nullptr;  ///< what `all` and `folds` learn from; null: `weighted`

  Eigen::Index outputs() const { return table->outputs.cols(); }
};

/// Weights by which those of rows with missing values are multiplied, one a row, from the rows as they are without.
using MissingWeights = std::function<Eigen::VectorXd(const TrainingRows& all)>;

/// `inputs` and `categorical`: as in Training. `orders_splits`: see make_table(). `missing_weights`: called where
/// values are missing, unless it is empty.
Training make_training(std::shared_ptr<const KeptRows> kept, const SharedMatrix& inputs, std::vector<int> categorical,
                       const FitOptions& options, bool orders_splits, const MissingWeights& missing_weights = {});

/// The same training with fewer inputs: `of_all` of the model of all rows, `of_folds` of each fold's, all ascending.
Training narrowed(const Training& training, const std::vector<int>& of_all,
                  const std::vector<std::vector<int>>& of_folds);

}  // namespace llmt
