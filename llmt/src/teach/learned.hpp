/// \file
/// What teachers make of the rows of a fit.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "data/lessons.hpp"
#include "llmt/progress.hpp"
#include "llmt/teach.hpp"

namespace llmt {

/// The lessons of a fit, and each fold's teacher on the rows that it has not seen.
struct Taught {
  Lessons lessons;
  std::vector<Eigen::MatrixXd> held_out;  ///< answers for FoldRows::held_out
};

/// Has a teacher learn from the rows of the model and of each fold, and writes down its answers. Throws as
/// fit_taught(). `work`: of this.
Taught teach(const Training& training, const TeachOptions& options, Work& work);

}  // namespace llmt
