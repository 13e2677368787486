#include "measurements/sightings.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <stdexcept>

namespace llmt::robotics {
namespace {

using Words = std::vector<std::string>;  // of the rows; empty without such a column

std::string word_of(const Words& words, Eigen::Index row) { return words.empty() ? "" : words[row]; }

std::vector<Sighting> distances_of(const Csv& csv, const Header& header) {
  std::vector<Sighting> seen;
  const Eigen::VectorXd distances = header.distances_mm();
  for (Eigen::Index row = 0; row < csv.rows(); ++row) seen.push_back({row, "", {distances(row), 0.0, 0.0}});
  return seen;
}

std::vector<Sighting> planes_of(const Csv& csv, const Words& targets) {
  std::vector<Sighting> seen;
  for (Eigen::Index row = 0; row < csv.rows(); ++row) {
    seen.push_back({.row = row, .target = word_of(targets, row), .feature = "plane"});
  }
  return seen;
}

// Beside sockets, of the rows that name a sphere.
std::vector<Sighting> spheres_of(const Csv& csv, const Header& header, const Words& targets, const Words& sockets) {
  std::vector<Sighting> seen;
  const bool is_known = header.has("radius");
  const Eigen::VectorXd radii = is_known ? header.radii_mm() : Eigen::VectorXd::Zero(csv.rows());
  const Words spheres = header.words("sphere");
  for (Eigen::Index row = 0; row < csv.rows(); ++row) {
    if (!sockets.empty() && spheres[row].empty()) continue;
    if (!sockets.empty() && !sockets[row].empty()) csv.refuse(row, "sphere", "the row names a socket, too");
    if (std::isnan(radii(row))) csv.refuse(row, "sphere", "its radius is missing");
    seen.push_back({.row = row,
                    .target = word_of(targets, row),
                    .value = {radii(row), 0.0, 0.0},
                    .feature = is_known ? "known sphere" : "sphere"});
  }
  return seen;
}

std::vector<Sighting> sockets_of(const Words& sockets, const Words& targets) {
  std::vector<Sighting> seen;
  for (Eigen::Index row = 0; row < std::ssize(sockets); ++row) {
    if (sockets[row].empty()) continue;
    seen.push_back({.row = row, .target = word_of(targets, row), .feature = "socket"});
  }
  return seen;
}

// The socket of the row, as a point at that distance from another one, or from the centre of a sphere of known radius.
std::vector<Sighting> lengths_of(const Csv& csv, const Header& header, const Words& targets, const Words& sockets) {
  std::vector<Sighting> seen;
  const Words from = header.words("from");
  if (from.empty()) return seen;
  const Eigen::VectorXd lengths = header.distances_mm();
  const Words spheres = header.words("sphere");
  const auto has = [](const Words& words, const std::string& name) {
    return std::ranges::find(words, name) != words.end();
  };
  for (Eigen::Index row = 0; row < csv.rows(); ++row) {
    if (from[row].empty() && std::isnan(lengths(row))) continue;
    if (from[row].empty()) csv.refuse(row, "from", "the socket is missing that the distance is measured from");
    if (std::isnan(lengths(row))) csv.refuse(row, "from", "the distance from there is missing");
    if (sockets[row].empty()) csv.refuse(row, "from", "a length ends at a socket: the row names none");
    if (from[row] == sockets[row]) csv.refuse(row, "from", "the length ends at this socket: name the other one");
    const bool is_sphere = has(spheres, from[row]);
    if (!is_sphere && !has(sockets, from[row])) csv.refuse(row, "from", "no row touches this socket");
    if (is_sphere && !header.has("radius")) csv.refuse(row, "from", "the radius of this sphere is not stated");
    seen.push_back({.row = row,
                    .target = word_of(targets, row),
                    .value = {lengths(row), 0.0, 0.0},
                    .feature = is_sphere ? "known sphere" : "socket",
                    .is_length = true});
  }
  return seen;
}

void check_columns_of_points(const Csv& csv, const Header& header, const Words& targets) {
  if (header.targets().empty()) {
    throw std::runtime_error(
        fmt::format("{}:1: no measured position: write x_mm, y_mm, z_mm (or _m, _um), t1_x_mm, ... of several targets, "
                    "distance_mm, or a column socket, plane or sphere; columns: {}",
                    csv.name(), fmt::join(csv.columns(), ", ")));
  }
  if (!targets.empty() && !header.targets().front().empty()) {
    throw std::runtime_error(fmt::format("{}:1: there are a column of targets and columns of each target", csv.name()));
  }
}

// The first target has the axes `first`, `target` those of `measured`.
void check_same_axes(const Csv& csv, const Header& header, const std::string& target, const std::array<bool, 3>& first,
                     const std::array<bool, 3>& measured) {
  for (std::size_t axis = 0; axis < 3; ++axis) {
    if (measured[axis] == first[axis]) continue;
    const std::string& lacking = measured[axis] ? header.targets().front() : target;
    throw std::runtime_error(fmt::format("{}:1: there is no column {}{}_mm, another target has {}", csv.name(), lacking,
                                         "xyz"[axis], "xyz"[axis]));
  }
}

// True if a row has a point of a target. Throws if a coordinate is missing, or if there is a socket beside the point.
bool has_point(const Csv& csv, Eigen::Index row, const std::string& target, const Eigen::RowVector3d& point,
               bool has_socket) {
  const bool is_empty = point.array().isNaN().all();
  if (has_socket && !is_empty) {
    throw std::runtime_error(
        fmt::format("{}:{}: there are a measured point and a socket: leave the cells of one of them empty", csv.name(),
                    csv.line_of(row)));
  }
  if (!has_socket && is_empty && target.empty()) {
    throw std::runtime_error(
        fmt::format("{}:{}: there is neither a measured point nor a socket", csv.name(), csv.line_of(row)));
  }
  if (is_empty || (point.hasNaN() && (point.array().isNaN() || point.array() == 0.0).all())) return false;
  if (point.hasNaN()) {
    const char axis = "xyz"[std::isnan(point(0)) ? 0 : std::isnan(point(1)) ? 1 : 2];
    throw std::runtime_error(fmt::format("{}:{}: {}{} is missing, another coordinate of the target is there",
                                         csv.name(), csv.line_of(row), target, axis));
  }
  return true;
}

// Adds the points of all targets to the sockets `seen`.
void add_points(const Csv& csv, const Header& header, const Words& targets, const Words& sockets,
                std::vector<Sighting>& seen, Measurements& measurements) {
  std::vector<Eigen::Index> zeros;
  for (const std::string& target : header.targets()) {
    std::array<bool, 3> measured = {};
    const Eigen::MatrixXd points = header.points_mm(target, measured);
    if (target != header.targets().front()) check_same_axes(csv, header, target, measurements.measured, measured);
    measurements.measured = measured;
    if (!sockets.empty() && !(measured[0] && measured[1] && measured[2])) {
      throw std::runtime_error(fmt::format("{}:1: beside sockets, points need all of x, y and z", csv.name()));
    }
    const std::size_t before = seen.size() + zeros.size();
    for (Eigen::Index row = 0; row < csv.rows(); ++row) {
      const Eigen::RowVector3d point = points.row(row);
      if (!has_point(csv, row, target, point, !word_of(sockets, row).empty())) continue;
      // Instruments that lose the target often write zeros: such rows are no measurements.
      if (point.isZero(0.0)) {
        zeros.push_back(row);
      } else {
        const std::string name = !targets.empty() ? targets[row] : target.substr(0, target.size() - !target.empty());
        seen.push_back({.row = row, .target = name, .value = point.transpose()});
      }
    }
    if (targets.empty() && !target.empty() && csv.rows() > 0 && seen.size() + zeros.size() == before) {
      measurements.warnings.push_back(
          {"target_never_seen", [name = csv.name(), unseen = target.substr(0, target.size() - 1)](const Face& face) {
             return fmt::format("{}: target {} was never seen: its columns are empty", face.table(name), unseen);
           }});
    }
  }
  std::ranges::stable_sort(seen, {}, &Sighting::row);
  std::ranges::sort(zeros);
  if (!zeros.empty()) {
    const Eigen::Index points = csv.rows() * std::ssize(header.targets());
    const std::vector<Eigen::Index> lines = csv.lines_of(zeros);
    measurements.warnings.push_back({"zero_points",
                                     [name = csv.name(), points, lines](const Face& face) {
                                       return fmt::format(
                                           "{}: {} of {} points are exactly zero, taken as missing and left out: {}",
                                           face.table(name), lines.size(), points, face.rows(lines));
                                     },
                                     lines});
  }
}

}  // namespace

std::vector<Sighting> sightings_of(const Csv& csv, const Header& header, Measurements& measurements) {
  const Words targets = header.words("target");
  const Words sockets = header.words("socket");
  if (header.has("distance") && sockets.empty()) {
    measurements.measured = {true, false, false};
    return distances_of(csv, header);
  }
  if (header.has_plane()) {
    measurements.measured = {false, false, true};
    return planes_of(csv, targets);
  }
  if (header.has_sphere() && sockets.empty()) {
    measurements.measured = {true, false, false};
    return spheres_of(csv, header, targets, sockets);
  }
  std::vector<Sighting> seen = sockets_of(sockets, targets);
  const auto add = [&](std::vector<Sighting> more) { seen.insert(seen.end(), more.begin(), more.end()); };
  if (header.has_sphere()) add(spheres_of(csv, header, targets, sockets));
  add(lengths_of(csv, header, targets, sockets));
  std::ranges::stable_sort(seen, {}, &Sighting::row);
  if (header.targets().empty() && !sockets.empty()) return seen;
  check_columns_of_points(csv, header, targets);
  add_points(csv, header, targets, sockets, seen, measurements);
  return seen;
}

}  // namespace llmt::robotics
