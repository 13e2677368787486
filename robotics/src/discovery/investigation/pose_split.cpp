#include "discovery/investigation/pose_split.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <numeric>
#include <stdexcept>
#include <string>
#include <tuple>

#include "llmt/random.hpp"

namespace llmt::robotics {
namespace {

std::vector<Eigen::Index> all_rows(Eigen::Index count) {
  std::vector<Eigen::Index> rows(count);
  std::iota(rows.begin(), rows.end(), 0);
  return rows;
}

const Eigen::VectorXd* column(const Poses& poses, const char* name) {
  const auto found = poses.covariates.find(name);
  return found == poses.covariates.end() ? nullptr : &found->second;
}

Measurements averaged(const Measurements& measurements, Repeats repeats,
                      std::vector<std::vector<Eigen::Index>>& samples) {
  const Eigen::VectorXd* pose = column(measurements.poses, "pose");
  const Eigen::VectorXd* dwelled = column(measurements.poses, "dwelled");
  const Eigen::VectorXd* returned = column(measurements.poses, "returned");
  const std::vector<Eigen::Index> repeated = repeats_of(measurements.poses);
  std::map<Eigen::Index, std::size_t> groups;
  samples.clear();
  for (Eigen::Index i = 0; i < measurements.count(); ++i) {
    const bool stood_still =
        (dwelled != nullptr && (*dwelled)(i) != 0.0) || (returned != nullptr && (*returned)(i) == 0.0);
    if (pose != nullptr && (stood_still || repeats == Repeats::averaged)) {
      const auto [group, is_new] = groups.try_emplace(repeated[i], samples.size());
      if (!is_new) {
        samples[group->second].push_back(i);
        continue;
      }
    }
    samples.push_back({i});
  }
  if (std::ssize(samples) == measurements.count()) return measurements;
  std::vector<Eigen::Index> first;
  for (const auto& sample : samples) first.push_back(sample.front());
  Measurements result = select(measurements, first);
  for (Eigen::Index row = 0; row < std::ssize(samples); ++row) {
    result.positions_mm.row(row) = mean_reading(measurements, samples[row]);
    result.poses.joints.row(row) = measurements.poses.joints(samples[row], Eigen::all).colwise().mean();
    for (auto& [name, values] : result.poses.covariates) {
      values(row) = measurements.poses.covariates.at(name)(samples[row]).mean();
    }
  }
  return result;
}

}  // namespace

PoseSplit set_aside(const Measurements& measurements, const std::optional<Measurements>& test, double share,
                    std::uint64_t seed, Repeats repeats) {
  PoseSplit split;
  std::vector<Eigen::Index> searched = all_rows(measurements.count());
  if (test) {
    split.test = *test;
  } else if (share > 0.0) {
    const std::vector<double> labels = pose_labels(measurements.poses);
    std::map<double, std::vector<Eigen::Index>> groups;
    for (const Eigen::Index i : searched) groups[labels.empty() ? static_cast<double>(i) : labels[i]].push_back(i);
    std::vector<std::vector<Eigen::Index>> units;
    for (auto& [number, rows] : groups) units.push_back(rows);
    Random random(seed);
    const std::vector<Eigen::Index> order = random.permutation(std::ssize(units));
    const auto aside = static_cast<Eigen::Index>(std::lround(share * static_cast<double>(units.size())));
    std::vector<Eigen::Index> tested;
    searched.clear();
    for (Eigen::Index k = 0; k < std::ssize(order); ++k) {
      auto& target = k < aside ? tested : searched;
      const auto& unit = units[order[k]];
      target.insert(target.end(), unit.begin(), unit.end());
    }
    std::ranges::sort(searched);
    std::ranges::sort(tested);
    split.test = select(measurements, tested);
    split.aside = std::move(tested);
  }
  split.searched = select(measurements, searched);
  split.samples = averaged(split.searched, repeats, split.rows);
  for (std::vector<Eigen::Index>& sample : split.rows) {
    for (Eigen::Index& row : sample) row = searched[row];
  }
  return split;
}

std::vector<Eigen::Index> repeats_of(const Poses& poses) {
  const Eigen::VectorXd* pose = column(poses, "pose");
  if (pose == nullptr) return {};
  // Only readings of the same kind and target are repeats of each other.
  std::map<std::tuple<double, std::string, std::string, Reading>, Eigen::Index> numbers;
  std::vector<Eigen::Index> repeats;
  for (Eigen::Index i = 0; i < poses.count(); ++i) {
    const Observation seen = poses.observations.empty() ? Observation{} : poses.observations[i];
    const auto key = std::make_tuple((*pose)(i), seen.base, seen.tool, seen.reading);
    repeats.push_back(numbers.try_emplace(key, std::ssize(numbers)).first->second);
  }
  return repeats;
}

Eigen::VectorXd stacked(const Eigen::MatrixXd& points, const std::vector<Eigen::Index>& coordinates) {
  const Eigen::MatrixXd by_pose = points.transpose();
  const Eigen::VectorXd all = by_pose.reshaped();
  return all(coordinates);
}

}  // namespace llmt::robotics
