/// \file
/// Smooth against discontinuous trees, on the same folds.
#pragma once

#include <Eigen/Core>
#include <functional>
#include <string>
#include <vector>

#include "llmt/abi.hpp"
#include "llmt/fit.hpp"

namespace llmt {

/// A way to learn, with a name for people.
struct Method {
  std::string name;
  FitOptions options;
};

/// Least squares; crisp trees grown by RD, by RETIS and by RA; M5' with its own pruning and smoothing; Gaussians over a
/// crisp tree as in Benes et al. (2022), without re-estimation, and with joint re-estimation; the blend with joint
/// estimation; LOLIMOT; HILOMOT; where the number of `inputs` is given and of their local models quadratic ones can be
/// made (LocalTerms), the crisp tree by RD with these. `base` gives the columns, weights, seeds and threads.
std::vector<Method> usual_methods(const FitOptions& base = {}, Eigen::Index inputs = 0);

/// What one method made of the data.
struct Comparison {
  std::string method;
  Eigen::Index leaves = 0;  ///< of the model of all rows
  /// Constants and slopes other than 0 of the local models, thresholds of the splits, directions and gates.
  Eigen::Index parameters = 0;
  Eigen::VectorXd fold_rmse = {};  ///< held-out, one entry a fold
  double cv_rmse = 0.0;            ///< over all held-out rows
  double spread = 0.0;             ///< standard deviation of fold_rmse
  /// Largest change of the prediction across a split, at the training rows' projections on it (at most 1000 rows).
  double largest_jump = 0.0;
  double fit_seconds = 0.0;      ///< of the model of all rows, its own selection included
  double predict_seconds = 0.0;  ///< for a million rows
};

struct ComparisonResult {
  std::vector<Comparison> methods;  ///< in the order asked for
  std::size_t recommended = 0;      ///< position in `methods`
  std::string recommendation;       ///< a sentence that says which to take and why
};

struct CompareOptions {
  FoldOptions folds = {};  ///< outer folds: each method makes all its choices within the training part
  /// Called with the method and how many of how many fits are done.
  std::function<void(const std::string& method, Eigen::Index done, Eigen::Index total)> progress = {};
};

/// Fits every method in every fold and on all rows. One output. Recommended is the smallest held-out error; but a
/// simpler method that comes within one standard error of the paired difference over the folds is preferred: least
/// squares to all, and a crisp tree by RD to all but least squares, for it is read most easily.
///
/// Throws std::invalid_argument as fit(), and if there is no method, or more than one output.
ComparisonResult compare(const Eigen::Ref<const Eigen::MatrixXd>& inputs,
                         const Eigen::Ref<const Eigen::MatrixXd>& output, const std::vector<Method>& methods,
                         const CompareOptions& options = {});

/// Largest change of a model's prediction across its splits, at the projections of the rows on the planes of the splits
/// whose boxes hold them: the first output of each partition, at most 1000 rows, evenly spaced.
double largest_jump(const Model& model, const Eigen::Ref<const Eigen::MatrixXd>& inputs);

}  // namespace llmt
