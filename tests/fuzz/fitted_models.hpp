// Small models of every kind, as files hold them.
#pragma once

#include <Eigen/Core>
#include <cmath>
#include <limits>
#include <string>
#include <vector>

#include "llmt/fit.hpp"
#include "llmt/random.hpp"

namespace fuzz {

inline std::string fitted_model(llmt::FitOptions options, bool has_categories, Eigen::Index outputs) {
  constexpr Eigen::Index rows = 120;
  llmt::Random random(7);
  Eigen::MatrixXd x(rows, 3);
  Eigen::MatrixXd y(rows, outputs);
  for (Eigen::Index i = 0; i < rows; ++i) {
    for (Eigen::Index j = 0; j < 3; ++j) x(i, j) = random.uniform(-1.0, 1.0);
    if (has_categories) x(i, 2) = static_cast<double>(random.below(4));
    y.row(i).setConstant(std::abs(x(i, 0)) + 0.5 * x(i, 1) * x(i, 1) + 0.3 * x(i, 2) + 0.01 * random.normal());
    if (outputs > 1) y(i, 1) += x(i, 1) > 0.2 ? 1.0 : 0.0;
    if (i % 10 == 3) x(i, 1) = std::numeric_limits<double>::quiet_NaN();
  }
  options.max_leaves = options.max_leaves > 0 ? options.max_leaves : 5;
  options.significance = 1.0;
  options.folds.count = 0;
  options.max_threads = 1;
  llmt::TrainingData data{x, y};
  if (has_categories) data.categorical_inputs = {2};
  return to_json(llmt::fit(data, options).model);
}

// Every second output is clamped.
inline std::string clamped(const std::string& text) {
  constexpr double open = std::numeric_limits<double>::infinity();
  const llmt::Model model = llmt::from_json(text);
  std::vector<llmt::Partition> partitions = model.partitions();
  for (llmt::Partition& partition : partitions) {
    partition.output_range.resize(std::ssize(partition.outputs), 2);
    for (Eigen::Index o = 0; o < partition.output_range.rows(); ++o) {
      const llmt::OutputColumn& output = model.outputs()[partition.outputs[o]];
      partition.output_range.row(o) << (o % 2 == 0 ? output.low : -open), (o % 2 == 0 ? output.high : open);
    }
  }
  return to_json(llmt::Model(model.inputs(), model.outputs(), model.regressors(), partitions));
}

inline const std::vector<std::string>& fitted_models() {
  static const std::vector<std::string> models = [] {
    std::vector<std::string> all;
    for (const llmt::ValidityChoice validity :
         {llmt::ValidityChoice::crisp, llmt::ValidityChoice::blend, llmt::ValidityChoice::gaussian}) {
      all.push_back(fitted_model({.validity = validity}, false, 1));
      all.push_back(fitted_model({.shared_partition = true, .validity = validity}, true, 2));
    }
    all.push_back(fitted_model({.rule = llmt::GrowthRule::hilomot}, false, 1));
    all.push_back(fitted_model({.rule = llmt::GrowthRule::m5}, true, 1));
    all.push_back(fitted_model({.terms = llmt::LocalTerms::quadratic}, false, 1));
    all.push_back(fitted_model({.max_leaves = 1}, true, 2));
    all.push_back(clamped(all[1]));
    all.push_back(clamped(all[2]));
    return all;
  }();
  return models;
}

}  // namespace fuzz
