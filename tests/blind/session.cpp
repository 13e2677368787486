#include "blind/session.hpp"

#include <algorithm>
#include <cmath>

#include "blind/arms.hpp"

namespace blind {
namespace {

Session empty(Eigen::Index rows, int joints) {
  Session s;
  for (Eigen::MatrixXd* m : {&s.q, &s.read_back, &s.approach}) *m = Eigen::MatrixXd::Zero(rows, joints);
  for (Eigen::VectorXd* v : {&s.payload, &s.temperature, &s.time, &s.order}) *v = Eigen::VectorXd::Zero(rows);
  s.pose.assign(rows, 0);
  s.returned.assign(rows, false);
  return s;
}

// Read-back and approach of one row; the rest is there already.
void arrive(Session& s, Eigen::Index row, double jitter, llmt::Random& random) {
  for (Eigen::Index j = 0; j < s.q.cols(); ++j) {
    s.read_back(row, j) = s.q(row, j) + jitter * random.normal();
    s.approach(row, j) = sign(random);
  }
}

void new_pose(Session& s, Eigen::Index row, const Arm& arm, const std::vector<double>& loads, llmt::Random& random) {
  for (Eigen::Index j = 0; j < s.q.cols(); ++j) {
    const Joint& joint = arm.joints[j];
    s.q(row, j) = random.uniform(joint.low, joint.high);
  }
  s.payload(row) = loads[random.below(loads.size())];
}

// A walk of many small steps, scaled to the wanted span.
Eigen::VectorXd walk(Eigen::Index rows, llmt::Random& random) {
  Eigen::VectorXd t(rows);
  const double span = random.uniform(6.0, 10.0);
  double value = 0.0, speed = 0.0;
  for (Eigen::Index i = 0; i < rows; ++i) {
    speed = 0.9 * speed + random.normal();
    t(i) = value += speed;
  }
  const double low = t.minCoeff(), high = t.maxCoeff();
  return ((t.array() - low) * (span / (high - low)) + 20.0 + random.uniform(-2.0, 2.0)).matrix();
}

}  // namespace

Session select(const Session& session, const std::vector<int>& rows) {
  Session s = empty(rows.size(), static_cast<int>(session.q.cols()));
  for (std::size_t k = 0; k < rows.size(); ++k) {
    const Eigen::Index i = k;
    const std::size_t from = rows[k];
    s.q.row(i) = session.q.row(rows[k]);
    s.read_back.row(i) = session.read_back.row(rows[k]);
    s.approach.row(i) = session.approach.row(rows[k]);
    s.payload(i) = session.payload(rows[k]);
    s.temperature(i) = session.temperature(rows[k]);
    s.time(i) = session.time(rows[k]);
    s.order(i) = session.order(rows[k]);
    s.pose[k] = session.pose[from];
    s.returned[k] = session.returned[from];
  }
  return s;
}

Sessions make_sessions(const Arm& arm, const std::vector<double>& payloads, const SessionOptions& options,
                       llmt::Random& random) {
  std::vector<double> loads = payloads;
  if (!options.two_payloads) loads = {payloads.back()};

  // Which pose stands in which row.
  std::vector<int> visits(options.poses);
  for (int i = 0; i < options.poses; ++i) visits[i] = i;
  std::vector<bool> again(visits.size(), false);
  if (options.repeats) {
    const int groups = 5 + static_cast<int>(random.below(4));
    const auto chosen = random.permutation(options.poses);
    for (int g = 0; g < groups; ++g) {
      const int pose = static_cast<int>(chosen[g]);
      again[pose] = true;
      for (int k = 0; k < 3; ++k) {
        const auto first = std::ranges::find(visits, pose) - visits.begin();
        const auto after =
            first + 1 + static_cast<std::ptrdiff_t>(options.dwelled ? 0 : random.below(visits.size() - first));
        visits.insert(visits.begin() + after, pose);
      }
    }
  }
  const int measured = static_cast<int>(visits.size());
  const int total = measured + options.held_out;
  const int gap =
      static_cast<int>(random.below(static_cast<std::uint64_t>(measured)));  // held-out block before this row

  Session all = empty(total, arm.size());
  std::vector<int> first_row(again.size(), -1), measured_rows, held_rows;
  all.temperature = walk(total, random);
  double clock = 0.0;
  for (int row = 0; row < total; ++row) {
    const bool held = row >= gap && row < gap + options.held_out;
    (held ? held_rows : measured_rows).push_back(row);
    const std::size_t index = row;
    all.time(row) = clock += random.uniform(20.0, 60.0);
    all.order(row) = row + 1;
    const int pose = held ? options.poses + row - gap : visits[row < gap ? row : row - options.held_out];
    all.pose[index] = pose + 1;
    int* first = held ? nullptr : &first_row[pose];
    if (first != nullptr && *first >= 0) {
      all.q.row(row) = all.q.row(*first);
      all.payload(row) = all.payload(*first);
    } else {
      new_pose(all, row, arm, loads, random);
      if (first != nullptr) *first = row;
    }
    arrive(all, row, options.read_back_jitter, random);
    if (!held && again[pose]) {
      all.returned[index] = true;
      if (options.dwelled) {
        all.approach.row(row) = all.approach.row(*first);
        all.read_back.row(row) = all.read_back.row(*first);
      }
    }
  }

  Session fresh = empty(100, arm.size());
  std::vector<double> moments(100);
  for (double& moment : moments) moment = random.uniform(0.0, total - 1.0);
  std::ranges::sort(moments);
  for (int i = 0; i < 100; ++i) {
    const double moment = moments[i];
    const auto before = static_cast<Eigen::Index>(moment);
    const auto between = [&](const Eigen::VectorXd& v) {
      return v(before) + (moment - static_cast<double>(before)) * (v(before + 1) - v(before));
    };
    fresh.time(i) = between(all.time);
    fresh.order(i) = between(all.order);
    fresh.temperature(i) = between(all.temperature);
    fresh.pose[i] = 1000 + i;
    new_pose(fresh, i, arm, loads, random);
    arrive(fresh, i, options.read_back_jitter, random);
  }
  Sessions result{select(all, measured_rows), select(all, held_rows), std::move(fresh)};
  const Eigen::Vector2d span(all.time(0), all.time(total - 1));
  for (Session* s : {&result.measured, &result.held_out, &result.fresh}) s->time_span = span;
  return result;
}

}  // namespace blind
