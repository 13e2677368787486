// Which signals rest, and what describes the dry friction of a simulation.
#include <gtest/gtest.h>

#include <cmath>

#include "discovery/recording/speeds.hpp"
#include "discovery/recording/surrogate.hpp"
#include "llmt/random.hpp"

namespace llmt::discovery {
namespace {

// Stops of 0.4 s between moves of a second to the other side: position, speed and acceleration pass or stand at 0
// often.
Inputs stop_and_go() {
  constexpr Eigen::Index n = 2400;
  constexpr double step = 0.01;
  constexpr double pi = 3.141592653589793;
  Inputs inputs;
  inputs.names = {"q", "dq", "ddq"};
  inputs.values.resize(n, 3);
  inputs.instants = Eigen::VectorXd::LinSpaced(n, 0.0, step * static_cast<double>(n - 1));
  for (Eigen::Index i = 0; i < n; ++i) {
    const double t = inputs.instants(i);
    const double side = std::fmod(t, 2.8) < 1.4 ? 1.0 : -1.0;
    const double move = std::min(std::fmod(t, 1.4), 1.0);
    const bool rests = std::fmod(t, 1.4) >= 1.0;
    inputs.values(i, 0) = side * (1.0 - std::cos(pi * move)) - side + 0.1;
    inputs.values(i, 1) = rests ? 0.0 : side * pi * std::sin(pi * move);
    inputs.values(i, 2) = rests ? 0.0 : side * pi * pi * std::cos(pi * move);
  }
  Random random(7);
  for (double& value : inputs.values.rightCols(2).reshaped()) value += 1e-2 * random.normal();
  return inputs;
}

Inputs column_of(const Inputs& all, Eigen::Index column) {
  Inputs one = all;
  one.names = {all.names[static_cast<std::size_t>(column)]};
  one.values = all.values.col(column);
  return one;
}

TEST(Rests, OfAMotionOnlyTheSpeedRests) {
  const Inputs inputs = stop_and_go();
  for (const Eigen::Index j : {1, 2}) {
    const Eigen::MatrixXd jump = inputs.values.col(j).cwiseSign();
    EXPECT_GT(zero_bands(Recording(column_of(inputs, j)), jump)(0), 0.0) << j;  // alone it may be a speed
    const Eigen::VectorXd bands = zero_bands(Recording(inputs), jump);
    EXPECT_EQ(bands(0), 0.0) << j;
    EXPECT_EQ(bands(2), 0.0) << j;
    if (j == 1) {
      EXPECT_GT(bands(1), 0.0);
    }
  }
}

TEST(Surrogate, DescribesStribecksPeakAndItsJump) {
  Random random(3);
  Eigen::MatrixXd inputs(1500, 3);
  for (double& value : inputs.reshaped()) value = random.uniform(-1.0, 1.0);
  const Eigen::ArrayXd v = inputs.col(1).array();
  const Eigen::ArrayXd dry = v.sign() * (0.4 + 0.9 * (-(v / 0.07).square()).exp());
  const Eigen::MatrixXd simulated = (0.2 * inputs.col(0).array() + dry).matrix();
  const Surrogate surrogate(inputs, simulated);
  EXPECT_GT(surrogate.described()(0), 0.98);
  // What a smooth function of v can stand for aside, the two sides of 0 differ by twice the friction at rest.
  Eigen::MatrixXd sides = Eigen::MatrixXd::Zero(2, 3);
  sides(0, 1) = 1e-4;
  sides(1, 1) = -1e-4;
  const Eigen::MatrixXd jumps = surrogate.jumps(sides);
  EXPECT_NEAR(jumps(0, 0) - jumps(1, 0), 2.0 * 1.3, 0.2);
  // A constant and the slope alone have no jump.
  const Surrogate smooth(inputs, inputs.col(0) + 2.0 * inputs.col(1));
  EXPECT_LT(smooth.jumps(inputs).cwiseAbs().maxCoeff(), 1e-3);
}

}  // namespace
}  // namespace llmt::discovery
