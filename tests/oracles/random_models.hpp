// Models that are put together at random, of numbers that a fit could make.
#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <limits>
#include <ostream>
#include <string>
#include <vector>

#include "llmt/model.hpp"
#include "llmt/random.hpp"

namespace random_models {

using llmt::ValidityKind;

/// What a random model is like.
struct Kind {
  std::string name;
  ValidityKind validity = ValidityKind::crisp;
  int inputs = 3;
  int categories = 0;  // inputs with levels, behind the numbers
  int outputs = 1;
  bool shared = false;  // one partition for all outputs
  int leaves = 20;
  bool oblique = false;  // splits on numbers
  bool clamped = false;  // every second output
};

/// For GoogleTest.
inline void PrintTo(const Kind& kind, std::ostream* out) { *out << kind.name; }

inline Eigen::VectorXd normal(Eigen::Index size, llmt::Random& random) {
  Eigen::VectorXd values(size);
  for (double& value : values) {
    value = random.normal();
  }
  return values;
}

// Its ranges are cut out of low ... high.
inline llmt::Node local_model(Eigen::Index outputs, const Eigen::VectorXd& low, const Eigen::VectorXd& high,
                              llmt::Random& random) {
  const Eigen::Index regressors = low.size();
  llmt::Node node;
  node.samples = 100;
  node.rank = static_cast<int>(regressors) + 1;
  node.rss = normal(outputs, random).cwiseAbs();
  node.value = normal(outputs, random);
  node.slope = normal(outputs * regressors, random).reshaped(outputs, regressors);
  node.mean = 0.1 * normal(regressors, random);
  const auto part = [&](double bound) { return bound * random.uniform(0.8, 1.05); };
  node.low = low.unaryExpr(part).cwiseMax(low);
  node.high = high.unaryExpr(part).cwiseMin(high);
  const Eigen::MatrixXd factor =
      normal((regressors + 1) * (regressors + 1), random).reshaped(regressors + 1, regressors + 1);
  node.inverse_gram = factor * factor.transpose();
  return node;
}

inline llmt::Partition random_partition(const Kind& kind, std::vector<int> outputs,
                                        const std::vector<llmt::InputColumn>& inputs, Eigen::Index regressors,
                                        llmt::Random& random) {
  const Eigen::Index served = std::ssize(outputs);
  llmt::Partition partition{.outputs = std::move(outputs),
                            .validity = {kind.validity, kind.validity == ValidityKind::gaussian ? 0.4 : 1.0},
                            .nodes = {}};
  const Eigen::VectorXd reach = Eigen::VectorXd::Constant(regressors, 1.2);
  partition.nodes = {local_model(served, -reach, reach, random)};
  std::vector<Eigen::VectorXd> low = {Eigen::VectorXd::Constant(kind.inputs, -1.0)};
  std::vector<Eigen::VectorXd> high = {Eigen::VectorXd::Constant(kind.inputs, 1.0)};
  while (partition.num_leaves() < kind.leaves) {
    std::size_t index = 0;
    do {
      index = static_cast<std::size_t>(random.uniform() * static_cast<double>(partition.nodes.size()));
    } while (!partition.nodes[index].is_leaf());
    const int count = static_cast<int>(partition.nodes.size());
    low.insert(low.end(), 2, Eigen::VectorXd(low[index]));
    high.insert(high.end(), 2, Eigen::VectorXd(high[index]));
    llmt::Node& node = partition.nodes[index];
    node.left = count;
    node.right = count + 1;
    node.split_input = static_cast<int>(random.uniform() * static_cast<double>(inputs.size()));
    node.missing_left = random.uniform() < 0.3 ? 1.0 : random.uniform();
    const llmt::InputColumn& input = inputs[node.split_input];
    if (input.is_categorical()) {
      for (std::size_t level = 0; level < input.levels.size(); ++level) {
        node.level_side.push_back(static_cast<int>(random.uniform() * 3.0) - 1);
      }
    } else {
      const double from = low[index](node.split_input);
      const double to = high[index](node.split_input);
      node.threshold = from + random.uniform(0.2, 0.8) * (to - from);
      high[count](node.split_input) = node.threshold;
      low[count + 1](node.split_input) = node.threshold;
      if (kind.validity == ValidityKind::blend && random.uniform() < 0.9) {
        node.half_width = std::min(node.threshold - from, to - node.threshold);
      }
      if (kind.validity == ValidityKind::logistic && random.uniform() < 0.9) {
        node.half_width = random.uniform() < 0.2 ? 0.001 : 0.2;
      }
      if (kind.oblique) {
        node.direction = Eigen::VectorXd::Zero(kind.inputs);
        for (int j = 0; j < kind.inputs - kind.categories; ++j) {
          node.direction(j) = random.uniform() < 0.8 ? random.normal() : 0.0;
        }
        node.direction(node.split_input) += 1.5;
        node.threshold = random.uniform(-0.5, 0.5);
      }
    }
    for (int child = 0; child < 2; ++child) {
      const llmt::Node& parent = partition.nodes[index];
      partition.nodes.push_back(local_model(served, parent.low, parent.high, random));
    }
  }
  partition.outer_slope = 0.5 * partition.nodes.front().slope;
  partition.residual_range.resize(served, 2);
  partition.residual_range << Eigen::VectorXd::Constant(served, -3.0), Eigen::VectorXd::Constant(served, 2.5);
  if (kind.clamped) {
    constexpr double open = std::numeric_limits<double>::infinity();
    partition.output_range.resize(served, 2);
    for (Eigen::Index o = 0; o < served; ++o) {
      const bool is_open = partition.outputs[o] % 2 != 0;
      partition.output_range.row(o) << (is_open ? -open : -0.7), (is_open ? open : 0.9);
    }
  }
  return partition;
}

// Indicators of levels lie within 0 ... 1.
inline void hold_indicators(const std::vector<llmt::Regressor>& regressors, llmt::Partition& partition) {
  for (llmt::Node& node : partition.nodes) {
    for (std::size_t k = 0; k < regressors.size(); ++k) {
      if (regressors[k].level < 0) continue;
      for (Eigen::VectorXd* values : {&node.mean, &node.low, &node.high}) {
        double& value = (*values)(static_cast<Eigen::Index>(k));
        value = std::clamp(value, -regressors[k].centre, 1.0 - regressors[k].centre);
      }
    }
  }
}

inline llmt::Model random_model(const Kind& kind, std::uint64_t seed) {
  llmt::Random random(seed);
  std::vector<llmt::InputColumn> inputs;
  std::vector<llmt::Regressor> regressors;
  for (int j = 0; j < kind.inputs; ++j) {
    inputs.push_back({.name = std::to_string(j), .low = -1.6, .high = 1.6, .centre = kind.oblique ? 0.1 : 0.0});
    if (j < kind.inputs - kind.categories) {
      regressors.push_back({.input = j, .level = -1, .centre = 0.1 * random.normal()});
      continue;
    }
    inputs.back().levels = {"a", "b", "c", seed % 2 == 0 ? "" : "d"};  // the last one may be that of missing values
    for (const int level : seed % 2 == 0 ? std::vector{0, 3} : std::vector{0, 2}) {
      regressors.push_back({.input = j, .level = level, .centre = 0.25});
    }
  }
  std::vector<llmt::OutputColumn> outputs;
  std::vector<int> all;
  for (int o = 0; o < kind.outputs; ++o) {
    outputs.push_back({.name = std::to_string(o), .low = -5.0, .high = 5.0});
    all.push_back(o);
  }
  std::vector<llmt::Partition> partitions;
  if (kind.shared) {
    partitions.push_back(random_partition(kind, all, inputs, std::ssize(regressors), random));
  } else {
    for (const int o : all) {
      partitions.push_back(random_partition(kind, {o}, inputs, std::ssize(regressors), random));
    }
  }
  for (llmt::Partition& partition : partitions) hold_indicators(regressors, partition);
  return {inputs, outputs, regressors, partitions};
}

}  // namespace random_models
