#include "fit/plan/preliminary.hpp"

namespace llmt {

FitOptions preliminary_options(const FitOptions& options) {
  return {.max_leaves = options.max_leaves,
          .min_leaf_samples = options.min_leaf_samples,
          .split_inputs = options.split_inputs,
          .regression_inputs = options.regression_inputs,
          .choose_inputs = false,
          .shared_partition = options.shared_partition,
          .validity = ValidityChoice::crisp,
          .folds = options.folds,
          .intervals = false,
          .max_threads = options.max_threads};
}

}  // namespace llmt
