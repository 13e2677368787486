// Fits y = |x| from a table of 40 points and predicts between them: two leaves, one slope each.
#include <cmath>
#include <iostream>

#include "llmt/fit.hpp"
#include "llmt/model.hpp"

int main() {
  const Eigen::VectorXd x = Eigen::VectorXd::LinSpaced(40, -1.0, 1.0);
  const Eigen::VectorXd y = x.cwiseAbs();
  const llmt::FitResult result = llmt::fit(x, y);

  Eigen::VectorXd asked(2);
  asked << -0.55, 0.35;
  const Eigen::MatrixXd predicted = result.model.predict(asked);
  std::cout << result.model.leaves(0).size() << " leaves; |-0.55| = " << predicted(0, 0)
            << ", |0.35| = " << predicted(1, 0) << '\n';
  const bool right = (predicted.col(0) - asked.cwiseAbs()).cwiseAbs().maxCoeff() < 1e-9;
  std::cout << (right ? "consumer ok" : "wrong prediction") << '\n';
  return right ? 0 : 1;
}
