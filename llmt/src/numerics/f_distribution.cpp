#include "numerics/f_distribution.hpp"

#include <boost/math/special_functions/beta.hpp>
#include <cmath>

namespace llmt {
namespace {

// Double throughout, because long double differs between platforms. Underflow to 0 is the right answer, not an error.
using namespace boost::math::policies;
using Policy = policy<promote_double<false>, underflow_error<ignore_error>, overflow_error<ignore_error>>;

}  // namespace

double f_survival(double f, double d1, double d2) {
  if (!(f > 0.0)) return 1.0;
  if (std::isinf(f)) return 0.0;
  return boost::math::ibeta(d2 / 2.0, d1 / 2.0, d2 / (d2 + d1 * f), Policy());
}

double f_quantile(double probability, double d1, double d2) {
  double rest = 0.0;  // 1 - x, without its loss of digits
  const double x = boost::math::ibeta_inv(d2 / 2.0, d1 / 2.0, probability, &rest, Policy());
  return d2 * rest / (d1 * x);
}

double chow_p_value(double gained, double added, double variance, double freedom) {
  return f_survival(gained / added / variance, added, freedom);
}

}  // namespace llmt
