/// \file
/// One tree taught by a more accurate model: it is fitted to that model's answers, on the rows of the data and on many
/// rows that were made of them. docs/algorithms/teaching.md has the equations.
///
///     const llmt::TaughtResult taught = llmt::fit_taught({inputs, outputs});
///     const llmt::TaughtPartition& errors = taught.partitions[0];   // all three on the same held-out rows
///     std::printf("one tree %g, taught %g, sum %g\n", errors.alone, errors.taught, errors.teacher);
///     llmt::save(taught.fit.model, taught.fit.intervals, "model.json");
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "llmt/abi.hpp"
#include "llmt/fit.hpp"
#include "llmt/progress.hpp"
#include "llmt/training_data.hpp"

namespace llmt {

/// What a teacher has learned: its predictions (rows x outputs) for inputs as in TrainingData (rows x inputs).
using Answers = std::function<Eigen::MatrixXd(const Eigen::Ref<const Eigen::MatrixXd>& inputs)>;

/// Learns from rows, and answers. It may be called on several threads at a time.
using Teacher = std::function<Answers(const TrainingData& rows, const Progress& progress)>;

struct TeachOptions {
  Teacher teacher = {};                 ///< empty: fit_boosted()
  int made_rows = 4;                    ///< made of each row; 0: none
  Eigen::Index most_made_rows = 20000;  ///< made in all, of evenly spaced rows
  int neighbours = 10;                  ///< with one of so many nearest rows a row swaps coordinates
  double swapped = 0.5;                 ///< probability that a coordinate is swapped
  std::uint64_t seed = 1;               ///< of the made rows, and of fit_boosted()
};

/// Root mean square errors on the same held-out rows, as CandidateError::rmse. The teacher of a fold has not seen the
/// rows that the fold holds out, nor rows that were made of them: the error is that of the whole procedure.
struct TaughtPartition {
  std::vector<int> outputs;  ///< columns that the partition serves
  double alone = 0.0;        ///< of the tree that is fitted to the data
  double taught = 0.0;       ///< of the tree that is fitted to the teacher's answers
  double teacher = 0.0;      ///< of the teacher
};

struct TaughtResult {
  FitResult fit;                            ///< of the tree that is taken
  PreparedFit prepared;                     ///< what it was made from, for fit_readable()
  std::vector<TaughtPartition> partitions;  ///< as those of the fit
  bool is_taken = false;                    ///< whether it is the taught tree: its held-out error is smaller
  Eigen::Index made_rows = 0;               ///< of the model's tree
};

/// Fits a tree twice, to the data and to a teacher's answers, and takes the one with the smaller held-out error (over
/// several partitions the mean of the errors, each divided by that of the data's tree).
///
/// The taught tree is that of fit() for the rows {(x_i, t(x_i))} and {(m, t(m))}, t the teacher. A made row m has the
/// coordinates of a row x, of which each is that of one of its nearest rows instead with the probability
/// TeachOptions::swapped; it has the weight of x. Learning from a model's answers on made rows is that of Craven and
/// Shavlik (1996), Breiman and Shang (1996) and Bucila et al. (2006), who made rows by swapping coordinates.
///
/// What is chosen on held-out rows (leaves, validities, inputs) is chosen by their measured outputs. So are intervals.
/// Codes are those that the data chose. Inputs may be missing: a missing cell is swapped as any other. All options of a
/// fit are taken but those of why_not_taught(); weights, groups and TrainingData::held_out mean what they mean there.
///
/// Throws std::invalid_argument as fit(), with the words of why_not_taught() if there are any, if there are too few
/// rows to hold some out, if an option is out of range, and what the teacher throws: as fit_boosted() for fewer than 10
/// different rows in a fold. Throws std::runtime_error if the
/// answers of the teacher are not finite, or not one a row and output.
TaughtResult fit_taught(const PreparedFit& prepared, const TeachOptions& teach = {}, const Progress& progress = {});
TaughtResult fit_taught(const TrainingData& data, const FitOptions& options = {}, const TeachOptions& teach = {},
                        const Progress& progress = {});

/// The option that teaching does not go with, and why. Empty: there is none.
std::string why_not_taught(const FitOptions& options);

}  // namespace llmt
