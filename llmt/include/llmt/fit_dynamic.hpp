/// \file
/// Learning a model of a system that moves from records, chosen by free runs on stretches that are held out.
///
///     const llmt::Series series{.inputs = inputs, .outputs = output, .input_names = {"u"}, .output_names = {"y"}};
///     const llmt::DynamicFit learnt = llmt::fit_dynamic(series);  // lags are chosen
///     const double error = learnt.summary.held_out.rmse(0);       // of free runs on held-out stretches
///     llmt::save(learnt.model, "drive.json");
#pragma once

#include <Eigen/Core>
#include <optional>
#include <string>
#include <vector>

#include "llmt/abi.hpp"
#include "llmt/dynamic_model.hpp"
#include "llmt/options.hpp"
#include "llmt/progress.hpp"
#include "llmt/series.hpp"

namespace llmt {

/// What learns the rest behind the polynomial.
enum class RestLearner {
  automatic,  ///< trees by LOLIMOT, HILOMOT and RD are candidates, as are polynomials alone
  tree,       ///< trees by DynamicOptions::rule are candidates, as are polynomials alone
  readable,   ///< the readable tree (readable.hpp) alone, without a polynomial; not estimated on runs
  sum,        ///< a sum of trees (boosted.hpp) behind a linear model; not estimated on runs
  none        ///< polynomials alone
};

/// In place of a dead time in DynamicOptions::delays: it is found.
inline constexpr int find_delay = -1;

/// In place of a dead time in DynamicSummary::delays: a linear model is as good without the input, with every dead time
/// that was tried. Its lags have none.
inline constexpr int no_delay_helps = -1;

struct DynamicOptions {
  std::optional<Lags> lags = {};  ///< none: chosen on held-out stretches
  /// Dead time of each input in rows: its lags count from there. find_delay: found on held-out stretches, up to 40
  /// rows. Empty: none for `lags` that are given; for lags that are chosen up to 10 rows are found.
  std::vector<int> delays = {};
  /// Rows that a held-out run goes on before it is begun again from measured rows; 0: to the end of its stretch
  /// (simulation); 1: prediction of the next row.
  Eigen::Index horizon = 0;
  RestLearner rest = RestLearner::automatic;
  GrowthRule rule = GrowthRule::hilomot;  ///< of RestLearner::tree
  Eigen::Index max_leaves = 4;            ///< of the trees that are compared: 2, 3, 4, then doubled
  int max_threads = 0;                    ///< 0: all that the machine has. The result does not depend on it
};

/// Errors of free runs (or of runs over DynamicOptions::horizon rows).
struct RunErrors {
  Eigen::VectorXd rmse;  ///< one an output, in its unit
  /// Fit in per cent, 100 (1 - |measured - simulated| / |measured - mean|) (Ljung 1999, ch. 16); one an output.
  Eigen::VectorXd fit;
  Eigen::Index rows = 0;      ///< judged
  Eigen::Index runs = 0;      ///< of which
  Eigen::Index diverged = 0;  ///< left the bounds; their errors count up to there and as the bound behind it
};

/// A model that was compared.
struct DynamicCandidate {
  std::string description;  ///< "polynomial of degree 3, estimated on runs"
  Lags lags = {};
  double error = 0.0;     ///< root mean square of held-out runs in units of the outputs' deviation; see RunErrors
  double one_step = 0.0;  ///< the same of predictions of the next row
  bool is_linear = false;
  bool is_stable = true;  ///< no held-out run left the bounds
};

struct DynamicSummary {
  Eigen::Index rows = 0;                   ///< complete ones
  std::vector<DynamicCandidate> compared;  ///< by error, the smallest first
  std::size_t chosen = 0;                  ///< of these
  std::string continuation;                ///< outside of the training ranges: "guarded", "linear" or "polynomial"
  std::vector<int> delays;                 ///< of each input in rows, or no_delay_helps; empty: none was asked for
  RunErrors held_out;                      ///< of the chosen candidate
  RunErrors linear;                        ///< of the best linear one, on the same stretches
  RunErrors training;                      ///< of the model over its own records
};

struct DynamicFit {
  DynamicModel model;
  DynamicSummary summary;
  Eigen::MatrixXd simulated;  ///< rows of the series x outputs: the model's run over its records; NaN where none is
  /// The same by models that were learned without the stretch of the row. Runs begin anew in each stretch.
  Eigen::MatrixXd held_out = {};
};

/// The fewest complete rows that fit_dynamic() takes.
inline constexpr Eigen::Index fewest_dynamic_rows = 50;

/// Learns y(t) = p(x(t)) + r(x(t)), see DynamicModel.
///
/// Candidates differ in lags, degree and ridge of the polynomial, whether it is held, rule and leaves of the tree, and
/// whether their parameters are estimated by least squares of the next row or on simulated records (output error,
/// Levenberg-Marquardt with forward sensitivities, partition fixed). The record is cut into stretches twice, into 4 and
/// into 7; every candidate is estimated without a stretch and run freely over it. The smallest error is taken. A linear
/// model is always among the candidates. Among those with the lags of the best one that are within 5 per cent of its
/// error the largest amplitudes decide: the candidate that, learned without them, runs best there.
///
/// Throws std::invalid_argument as check_series() and check_lags(); if fewer than `fewest_dynamic_rows` rows are
/// complete; if an output never changes; std::runtime_error if no candidate stays within its bounds in training.
DynamicFit fit_dynamic(const Series& series, const DynamicOptions& options = {}, const Progress& progress = {});

/// The errors of a model's runs over the complete stretches of a series, each begun by `initial` measured rows, at
/// least DynamicModel::memory(). Throws std::invalid_argument if the signals differ or no stretch is long enough.
RunErrors run_errors(const DynamicModel& model, const Series& series, Eigen::Index initial, Eigen::Index horizon = 0);

}  // namespace llmt
