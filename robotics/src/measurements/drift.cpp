#include "measurements/drift.hpp"

#include <Eigen/Geometry>
#include <Eigen/SVD>
#include <algorithm>
#include <boost/math/distributions/fisher_f.hpp>
#include <cmath>
#include <map>

#include "kinematics/rotations.hpp"
#include "llmt/statistics.hpp"

namespace llmt::robotics {
namespace {

using Points = std::map<std::string, Eigen::RowVector3d>;

// A point that was read several times in a round counts with its mean.
Points means_of(const std::vector<ReferenceReading>& round) {
  Points sums;
  std::map<std::string, double> counts;
  for (const ReferenceReading& reading : round) {
    sums.try_emplace(reading.point, Eigen::RowVector3d::Zero()).first->second += reading.position_mm.transpose();
    counts[reading.point] += 1.0;
  }
  for (auto& [name, sum] : sums) sum /= counts.at(name);
  return sums;
}

// The points of `seen` that have a place: their places and their readings, row by row.
std::pair<Eigen::MatrixXd, Eigen::MatrixXd> matched(const Points& places, const Points& seen) {
  Eigen::MatrixXd from(seen.size(), 3);
  Eigen::MatrixXd to(seen.size(), 3);
  Eigen::Index count = 0;
  for (const auto& [name, point] : seen) {
    const auto place = places.find(name);
    if (place == places.end()) continue;
    from.row(count) = place->second;
    to.row(count++) = point;
  }
  return {from.topRows(count), to.topRows(count)};
}

// Points near a line say nothing of the rotation about it.
bool spans_a_plane(const Eigen::MatrixXd& points) {
  if (points.rows() < 3) return false;
  constexpr double least_ratio = 0.05;
  const Eigen::MatrixXd centred = points.rowwise() - points.colwise().mean();
  const Eigen::VectorXd sizes = Eigen::JacobiSVD<Eigen::MatrixXd>(centred).singularValues();
  return sizes(1) > least_ratio * sizes(0);
}

Pose motion(const Points& places, const Points& seen, bool turns) {
  const auto [from, to] = matched(places, seen);
  if (from.rows() == 0) return {};
  if (turns) return kabsch(from, to);
  Pose pose;
  pose.position_mm = (to - from).colwise().mean().transpose();
  return pose;
}

Eigen::RowVector3d undone(const Pose& motion, const Eigen::RowVector3d& point) {
  return (point - motion.position_mm.transpose()) * motion.rotation;  // R' (p - t)
}

// Mean of the readings of each point, each taken back by the motion of its round.
Points mean_places(const std::vector<Points>& rounds, const std::vector<Pose>& motions) {
  std::vector<ReferenceReading> all;
  for (std::size_t k = 0; k < rounds.size(); ++k) {
    for (const auto& [name, point] : rounds[k]) {
      all.push_back({.point = name, .position_mm = undone(motions[k], point).transpose()});
    }
  }
  return means_of(all);
}

double squares(const std::vector<Points>& rounds, const std::vector<Pose>& motions, const Points& places) {
  double sum = 0.0;
  for (std::size_t k = 0; k < rounds.size(); ++k) {
    for (const auto& [name, point] : rounds[k]) sum += (undone(motions[k], point) - places.at(name)).squaredNorm();
  }
  return sum;
}

// Rests the first motion: the places become what it makes of them.
void in_first_frame(std::vector<Pose>& motions, Points& places) {
  const Pose first = motions.front();
  for (auto& [name, place] : places) place = place * first.rotation.transpose() + first.position_mm.transpose();
  for (Pose& motion : motions) {
    motion.rotation *= first.rotation.transpose();
    motion.position_mm -= motion.rotation * first.position_mm;
  }
}

Eigen::Matrix3d rotation_by(const Eigen::Vector3d& vector) {
  const double angle = vector.norm();
  if (angle == 0.0) return Eigen::Matrix3d::Identity();
  return Eigen::AngleAxisd(angle, vector / angle).toRotationMatrix();
}

}  // namespace

Drift::Drift(const std::vector<std::vector<ReferenceReading>>& rounds) {
  std::vector<Points> seen;
  for (const std::vector<ReferenceReading>& round : rounds) seen.push_back(means_of(round));
  Points places = seen.front();
  for (const Points& points : seen) turns_ = turns_ && spans_a_plane(matched(places, points).first);

  std::vector<Pose> motions(seen.size());
  constexpr int passes = 20;  // drift is small beside the distances of the points: a few are enough
  for (int pass = 0; pass < passes; ++pass) {
    for (std::size_t k = 0; k < seen.size(); ++k) motions[k] = motion(places, seen[k], turns_);
    places = mean_places(seen, motions);
  }

  const std::vector<Pose> at_rest(seen.size());
  const double resting = squares(seen, at_rest, mean_places(seen, at_rest));
  const double moving = squares(seen, motions, places);
  double readings = 0.0;
  for (const Points& points : seen) readings += 3.0 * static_cast<double>(points.size());
  const double own = (turns_ ? 6.0 : 3.0) * static_cast<double>(seen.size() - 1);
  const double left = readings - 3.0 * static_cast<double>(places.size()) - own;
  if (left > 0.0 && own > 0.0) {
    scatter_mm_ = std::sqrt(moving / left);
    const double ratio = ((resting - moving) / own) / (moving / left);
    p_value_ = moving > 0.0
                   ? boost::math::cdf(boost::math::complement(boost::math::fisher_f(own, left), std::max(ratio, 0.0)))
                   : 0.0;
  }

  in_first_frame(motions, places);
  for (const auto& [name, place] : places) centre_mm_ += place.transpose() / static_cast<double>(places.size());
  std::vector<std::pair<double, const ReferenceReading*>> misses;
  for (std::size_t k = 0; k < rounds.size(); ++k) {
    Round& round = rounds_.emplace_back();
    round.turn_rad = rotation_vector(motions[k].rotation);
    round.shift_mm = motions[k].rotation * centre_mm_ + motions[k].position_mm - centre_mm_;
    for (const ReferenceReading& reading : rounds[k]) {
      round.when += reading.when / static_cast<double>(rounds[k].size());
      const Eigen::RowVector3d place = undone(motions[k], reading.position_mm.transpose());
      misses.emplace_back((place - places.at(reading.point)).norm(), &reading);
    }
  }
  if (!scatter_mm_ || misses.empty()) return;
  Eigen::VectorXd sizes(std::ssize(misses));
  std::ranges::transform(misses, sizes.begin(), [](const auto& miss) { return miss.first; });
  constexpr double stray_factor = 8.0;
  const double limit = stray_factor * median(sizes);
  for (const auto& [miss, reading] : misses) {
    if (miss > limit) strays_.push_back(*reading);
  }
}

Pose Drift::to_first_round(double when) const {
  const auto after = std::ranges::find_if(rounds_, [&](const Round& round) { return round.when >= when; });
  const Round& next = after == rounds_.end() ? rounds_.back() : *after;
  const Round& before = after == rounds_.begin() || after == rounds_.end() ? next : *std::prev(after);
  const double span = next.when - before.when;
  const double share = span > 0.0 ? (when - before.when) / span : 0.0;
  const Eigen::Vector3d shift = before.shift_mm + share * (next.shift_mm - before.shift_mm);
  const Eigen::Vector3d turn = before.turn_rad + share * (next.turn_rad - before.turn_rad);
  // The motion p -> R (p - c) + c + s, turned round.
  Pose back;
  back.rotation = rotation_by(turn).transpose();
  back.position_mm = centre_mm_ - back.rotation * (centre_mm_ + shift);
  return back;
}

}  // namespace llmt::robotics
