#include "llmt/robotics/likely_mistake.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>
#include <numeric>
#include <optional>
#include <set>
#include <stdexcept>
#include <utility>
#include <vector>

#include "calibration/orientation_mistake.hpp"
#include "calibration/registration.hpp"
#include "calibration/suspected_changes.hpp"
#include "llmt/robotics/calibration.hpp"

namespace llmt::robotics {
namespace {

constexpr double far_better = 0.1;

// Points or distances of as many poses as tell such mistakes, at equal steps.
std::vector<Eigen::Index> some_rows(const Measurements& measurements) {
  constexpr std::size_t enough = 25;
  std::map<Eigen::Index, std::vector<Eigen::Index>> stands;
  for (const Eigen::Index row : position_rows(measurements.poses)) {
    stands[measurements.poses.observations.empty() ? row : measurements.poses.observations[row].stand].push_back(row);
  }
  const std::size_t step = std::max<std::size_t>(1, stands.size() / enough);
  std::vector<Eigen::Index> rows;
  std::size_t place = 0;
  for (const auto& [stand, own] : stands) {
    if (place++ % step == 0) rows.insert(rows.end(), own.begin(), own.end());
  }
  std::ranges::sort(rows);
  return rows;
}

Measurements some_of(const Measurements& measurements) { return select(measurements, some_rows(measurements)); }

double spread_of(const Eigen::MatrixXd& points) {
  return std::sqrt((points.rowwise() - points.colwise().mean()).rowwise().squaredNorm().mean());
}

double misfit_of(Robot robot, const Measurements& table) {
  try {
    // A table as it was meant takes some ten steps; any other may wander.
    CalibrationOptions options;
    options.solver.max_iterations = 15;
    robot = with_frames(std::move(robot), table.poses);
    register_frames(robot, table, options);
    return distances(positions(robot, table.poses), table).mean();
  } catch (const std::exception&) {
    return std::numeric_limits<double>::infinity();  // so it is not that
  }
}

Eigen::Index distinct_poses(const Poses& poses) {
  std::set<std::vector<double>> distinct;
  for (Eigen::Index i = 0; i < poses.count(); ++i)
    distinct.insert({poses.joints.row(i).begin(), poses.joints.row(i).end()});
  return std::ssize(distinct);
}

// The mean distance where base and tool are fitted in turn, each exactly: an upper bound of misfit_of() that takes next
// to no time. None for a table that has several frames, distances, or points without a coordinate.
std::optional<double> quick_misfit(const Robot& robot, const Measurements& table) {
  const bool has_points = table.measured == std::array{true, true, true} && table.positions_mm.rows() == table.count();
  if (!table.poses.observations.empty() || !has_points || !robot.chain.bases.empty()) return {};
  constexpr int turns = 40;
  Robot bare = robot;
  bare.chain.base = {};
  bare.chain.tool = {};
  const std::vector<Pose> flanges = tool_poses(bare, table.poses);
  const auto n = std::ssize(flanges);
  const Eigen::Matrix3Xd measured = table.positions_mm.transpose();
  Eigen::Matrix3Xd turned(3, 3 * n);  // the rotations side by side
  Eigen::Matrix3Xd origins(3, n);
  for (Eigen::Index i = 0; i < n; ++i) {
    turned.middleCols<3>(3 * i) = flanges[i].rotation;
    origins.col(i) = flanges[i].position_mm;
  }
  const Eigen::Vector3d middle = measured.rowwise().mean();
  Eigen::Vector3d tool = Eigen::Vector3d::Zero();
  double misfit_mm = std::numeric_limits<double>::infinity();
  for (int turn = 0; turn < turns; ++turn) {
    Eigen::Matrix3Xd tips = origins;
    for (Eigen::Index i = 0; i < n; ++i) tips.col(i) += turned.middleCols<3>(3 * i) * tool;
    const Eigen::Matrix4d base = Eigen::umeyama(tips, measured, false);
    const Eigen::Matrix3d rotation = base.topLeftCorner<3, 3>();
    const Eigen::Matrix3Xd left = ((rotation * tips).colwise() + base.topRightCorner<3, 1>()) - measured;
    misfit_mm = left.colwise().norm().mean();
    // R_b (R_i t + d_i) + b = p_i is linear in t, and in b, which the means take out.
    const Eigen::Matrix3Xd wanted = rotation.transpose() * (measured.colwise() - middle) - origins;
    const Eigen::Vector3d mean_wanted = wanted.rowwise().mean();
    Eigen::Matrix3d mean_turned = Eigen::Matrix3d::Zero();
    for (Eigen::Index i = 0; i < n; ++i) mean_turned += turned.middleCols<3>(3 * i) / static_cast<double>(n);
    Eigen::Matrix3d gram = Eigen::Matrix3d::Zero();
    Eigen::Vector3d right = Eigen::Vector3d::Zero();
    for (Eigen::Index i = 0; i < n; ++i) {
      const Eigen::Matrix3d own = turned.middleCols<3>(3 * i) - mean_turned;
      gram += own.transpose() * own;
      right += own.transpose() * (wanted.col(i) - mean_wanted);
    }
    constexpr double ridge = 1e-9;  // a tool on the axis of the last joint may be anywhere along it
    gram.diagonal().array() += ridge * static_cast<double>(n);
    tool = gram.ldlt().solve(right);
  }
  return misfit_mm;
}

// What is compared: how well a change fits in relation to the spread of the points, because a change may be of units.
struct Explanation {
  double share = std::numeric_limits<double>::infinity();
  double misfit_mm = std::numeric_limits<double>::infinity();
  std::string name;
  std::string words;
};

struct Candidate {
  Robot arm;
  Measurements table;
  Explanation explanation;
};

// `share`: of the files as they stand.
Candidate with(const Candidate& before, const Change& change, double share) {
  constexpr double hopeful = 0.5;
  Candidate now = before;
  change.make(now.table);
  if (change.describe) change.describe(now.arm.chain);
  const std::optional<double> quick_mm = quick_misfit(now.arm, now.table);
  const bool is_hopeless = quick_mm && *quick_mm > hopeful * share * spread_of(now.table.positions_mm);
  const double misfit_mm = is_hopeless ? *quick_mm : misfit_of(now.arm, now.table);
  const bool is_first = before.explanation.name.empty();
  now.explanation = {misfit_mm / spread_of(now.table.positions_mm), misfit_mm,
                     is_first ? change.name : before.explanation.name + "+" + change.name,
                     is_first ? change.words : before.explanation.words + ", and " + change.words};
  return now;
}

// Readings as they stand, and as they were meant.
struct Readings {
  Measurements given;
  Measurements meant;
};

// Readings from a row on that belong to the pose `by` rows away.
Readings slipped(const Measurements& table, Eigen::Index from, Eigen::Index by) {
  std::vector<Eigen::Index> readings;
  std::vector<Eigen::Index> poses;
  for (Eigen::Index i = 0; i < table.count(); ++i) {
    const Eigen::Index pose = i < from ? i : i + by;
    if (pose < 0 || pose >= table.count()) continue;
    readings.push_back(i);
    poses.push_back(pose);
  }
  Measurements given = select(table, readings);
  Measurements meant = given;
  meant.poses.joints = table.poses.joints(poses, Eigen::all).eval();
  return {std::move(given), std::move(meant)};
}

// Distances of all rows where base and tool are those that some of them tell; empty: they tell none.
Eigen::VectorXd distances_by(Robot robot, const Measurements& table, const std::vector<Eigen::Index>& told_by) {
  try {
    register_frames(robot, some_of(select(table, told_by)), {});
    return distances(positions(robot, table.poses), table);
  } catch (const std::exception&) {
    return {};
  }
}

// The row from which on `after` is smaller, so that the sum of both parts is least.
Eigen::Index best_border(const Eigen::VectorXd& before, const Eigen::VectorXd& after) {
  double sum = after.sum();
  double least = sum;
  Eigen::Index border = 0;
  for (Eigen::Index k = 0; k < before.size(); ++k) {
    sum += before(k) - after(k);
    if (sum < least) {
      least = sum;
      border = k + 1;
    }
  }
  return border;
}

std::vector<Eigen::Index> rows_between(Eigen::Index begin, Eigen::Index end) {
  std::vector<Eigen::Index> rows(std::max<Eigen::Index>(0, end - begin));
  std::iota(rows.begin(), rows.end(), begin);
  return rows;
}

Eigen::Index line_of(const Measurements& table, Eigen::Index row) {
  return table.lines.empty() ? row + 1 : table.lines[row];
}

// Mistakes of the order in which rows were taken: readings that slipped by one, and an instrument that moved.
std::vector<Explanation> mistakes_of_rows(const Robot& robot, const Measurements& table) {
  constexpr Eigen::Index fewest = 10;  // that tell base and tool
  constexpr Eigen::Index fewest_slipped = 3;
  std::vector<Explanation> found;
  const Eigen::Index n = table.count();
  const std::vector<Eigen::Index> first = rows_between(0, std::max(fewest, n / 4));
  if (!table.poses.observations.empty() || n < 4 * fewest) return found;
  // Among all rows there may be a gross reading that is not among these: then nothing is better for them.
  const auto is_better = [&](double misfit_mm, const Measurements& given) {
    return misfit_mm < far_better * misfit_of(robot, given);
  };
  const auto add = [&](const Readings& readings, std::string name, std::string words) {
    const Measurements some = some_of(readings.meant);
    const double misfit_mm = misfit_of(robot, some);
    if (!is_better(misfit_mm, some_of(readings.given))) return;
    found.push_back({misfit_mm / spread_of(some.positions_mm), misfit_mm, std::move(name), std::move(words)});
  };
  const Eigen::VectorXd as_it_stands = distances_by(robot, table, first);
  for (const Eigen::Index by : {1, -1}) {
    add(slipped(table, 0, by), by > 0 ? "readings_early" : "readings_late",
        fmt::format("each reading belongs to the pose one row {}", by > 0 ? "later" : "before"));
    // Of the rows that have such a pose, those of the first part tell base and tool.
    const Measurements moved = slipped(table, 0, by).meant;
    if (as_it_stands.size() == 0) continue;
    Robot placed = robot;
    register_frames(placed, some_of(select(table, first)));
    Eigen::VectorXd after = as_it_stands;
    const Eigen::VectorXd own = distances(positions(placed, moved.poses), moved);
    after.segment(by > 0 ? 0 : 1, own.size()) = own;
    const Eigen::Index border = best_border(as_it_stands, after);
    if (border < fewest || border > n - fewest_slipped) continue;
    add(slipped(table, border, by), fmt::format("rows_slipped_from_{}", line_of(table, border)),
        fmt::format("from line {} on each reading belongs to the pose one row {}: a reading or a pose is missing there",
                    line_of(table, border), by > 0 ? "later" : "before"));
  }
  const Eigen::VectorXd later = distances_by(robot, table, rows_between(n - std::ssize(first), n));
  if (as_it_stands.size() == 0 || later.size() == 0) return found;
  const Eigen::Index border = best_border(as_it_stands, later);
  if (border < fewest || border > n - fewest) return found;
  std::vector<Eigen::Index> rows;
  double both = 0.0;
  for (const auto& [begin, end] : {std::pair{Eigen::Index{0}, border}, std::pair{border, n}}) {
    const Measurements part = select(table, rows_between(begin, end));
    const std::vector<Eigen::Index> some = some_rows(part);
    both += static_cast<double>(end - begin) / static_cast<double>(n) * misfit_of(robot, select(part, some));
    for (const Eigen::Index row : some) rows.push_back(begin + row);
  }
  if (!is_better(both, select(table, rows))) return found;
  found.push_back({both / spread_of(table.positions_mm), both,
                   fmt::format("instrument_moved_at_{}", line_of(table, border)),
                   fmt::format("the instrument or the target was moved before line {} (a column `session` says so)",
                               line_of(table, border))});
  return found;
}

// Of what the positions show.
std::optional<Suspicion> mistake_of_positions(const Robot& robot, const Measurements& measurements) {
  constexpr double of_spread = 0.05;
  constexpr double as_good = 1.05;
  constexpr double plausible_share = 1.0 / 50.0;  // of the arm's length, as is_implausible()
  const Candidate given{robot, some_of(measurements), {}};
  const double misfit_mm = misfit_of(robot, given.table);
  const double share = misfit_mm / spread_of(given.table.positions_mm);
  // Fewer poses than base and tool take fit with any mistake, and rounding is none.
  constexpr Eigen::Index fewest_poses = 10;
  constexpr double rounding = 1e-6;  // of the arm's length
  if (distinct_poses(measurements.poses) < fewest_poses || !(misfit_mm > rounding * size_of(robot.chain, measurements)))
    return {};
  const auto explains = [&](const Explanation& own, const Chain& chain) {
    return own.share < std::min(far_better * share, of_spread) &&
           own.misfit_mm < plausible_share * size_of(chain, measurements);
  };
  std::vector<Explanation> found;
  const auto try_all = [&](const Candidate& before, const std::vector<Change>& changes) {
    std::vector<Candidate> better;
    for (const Change& change : changes) {
      Candidate now = with(before, change, share);
      if (explains(now.explanation, now.arm.chain)) found.push_back(now.explanation);
      if (now.explanation.share < before.explanation.share) better.push_back(std::move(now));
    }
    return better;
  };
  Candidate first = given;
  first.explanation.share = share;
  const std::vector<Change> single = single_changes(robot.chain, given.table.poses);
  std::vector<Candidate> better = try_all(first, single);
  // Of several mistakes each that is undone makes the fit better. In right files no change does.
  if (found.empty() && !better.empty()) try_all(first, sign_patterns(robot.chain));
  if (found.empty()) {
    for (Explanation& own : mistakes_of_rows(robot, measurements)) {
      if (explains(own, robot.chain)) found.push_back(std::move(own));
    }
  }
  // Two at once: a second beside those that help most.
  constexpr std::size_t most = 5;
  std::ranges::stable_sort(better, {}, [](const Candidate& own) { return own.explanation.share; });
  for (std::size_t k = 0; k < std::min(most, better.size()) && found.empty(); ++k) try_all(better[k], single);
  if (found.empty()) return {};
  const Explanation best = *std::ranges::min_element(found, {}, &Explanation::share);
  std::vector<std::string> words;  // a wrist that counts the other way is one whose zero is half a turn away
  for (const Explanation& one : found) {
    if (one.share <= as_good * best.share && std::ranges::find(words, one.words) == words.end())
      words.push_back(one.words);
  }
  return Suspicion{best.name,
                   fmt::format("most likely {}: the described robot would then miss the points by {:.3g} mm instead of "
                               "{:.3g} mm",
                               fmt::join(words, ", or "), best.misfit_mm, misfit_mm)};
}

}  // namespace

std::optional<Suspicion> likely_mistake(const Robot& robot, const Measurements& measurements) {
  if (const std::optional<Suspicion> of_positions = mistake_of_positions(robot, measurements)) return of_positions;
  const std::optional<OrientationMistake> turned = likely_orientation_mistake(robot, measurements);
  return turned ? std::optional(Suspicion{turned->name, turned->sentence}) : std::nullopt;
}

}  // namespace llmt::robotics
