// Evidence made up of noise, a baseline and planted effects.
#pragma once

#include <Eigen/Core>
#include <Eigen/QR>
#include <cstdint>
#include <string>
#include <utility>
#include <vector>

#include "discovery/search/scoring.hpp"
#include "llmt/discovery/search.hpp"
#include "llmt/random.hpp"

namespace search_cases {

using namespace llmt::discovery;

inline Eigen::MatrixXd normal_matrix(llmt::Random& random, Eigen::Index rows, Eigen::Index columns) {
  Eigen::MatrixXd matrix(rows, columns);
  for (double& value : matrix.reshaped()) value = random.normal();
  return matrix;
}

struct Case {
  Evidence evidence;
  std::vector<EffectCandidate> candidates;
};

/// Noise of one unit, a random baseline of `parameters` columns, `count` candidates of one to three columns each in
/// `families` families; the columns of neighbours are correlated.
inline Case random_case(std::uint64_t seed, Eigen::Index samples, Eigen::Index components, Eigen::Index parameters,
                        int count, int families) {
  llmt::Random random(seed);
  const Eigen::Index n = samples * components;
  Case data;
  data.evidence.components = components;
  data.evidence.jacobian = normal_matrix(random, n, parameters);
  data.evidence.residuals = normal_matrix(random, n, 1);
  Eigen::VectorXd last = normal_matrix(random, n, 1);
  for (int a = 0; a < count; ++a) {
    EffectCandidate candidate;
    candidate.family = "family" + std::to_string(a % families);
    candidate.location = "place" + std::to_string(a / families);
    candidate.signature = normal_matrix(random, n, 1 + a % 3);
    candidate.signature.col(0) = 0.6 * candidate.signature.col(0) + 0.8 * last;
    last = candidate.signature.col(0);
    data.candidates.push_back(std::move(candidate));
  }
  return data;
}

inline void add_effect(Case& data, std::size_t candidate, double size) {
  for (const auto column : data.candidates[candidate].signature.colwise()) {
    data.evidence.residuals += size * column;
  }
}

inline Eigen::MatrixXd design(const Case& data, const Set& set) {
  Eigen::MatrixXd all = data.evidence.jacobian;
  for (const std::size_t a : set) {
    const Eigen::MatrixXd& own = data.candidates[a].signature;
    all.conservativeResize(own.rows(), all.cols() + own.cols());
    all.rightCols(own.cols()) = own;
  }
  return all;
}

inline Eigen::VectorXd refitted_errors(const Eigen::MatrixXd& matrix, const Eigen::VectorXd& rhs) {
  if (matrix.cols() == 0) return rhs;
  return rhs - matrix * matrix.colPivHouseholderQr().solve(rhs);
}

}  // namespace search_cases
