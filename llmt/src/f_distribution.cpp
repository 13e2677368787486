#include "f_distribution.hpp"

#include <boost/math/special_functions/beta.hpp>
#include <cmath>

namespace llmt {

double f_survival(double f, double d1, double d2) {
  if (!(f > 0.0)) {
    return 1.0;
  }
  if (std::isinf(f)) {
    return 0.0;
  }
  // In double throughout: long double differs between platforms. Underflow to 0 is the right answer, not an error.
  using namespace boost::math::policies;
  using Policy = policy<promote_double<false>, underflow_error<ignore_error>, overflow_error<ignore_error>>;
  return boost::math::ibeta(d2 / 2.0, d1 / 2.0, d2 / (d2 + d1 * f), Policy());
}

}  // namespace llmt
