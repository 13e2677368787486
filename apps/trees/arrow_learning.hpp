/// \file
/// Rows of Arrow files to learn from.
#pragma once

#include <Eigen/Core>
#include <span>
#include <string>

#include "shared/table_files.hpp"
#include "trees/learning.hpp"

namespace llmt::apps {

/// Physical memory of the machine, in bytes.
double physical_memory();

/// Names the file, the row and the column of what cannot be learned from. `rows`, from row `first` on, has `inputs`
/// inputs, which may be missing, the target, and the weight if there is one.
void check_rows(const TableFiles& table, std::span<const std::string> columns, Eigen::Index inputs,
                const Eigen::MatrixXd& rows, Eigen::Index first);

/// The whole table in memory, for commands that cannot learn from pieces of it. Throws std::runtime_error that says
/// what to do if it is too large for that, and as read_learning_table().
LearningTable read_arrow_learning_table(const LearningArguments& arguments);

}  // namespace llmt::apps
