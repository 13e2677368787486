#include "discovery/gap_map.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>

#include "linear_algebra/linear_algebra.hpp"
#include "llmt/explain.hpp"

namespace llmt::robotics {
namespace {

struct Inputs {
  std::vector<std::string> names;
  std::vector<std::string> units;
  Eigen::MatrixXd values;
};

// Joints in degrees, and all covariates that vary.
Inputs inputs_of(const Measurements& measurements, const Chain& chain) {
  Inputs inputs;
  std::vector<Eigen::VectorXd> columns;
  for (std::size_t j = 0; j < chain.joints.size(); ++j) {
    columns.emplace_back(to_limit_unit(chain.joints[j]) * measurements.poses.joints.col(j));
    inputs.names.push_back(fmt::format("q{}", j + 1));
    inputs.units.push_back(fmt::format(" {}", limit_unit(chain.joints[j])));
  }
  for (const auto& [name, values] : measurements.poses.covariates) {
    const bool wanted =
        name == "payload_kg" || name == "temp_C" || name == "order" || name == "time_s" || name.starts_with("dir");
    if (!wanted || !(values.maxCoeff() > values.minCoeff())) continue;
    columns.push_back(values);
    inputs.names.push_back(name);
    inputs.units.emplace_back("");
  }
  inputs.values.resize(measurements.count(), std::ssize(columns));
  for (std::size_t c = 0; c < columns.size(); ++c) inputs.values.col(c) = columns[c];
  return inputs;
}

std::string conditions_of(const Leaf& leaf, const Inputs& inputs) {
  std::vector<std::string> parts;
  for (std::size_t c = 0; c < inputs.names.size(); ++c) {
    const double low = leaf.low(c);
    const double high = leaf.high(c);
    if (std::isfinite(low) && std::isfinite(high)) {
      parts.push_back(fmt::format("{} from {:.4g} to {:.4g}{}", inputs.names[c], low, high, inputs.units[c]));
    } else if (std::isfinite(low)) {
      parts.push_back(fmt::format("{} above {:.4g}{}", inputs.names[c], low, inputs.units[c]));
    } else if (std::isfinite(high)) {
      parts.push_back(fmt::format("{} up to {:.4g}{}", inputs.names[c], high, inputs.units[c]));
    }
  }
  return parts.empty() ? "everywhere" : fmt::format("{}", fmt::join(parts, ", "));
}

FitOptions tree_options(Eigen::Index samples) {
  FitOptions options;
  constexpr int most_regions = 6;
  options.max_leaves = most_regions;
  options.min_leaf_samples = static_cast<int>(std::max<Eigen::Index>(8, samples / 25));
  options.validity = ValidityChoice::crisp;
  options.intervals = false;
  return options;
}

void add_regions(const Inputs& inputs, const Eigen::VectorXd& size, GapMap& map) {
  TrainingData data{inputs.values, size};
  data.may_have_codes = false;
  const Model model = fit(data, tree_options(size.size())).model;
  const std::vector<Leaf> leaves = model.leaves(0);
  if (leaves.size() < 2) return;
  std::vector<double> sum(leaves.size(), 0.0);
  std::vector<Eigen::Index> count(leaves.size(), 0);
  for (Eigen::Index i = 0; i < size.size(); ++i) {
    for (std::size_t k = 0; k < leaves.size(); ++k) {
      const auto row = inputs.values.row(i).transpose().array();
      if ((row > leaves[k].low.array()).all() && (row <= leaves[k].high.array()).all()) {
        sum[k] += size(i);
        ++count[k];
      }
    }
  }
  for (std::size_t k = 0; k < leaves.size(); ++k) {
    if (count[k] == 0) continue;
    map.regions.push_back({conditions_of(leaves[k], inputs), count[k], sum[k] / static_cast<double>(count[k])});
  }
  std::ranges::stable_sort(map.regions, std::greater<>{}, &GapMap::Region::mean_mm);
}

void add_dependences(const Inputs& inputs, const Eigen::MatrixXd& residuals, GapMap& map) {
  std::vector<Eigen::Index> axes;
  for (Eigen::Index axis = 0; axis < 3; ++axis) {
    if (!residuals.col(axis).isZero(0.0)) axes.push_back(axis);
  }
  if (axes.empty()) return;
  const Eigen::MatrixXd outputs = columns_of(residuals, axes);
  const Model model = fit(inputs.values, outputs, tree_options(outputs.rows())).model;
  const Eigen::MatrixXd shares = importance(model, inputs.values);
  const Eigen::VectorXd energy = outputs.colwise().squaredNorm().transpose() / outputs.squaredNorm();
  const Eigen::VectorXd weights = transposed_product(shares, energy);
  for (std::size_t c = 0; c < inputs.names.size(); ++c) {
    const double share = weights(c);
    if (share > 0.02) map.depends_on.push_back({inputs.names[c], share});
  }
  std::ranges::stable_sort(map.depends_on, std::greater<>{}, &GapMap::Share::share);
}

void add_levers(const Robot& robot, const Measurements& measurements, const Eigen::MatrixXd& world, GapMap& map) {
  const Eigen::MatrixXd motions = joint_motions(robot, measurements.poses);
  const Chain& chain = robot.chain;
  Eigen::VectorXd along = Eigen::VectorXd::Zero(std::ssize(chain.joints));
  for (Eigen::Index i = 0; i < measurements.count(); ++i) {
    for (Eigen::Index j = 0; j < along.size(); ++j) {
      Eigen::Vector3d lever = motions.col(j).segment(3 * i, 3);
      for (Eigen::Index axis = 0; axis < 3; ++axis) {
        if (!measurements.measured[axis]) lever(axis) = 0.0;
      }
      if (lever.squaredNorm() > 0.0) along(j) += std::pow(lever.dot(world.row(i)), 2) / lever.squaredNorm();
    }
  }
  const double total = world.squaredNorm();
  if (!(total > 0.0)) return;
  for (Eigen::Index j = 0; j < along.size(); ++j) {
    map.acts_like.push_back({chain.joints[j].name, along(j) / total});
  }
  std::ranges::stable_sort(map.acts_like, std::greater<>{}, &GapMap::Share::share);
}

}  // namespace

GapMap gap_map(const Robot& robot, const Measurements& searched) {
  constexpr Eigen::Index fewest = 24;
  GapMap map;
  Eigen::MatrixXd world = searched.positions_mm - positions(robot, searched.poses);
  for (Eigen::Index axis = 0; axis < 3; ++axis) {
    if (!searched.measured[axis]) world.col(axis).setZero();
  }
  add_levers(robot, searched, world, map);
  if (searched.count() < fewest) return map;
  const Inputs inputs = inputs_of(searched, robot.chain);
  add_regions(inputs, row_norms(world), map);
  add_dependences(inputs, world, map);
  return map;
}

}  // namespace llmt::robotics
