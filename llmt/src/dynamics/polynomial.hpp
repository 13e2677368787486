/// \file
/// Polynomials of the regressors: see Polynomial.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "llmt/dynamic_model.hpp"

namespace llmt {

/// The products of at most `degree` of `regressors` factors, the constant first, then by degree. Degree 0: no term.
std::vector<std::vector<int>> all_terms(Eigen::Index regressors, int degree);

/// How many all_terms() would return; infinity beyond doubles.
double number_of_terms(Eigen::Index regressors, int degree);

/// z of a row of regressors: one value a regressor, and behind all of them the same as factors of products of two and
/// more, which may be held.
void standardise(const Polynomial& polynomial, const double* x, double* z);

/// The products at a row: one value a term. `z`: of standardise().
void products_at(const Polynomial& polynomial, const double* z, double* products);

/// by_regressor (outputs x regressors) += derivatives of the polynomial by the regressors at the row x.
void add_polynomial_slopes(const Polynomial& polynomial, const double* x, const double* z,
                           Eigen::MatrixXd& by_regressor);

/// The least-squares polynomial of the rows, with `ridge` times the number of rows on the squares of the coefficients
/// of degree 2 and more, in units of the outputs' deviation. Centre and scale are mean and standard deviation.
Polynomial fit_polynomial(const Eigen::MatrixXd& regressors, const Eigen::MatrixXd& outputs, int degree, double ridge);

}  // namespace llmt
