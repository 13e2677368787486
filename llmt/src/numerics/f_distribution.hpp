/// \file
/// The F distribution, as far as the Chow test needs it.
#pragma once

namespace llmt {

/// P(F >= f) for F distributed with d1 and d2 degrees of freedom, in this order; d1, d2 > 0. 1 for f <= 0, 0 for
/// infinite f.
double f_survival(double f, double d1, double d2);

/// The f with f_survival(f, d1, d2) = probability, which lies in (0, 1).
double f_quantile(double probability, double d1, double d2);

/// Chow's test (1960) of one linear model against two, eq. (G.2) of docs/algorithms/growth.md: the probability that F
/// is at least (gained / added) / variance, which has `added` and `freedom` degrees of freedom. `gained`: by how much
/// two models lower the residual sum of squares. `added`: number of coefficients that they have more. `variance`: what
/// the two leave, divided by its degrees of freedom `freedom`.
double chow_p_value(double gained, double added, double variance, double freedom);

}  // namespace llmt
