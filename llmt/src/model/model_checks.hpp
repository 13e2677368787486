/// \file
/// Checks of a model: its parts must fit together, and its numbers must be such as a fit or a stream makes.
#pragma once

#include <stdexcept>
#include <string>
#include <vector>

#include "llmt/partition.hpp"

namespace llmt {

/// A part of a model.
struct ModelPart {
  const char* list = "";        ///< "input", "output", "regressor" or "partition"; empty: the model itself
  Eigen::Index index = 0;       ///< in that list
  Eigen::Index node = -1;       ///< of a partition; -1: all of it
  std::string words() const;    ///< "partition 0 node 3: "
  std::string pointer() const;  ///< in the JSON of the model, "/partitions/0/nodes/3"
};

/// What is wrong with a part. what(): "llmt::Model: partition 0 node 3: problem".
class ModelFault : public std::invalid_argument {
 public:
  ModelFault(const ModelPart& part, const std::string& problem)
      : std::invalid_argument("llmt::Model: " + part.words() + problem), pointer_(part.pointer()), problem_(problem) {}

  const std::string& pointer() const { return pointer_; }
  const std::string& problem() const { return problem_; }

 private:
  std::string pointer_;
  std::string problem_;
};

/// Throws ModelFault for the first part that does not fit: see Model::Model().
void check_model(const std::vector<InputColumn>& inputs, const std::vector<OutputColumn>& outputs,
                 const std::vector<Regressor>& regressors, const std::vector<Partition>& partitions);

/// Throws ModelFault if two inputs, two outputs or two levels of an input have one name.
void check_names(const std::vector<InputColumn>& inputs, const std::vector<OutputColumn>& outputs);

/// The part of check_model() that needs one node alone. Afterwards its numbers have the right shapes.
void check_node(const Partition& partition, const ModelPart& part, const std::vector<InputColumn>& inputs,
                Eigen::Index regressors);

/// The range of a regressor in training, as deviations from its centre.
struct RegressorRange {
  double low = 0.0;
  double high = 0.0;
};

/// Throws ModelFault if a centre lies outside of the training extent. Inputs and regressors are known to be finite and
/// to exist.
std::vector<RegressorRange> check_centres(const std::vector<InputColumn>& inputs,
                                          const std::vector<Regressor>& regressors);

/// Throws ModelFault if numbers of a partition's nodes are not such as training rows with these regressors leave.
void check_plausible(const Partition& partition, Eigen::Index index, const std::vector<RegressorRange>& regressors,
                     const std::vector<OutputColumn>& outputs);

}  // namespace llmt
