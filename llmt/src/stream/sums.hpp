/// \file
/// Sums of squares and products of rows as they come, in the basis of one linear model.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "numerics/gram.hpp"

namespace llmt {

/// The point and the model that the features of rows are relative to. Features are
/// [1, z - origin, y - base . [1, z - origin]], z the scaled regressors. `base` is a model near the truth, so that sums
/// of squares of the residual keep their digits (docs/algorithms/stream.md).
struct Basis {
  Eigen::VectorXd origin;
  Eigen::VectorXd base;  ///< constant and slopes
};

/// Sums over rows: the Gram matrix of their features times the root of the weight, as GramShape lays it out.
struct Sums {
  std::vector<double> gram;
  Eigen::Index rows = 0;

  void clear();
  void add(const GramShape& shape, const Sums& other);
};

/// A row's features padded with zeros to whole vectors, and their products.
class RowProducts {
 public:
  explicit RowProducts(const GramShape& shape);

  /// `z`: scaled regressors, NaN: missing, taken as the origin.
  void set(const Basis& basis, const double* z, double y, double weight);
  void add_to(double* gram) const;
  void add_to(Sums& sums) const {
    add_to(sums.gram.data());
    ++sums.rows;
  }

 private:
  GramShape shape_;
  std::vector<double> features_;
  std::vector<double> products_;
};

/// The model [constant, slopes] in the basis of `gram`, as a change of the basis' base. It is the least-squares fit of
/// the residuals, with slopes drawn towards 0 as in eq. (E.2): as if `shrinkage` further rows, with the variances that
/// the regressors have and without correlation, said that nothing changes. Slopes of regressors that do not vary, or
/// are collinear with those before, do not change. `rank`: set to that of [1, z].
Eigen::VectorXd solve(const GramShape& shape, const double* gram, double shrinkage, int& rank);

/// Sum of squared residuals of the rows in `gram` after a change of the base.
double remaining(const GramShape& shape, const double* gram, const Eigen::VectorXd& change);

/// Transforms sums to a basis whose origin is shifted by `shift` and whose base differs by `change`, as solve() returns
/// it.
void rebase(const GramShape& shape, const Eigen::VectorXd& shift, const Eigen::VectorXd& change,
            std::vector<double>& gram);

/// The full symmetric matrix.
Eigen::MatrixXd matrix_of(const GramShape& shape, const double* gram);

/// The same model with coefficients about an origin shifted by `shift`.
Eigen::VectorXd shifted_model(const Eigen::VectorXd& model, const Eigen::VectorXd& shift);

}  // namespace llmt
