/// \file
/// The F distribution, as far as the Chow test needs it.
#pragma once

namespace llmt {

/// P(F >= f) for F distributed with d1 and d2 degrees of freedom, in this order; d1, d2 > 0. 1 for f <= 0, 0 for
/// infinite f.
double f_survival(double f, double d1, double d2);

/// The f with f_survival(f, d1, d2) = probability, which lies in (0, 1).
double f_quantile(double probability, double d1, double d2);

}  // namespace llmt
