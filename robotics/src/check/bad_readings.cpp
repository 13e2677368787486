#include "check/bad_readings.hpp"

#include <Eigen/Eigenvalues>
#include <Eigen/QR>
#include <algorithm>
#include <cmath>

#include "check/f_tail.hpp"

namespace llmt::robotics {
namespace {

// The shift of one reading, tested by what the others say.
struct Shift {
  Eigen::Index reading = -1;
  double probability = 1.0;
  double taken = 0.0;  // of the squares
};

// An orthonormal basis of the columns.
Eigen::MatrixXd basis_of(Eigen::MatrixXd columns) {
  for (auto column : columns.colwise()) column.stableNormalize();
  Eigen::ColPivHouseholderQR<Eigen::MatrixXd> factors(columns);
  factors.setThreshold(1e-7);
  return factors.householderQ() * Eigen::MatrixXd::Identity(columns.rows(), factors.rank());
}

Shift likeliest_shift(const Eigen::MatrixXd& jacobian, const Eigen::VectorXd& residuals,
                      const std::vector<Eigen::Index>& reading_of, Eigen::Index readings) {
  const Eigen::MatrixXd basis = basis_of(jacobian);
  const Eigen::VectorXd left = residuals - basis * (basis.transpose() * residuals);
  const auto freedom = static_cast<double>(left.size() - basis.cols());
  // The rounding of positions of metres, mm.
  constexpr double least_noise = 1e-9;
  const double squares = left.squaredNorm() + freedom * least_noise * least_noise;
  std::vector<std::vector<Eigen::Index>> rows(readings);
  for (std::size_t i = 0; i < reading_of.size(); ++i) rows[reading_of[i]].push_back(static_cast<Eigen::Index>(i));
  const auto tests = static_cast<double>(std::ranges::count_if(rows, [](const auto& own) { return !own.empty(); }));
  Shift best;
  for (Eigen::Index k = 0; k < readings; ++k) {
    if (rows[k].empty()) continue;
    const Eigen::MatrixXd own = basis(rows[k], Eigen::all);
    const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> spread(Eigen::MatrixXd::Identity(own.rows(), own.rows()) -
                                                                own * own.transpose());
    // What no other reading says of a direction cannot contradict this one.
    constexpr double least_share = 0.01;
    double taken = 0.0;
    double directions = 0.0;
    for (Eigen::Index d = 0; d < own.rows(); ++d) {
      if (spread.eigenvalues()(d) < least_share) continue;
      taken += std::pow(spread.eigenvectors().col(d).dot(left(rows[k])), 2) / spread.eigenvalues()(d);
      directions += 1.0;
    }
    const double behind = freedom - directions;
    if (directions == 0.0 || behind < 1.0) continue;
    const double rest = std::max(squares - taken, freedom * least_noise * least_noise);
    const double probability = tests * f_tail(taken / directions / (rest / behind), directions, behind);
    if (best.reading < 0 || probability < best.probability || (probability == best.probability && taken > best.taken)) {
      best = {k, probability, taken};
    }
  }
  return best;
}

}  // namespace

std::vector<Eigen::Index> bad_readings(const Eigen::MatrixXd& jacobian, const Eigen::VectorXd& residuals,
                                       const std::vector<Eigen::Index>& reading_of, Eigen::Index most, double level) {
  const Eigen::Index readings = reading_of.empty() ? 0 : std::ranges::max(reading_of) + 1;
  std::vector<Eigen::Index> rows(residuals.size());
  for (std::size_t i = 0; i < rows.size(); ++i) rows[i] = static_cast<Eigen::Index>(i);
  std::vector<Eigen::Index> tried;
  std::size_t bad = 0;
  while (std::ssize(tried) < most) {
    std::vector<Eigen::Index> own;
    for (const Eigen::Index row : rows) own.push_back(reading_of[row]);
    const Shift shift = likeliest_shift(jacobian(rows, Eigen::all), residuals(rows), own, readings);
    if (shift.reading < 0) break;
    tried.push_back(shift.reading);
    if (shift.probability < level) bad = tried.size();
    std::erase_if(rows, [&](Eigen::Index row) { return reading_of[row] == shift.reading; });
  }
  tried.resize(bad);
  return tried;
}

}  // namespace llmt::robotics
