// The one place of the test of bytes that sets options of llmt::fit().
#pragma once

#include <string>
#include <vector>

#include "bytes/samples.hpp"
#include "llmt/fit.hpp"

namespace bytes {

/// Data and options of one fit.
struct Task {
  Sample sample;
  llmt::FitOptions options;
  llmt::TrainingData known = {};  // of the rows and columns of the sample
};

struct GrowthRuleName {
  std::string name;
  llmt::GrowthRule rule;
};

/// A name, and what it changes in the task of a growth rule.
struct OptionSet {
  std::string name;
  void (*apply)(Task& task);
};

const std::vector<GrowthRuleName>& growth_rules();
const std::vector<OptionSet>& option_sets();

/// The task that option sets change: 240 rows, 3 folds, everything else by default.
Task make_task(llmt::GrowthRule rule, int threads);

}  // namespace bytes
