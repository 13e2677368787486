/// \file
/// Rows with a teacher's answers, which a tree is fitted to in place of the measured ones.
#pragma once

#include <Eigen/Core>
#include <memory>
#include <vector>

#include "data/training.hpp"

namespace llmt {

/// What one tree learns from: rows of the data, and others that were made.
struct Lesson {
  Eigen::MatrixXd inputs;   ///< rows x inputs
  Eigen::MatrixXd outputs;  ///< the teacher's answers
  Eigen::VectorXd weights;  ///< one a row, positive
};

/// The lesson of the model, and that of the tree of each fold, whose teacher has not seen the rows that are held out.
struct Lessons {
  std::shared_ptr<const Lesson> of_all;
  std::vector<std::shared_ptr<const Lesson>> of_folds;
};

/// The same training with trees that learn from lessons. All errors remain those on measured outputs: of held-out rows,
/// and of the rows of the model.
Training taught(Training training, std::shared_ptr<const Lessons> lessons);

/// The lessons of a training; null: the trees learn from the data.
std::shared_ptr<const Lessons> lessons_of(const Training& training);

}  // namespace llmt
