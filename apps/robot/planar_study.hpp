/// \file
/// Table 1 of Benes et al. 2022, made anew: a flexible planar arm and the models of it.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "llmt/discovery/least_squares.hpp"

namespace llmt::apps {

/// Total error e_t, eq. (20), over the test grid, mm.
struct TotalError {
  double mean = 0.0;
  double max = 0.0;
};

/// One model of the arm.
struct StudyRow {
  std::string model;
  Eigen::Index training_poses = 0;
  std::vector<Eigen::Index> leaves;  ///< of the x and the y tree; empty without trees
  TotalError error;
  std::optional<TotalError> paper;  ///< as printed there
  Eigen::VectorXd total_mm = {};    ///< e_t at every pose of the test grid: figure 10 of the paper
};

/// What the paper's figures 4 to 9 show, at the poses of the test grid.
struct PlanarFigures {
  Eigen::MatrixXd joints;      ///< n x 2, rad; the second joint fastest
  Eigen::MatrixXd error;       ///< e_x and e_y of the calibrated arm, eq. (16), (17), n x 2, mm
  Eigen::MatrixXd correction;  ///< what the trees with the paper's leaf counts make of them, n x 2, mm
  Eigen::MatrixXd black_box;   ///< positions by the trees without a model, n x 2, mm
};

/// The paper's comparison on one reading of its flexible arm.
struct PlanarStudy {
  bool carry_over = true;               ///< link bending with the moment and slope that one link hands to the next
  discovery::SolverResult calibration;  ///< L2, v2, L3, v3, by the paper's modified Newton method
  std::vector<StudyRow> arm;            ///< rigid, calibrated, corrected
  std::vector<StudyRow> black_box;      ///< trees of the position itself
  /// Root mean square error in x against the noise-free residual, of a crisp tree and of a blend learned from residuals
  /// with noise of `noise_mm` (standard deviation) and at most the paper's leaves, in mm.
  double noisy_crisp = 0.0;
  double noisy_blend = 0.0;
  PlanarFigures figures;
};

inline constexpr double noise_mm = 0.02;

/// Leaf counts as in the paper. `large`: include the black box from 148 680 poses. `seed`: of the cross-validation's
/// folds.
PlanarStudy planar_study(bool carry_over, bool large, std::uint64_t seed);

}  // namespace llmt::apps
