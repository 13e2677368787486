#include "discovery/terms/random_simulation.hpp"

#include <fmt/format.h>

#include <cmath>

#include "llmt/discovery/missing.hpp"

namespace llmt::discovery {

void refuse_random(const Eigen::MatrixXd& first, const Eigen::MatrixXd& second,
                   const std::vector<std::string>& outputs) {
  constexpr double rounding = 1e-9;
  for (Eigen::Index o = 0; o < first.cols(); ++o) {
    const double most = rounding * first.col(o).cwiseAbs().maxCoeff();
    for (Eigen::Index i = 0; i < first.rows(); ++i) {
      if (!(std::abs(first(i, o) - second(i, o)) > most)) continue;
      throw RandomSimulation(
          fmt::format("llmt::discovery::find_missing: the simulation was run twice at the same values, and \"{}\" is "
                      "{:.6g} and then {:.6g} in data row {}; it must not be random: give its random numbers a seed",
                      outputs[static_cast<std::size_t>(o)], first(i, o), second(i, o), i + 1));
    }
  }
}

}  // namespace llmt::discovery
