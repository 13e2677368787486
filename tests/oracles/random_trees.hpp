// Trees of any validity on random data.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <functional>
#include <stdexcept>
#include <string>
#include <vector>

#include "llmt/fit.hpp"
#include "oracles/oracles.hpp"
#include "oracles/thrown.hpp"

namespace random_trees {

using oracle::thrown;

struct Kind {
  llmt::ValidityChoice validity;
  double width;
};

inline const std::vector<Kind> kinds = {{llmt::ValidityChoice::crisp, 1.0},
                                        {llmt::ValidityChoice::blend, 0.5},
                                        {llmt::ValidityChoice::blend, 2.0},
                                        {llmt::ValidityChoice::blend, 1.0},
                                        {llmt::ValidityChoice::gaussian, 1.0 / 3.0}};

/// One candidate, no choice.
inline llmt::FitOptions only(const Kind& kind, llmt::Estimation estimation, Eigen::Index max_leaves,
                             double ridge = 1e-3) {
  llmt::FitOptions options;
  options.max_leaves = max_leaves;
  options.significance = llmt::every_split;
  options.validity = kind.validity;
  options.expert.estimation = estimation;
  options.expert.widths = {kind.width};
  options.expert.ridges = {ridge};
  options.expert.shrinkages = {0.0};
  options.folds.count = 0;
  return options;
}

/// A curved output and an affine one, which a shared partition has to serve both.
struct Data {
  Eigen::MatrixXd x;
  Eigen::MatrixXd y;
};

inline Eigen::VectorXd affine(const Eigen::MatrixXd& x) { return (x * Eigen::Vector3d(1.0, -2.0, 0.5)).array() + 3.0; }

inline Data data(std::uint64_t seed, Eigen::Index rows = 300, bool corners = false) {
  Eigen::MatrixXd x = oracle::uniform(rows, 3, seed);
  for (int corner = 0; corner < (corners ? 16 : 0); ++corner) {  // each twice
    for (int j = 0; j < 3; ++j) {
      x(corner, j) = (corner >> j) % 2 == 0 ? -1.0 : 1.0;
    }
  }
  Eigen::MatrixXd y(rows, 2);
  y << oracle::curved(x, 0.1, seed), affine(x);
  return {std::move(x), std::move(y)};
}

}  // namespace random_trees
