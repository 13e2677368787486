// What a search knows of the errors of the inputs, and what it does about them.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "discovery/recording/row_split.hpp"
#include "discovery/terms/input_noise.hpp"

namespace llmt::discovery {

struct ErrorsOfInputs {
  std::unique_ptr<const InputNoise> noise;  ///< none where no errors are known, or cannot be taken out
  Eigen::VectorXd deviations;               ///< standard deviations, one an input; empty where noise is none
  std::vector<std::string> uncorrected;     ///< labels of terms whose estimates could not be corrected
  std::vector<std::string> notes;
};

/// Takes rows out of the split at which the sign of an input is not known. `start`: values of the parameters.
ErrorsOfInputs errors_of_inputs(const TermModel& model, const MeasuredOutputs& measured, const Eigen::VectorXd& start,
                                RowSplit& split);

/// Corrects the estimates of the fit, and remembers those that cannot be corrected.
void correct_estimates(ErrorsOfInputs& errors, const TermData& kept, TermFit& fit);

/// Terms that consist of errors more than of anything else are tentative.
void doubt_uncorrected(const ErrorsOfInputs& errors, Missing& missing);

}  // namespace llmt::discovery
