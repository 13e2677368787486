#include "explain/straight_line.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "partition/logistic.hpp"
#include "partition/smooth_clamp.hpp"
#include "partition/through_regressors.hpp"

namespace llmt {
namespace {

// Transitions shorter than this part of the line count as jumps.
constexpr double short_transition = 1e-9;

// A logistic gate bends most at these arguments. Cuts there save halvings.
constexpr double bends_of_logistic[] = {-6.0, 0.0, 6.0};

// The value that a split compares, as a function of the position on the line: base + position * slope.
struct Comparison {
  double base = 0.0;
  double slope = 0.0;

  double position(double value) const { return (value - base) / slope; }
};

// A node that the line reaches between two positions.
struct Open {
  int index;
  double from;
  double to;
};

class Cutter {
 public:
  Cutter(const Model& model, const Partition& partition, const Evaluator& evaluator, const StraightLine& line,
         bool at_kinks)
      : model_(model), partition_(partition), evaluator_(evaluator), line_(line), at_kinks_(at_kinks) {}

  Pieces run();

 private:
  // The last steps of run(): cuts and crossings are ordered, and equal ones merged.
  void sort_crossings();
  void sort_cuts();

  // Cuts where a guard sets in or ends.
  void cut_at(double position, double from, double to);
  void cut_at_extent();
  void cut_at_ranges(const Node& node, double from, double to);
  std::vector<double> positions_of_product(const Regressor& regressor, double value) const;

  // Cuts and crossings of the tree on the line from position `from` to position `to`. `row` has the values of the
  // inputs that do not move. The others put the children of a node that the line reaches on the list of nodes to be
  // visited.
  void visit_all(double from, double to, const Eigen::VectorXd& row);
  void visit(const Open& open, const Eigen::VectorXd& row);
  void visit_jump(int index, const Comparison& along, double reach, double from, double to, const Eigen::VectorXd& row);
  void visit_transition(const Node& node, const Comparison& along, double reach, double from, double to);
  void visit_sides(const Node& node, const Comparison& along, double begins, double ends, double from, double to);

  Comparison comparison(const Node& node, const Eigen::VectorXd& row) const;
  Crossing crossing_of(const Node& node, const Comparison& along, double reach) const;
  Crossing oblique_crossing(int index, const Comparison& along, double from, double to,
                            const Eigen::VectorXd& row) const;
  double value_on_side(int index, bool left, const Crossing& crossing, const Eigen::VectorXd& there) const;

  const Model& model_;
  const Partition& partition_;
  const Evaluator& evaluator_;
  const StraightLine& line_;
  const bool at_kinks_;
  Pieces pieces_;
  std::vector<Open> open_;  // the node that comes next is the last
};

Pieces Cutter::run() {
  pieces_.cuts = {1.0};
  if (!line_.switched.empty()) {
    pieces_.cuts.push_back(0.5);
  }
  cut_at_extent();
  if (partition_.validity.kind == ValidityKind::gaussian) {
    for (const Node& node : partition_.nodes) {
      cut_at_ranges(node, 0.0, 1.0);
    }
  } else {
    // Inputs that are switched have one value on each half.
    visit_all(0.0, line_.switched.empty() ? 1.0 : 0.5, line_.reference);
    if (!line_.switched.empty()) {
      Eigen::VectorXd row = line_.reference;
      for (const Eigen::Index j : line_.switched) {
        row(j) = line_.point(j);
      }
      visit_all(0.5, 1.0, row);
    }
  }
  sort_crossings();
  sort_cuts();
  return std::move(pieces_);
}

// In the order in which the line meets them. At the same position the first input comes first, and the crossings of one
// input in the order in which it meets them.
void Cutter::sort_crossings() {
  std::vector<Crossing>& crossings = pieces_.crossings;
  std::ranges::sort(crossings, [&](const Crossing& a, const Crossing& b) {
    if (a.position != b.position) return a.position < b.position;
    if (a.input != b.input) return a.input < b.input;
    return (a.before - b.before) * line_.way(a.input) < 0.0;
  });
  const auto is_same = [](const Crossing& a, const Crossing& b) {
    return a.input == b.input && a.before == b.before && a.after == b.after;
  };
  crossings.erase(std::unique(crossings.begin(), crossings.end(), is_same), crossings.end());
}

void Cutter::sort_cuts() {
  std::vector<double>& cuts = pieces_.cuts;
  for (const Crossing& crossing : pieces_.crossings) {
    cuts.push_back(crossing.position);
  }
  std::ranges::sort(cuts);
  // If positions count as one, the middle and the end of the line keep their exact values.
  for (double& position : cuts) {
    for (const double kept : {0.5, 1.0}) {
      const bool is_cut = kept == 1.0 || !line_.switched.empty();
      if (is_cut && std::abs(position - kept) <= same_position) position = kept;
    }
  }
}

void Cutter::cut_at(double position, double from, double to) {
  if (position > from && position < to) {
    pieces_.cuts.push_back(position);
  }
}

// The positions at which the product of two deviations has this value, both within the training extent.
std::vector<double> Cutter::positions_of_product(const Regressor& regressor, double value) const {
  const Eigen::Index i = regressor.input;
  const Eigen::Index j = regressor.second_input;
  const double first = line_.reference(i) - model_.inputs()[i].centre;
  const double second = line_.reference(j) - model_.inputs()[j].centre;
  const double square = line_.way(i) * line_.way(j);
  const double half = 0.5 * (first * line_.way(j) + second * line_.way(i));
  const double constant = first * second - value;
  if (square == 0.0) {
    return half == 0.0 ? std::vector<double>{} : std::vector<double>{-0.5 * constant / half};
  }
  // No solution, or a missing factor: NaN, and no cut.
  const double larger = -(half + std::copysign(std::sqrt(half * half - square * constant), half));
  return {larger / square, constant / larger};
}

// Cuts the line where factors of products leave the training extent, and where their holds end.
void Cutter::cut_at_extent() {
  if (!at_kinks_ || std::none_of(model_.regressors().begin(), model_.regressors().end(), is_product)) {
    return;
  }
  for (const Eigen::Index j : line_.moving) {
    const InputColumn& input = model_.inputs()[j];
    const double round = rounding_of_clamp * (input.high - input.low);
    for (const double bound : {input.low - round, input.low, input.high, input.high + round}) {
      cut_at((bound - line_.reference(j)) / line_.way(j), 0.0, 1.0);
    }
  }
}

// Cuts the line where a node's guard sets in or ends.
void Cutter::cut_at_ranges(const Node& node, double from, double to) {
  for (Eigen::Index column = 0; at_kinks_ && column < std::ssize(model_.regressors()); ++column) {
    const Regressor& regressor = model_.regressors()[column];
    const double round = rounding_of_clamp * (node.high(column) - node.low(column));
    for (const double bound :
         {node.low(column) - round, node.low(column), node.high(column), node.high(column) + round}) {
      if (is_product(regressor)) {
        for (const double position : positions_of_product(regressor, bound + regressor.centre)) {
          cut_at(position, from, to);
        }
        continue;
      }
      if (regressor.level >= 0 || line_.way(regressor.input) == 0.0) break;
      cut_at((bound + regressor.centre - line_.reference(regressor.input)) / line_.way(regressor.input), from, to);
    }
  }
}

Comparison Cutter::comparison(const Node& node, const Eigen::VectorXd& row) const {
  if (!node.is_oblique()) return {line_.reference(node.split_input), line_.way(node.split_input)};
  Comparison result;
  for (Eigen::Index j = 0; j < node.direction.size(); ++j) {
    const double x = line_.way(j) != 0.0 ? line_.reference(j) : row(j);
    const bool counts = node.direction(j) != 0.0 && !std::isnan(x);
    result.base += counts ? node.direction(j) * (x - model_.inputs()[j].centre) : 0.0;
    result.slope += node.direction(j) * line_.way(j);
  }
  return result;
}

void Cutter::visit_all(double from, double to, const Eigen::VectorXd& row) {
  open_ = {{0, from, to}};
  while (!open_.empty()) {
    const Open next = open_.back();
    open_.pop_back();
    visit(next, row);
  }
}

void Cutter::visit(const Open& open, const Eigen::VectorXd& row) {
  const auto [index, from, to] = open;
  const Node& node = partition_.nodes[index];
  cut_at_ranges(node, from, to);
  if (node.is_leaf()) return;
  const Comparison along = comparison(node, row);
  if (along.slope == 0.0) {
    const double left = evaluator_.left_share(index, row.data());
    if (left < 1.0) open_.push_back({node.right, from, to});
    if (left > 0.0) open_.push_back({node.left, from, to});
    return;
  }
  const double reach = node.half_width * (partition_.validity.kind == ValidityKind::logistic ? logistic_reach : 1.0);
  if (reach <= short_transition * std::abs(along.slope)) {
    visit_jump(index, along, reach, from, to, row);
  } else {
    visit_transition(node, along, reach, from, to);
  }
}

// A split whose transition is so short that it counts as a jump.
void Cutter::visit_jump(int index, const Comparison& along, double reach, double from, double to,
                        const Eigen::VectorXd& row) {
  const Node& node = partition_.nodes[index];
  const Crossing crossing =
      node.is_oblique() ? oblique_crossing(index, along, from, to, row) : crossing_of(node, along, reach);
  if (crossing.before == crossing.after) {  // all is on one side
    const Eigen::VectorXd start = node.is_oblique() ? line_.at(from, row) : line_.reference;
    open_.push_back({evaluator_.child_of(index, start.data()), from, to});
    return;
  }
  const double position = crossing.position;
  if (position >= from - same_position && position <= to + same_position) pieces_.crossings.push_back(crossing);
  visit_sides(node, along, position, position, from, to);
}

void Cutter::visit_transition(const Node& node, const Comparison& along, double reach, double from, double to) {
  const double begins = along.position(node.threshold - std::copysign(reach, along.slope));
  const double ends = along.position(node.threshold + std::copysign(reach, along.slope));
  if (at_kinks_) {
    cut_at(begins, from, to);
    cut_at(ends, from, to);
    if (partition_.validity.kind == ValidityKind::logistic) {
      for (const double bend : bends_of_logistic) {
        cut_at(along.position(node.threshold + bend * node.half_width), from, to);
      }
    }
  }
  visit_sides(node, along, begins, ends, from, to);
}

// The split hands over between the positions `begins` and `ends`.
void Cutter::visit_sides(const Node& node, const Comparison& along, double begins, double ends, double from,
                         double to) {
  const int first = along.slope > 0.0 ? node.left : node.right;
  const int second = along.slope > 0.0 ? node.right : node.left;
  if (begins <= to + same_position) open_.push_back({second, std::min(to, std::max(from, begins)), to});
  if (ends >= from - same_position) open_.push_back({first, from, std::max(from, std::min(to, ends))});
}

// The crossing of a split on one input; before and after are the same if the whole line is on one side.
Crossing Cutter::crossing_of(const Node& node, const Comparison& along, double reach) const {
  const Eigen::Index j = node.split_input;
  const auto on_line = [&](double value) {
    return std::clamp(value, std::min(line_.reference(j), line_.point(j)),
                      std::max(line_.reference(j), line_.point(j)));
  };
  const double left = on_line(node.threshold - reach);
  const double right = on_line(std::nextafter(node.threshold + reach, std::numeric_limits<double>::infinity()));
  return {.position = std::clamp(along.position(node.threshold), 0.0, 1.0),
          .input = static_cast<int>(j),
          .before = along.slope > 0.0 ? left : right,
          .after = along.slope > 0.0 ? right : left};
}

// The crossing of an oblique split. The input that moves the compared value most is put on the two sides; before and
// after are the same if all from `from` to `to` is on one side. The jump is shared out by the parts, which are the
// limit for ever steeper gates.
Crossing Cutter::oblique_crossing(int index, const Comparison& along, double from, double to,
                                  const Eigen::VectorXd& row) const {
  const Node& node = partition_.nodes[index];
  Crossing crossing;
  const Eigen::VectorXd moved = node.direction.cwiseProduct(line_.way);
  crossing.parts = moved / along.slope;
  moved.cwiseAbs().maxCoeff(&crossing.input);
  const Eigen::VectorXd first = line_.at(from, row);
  const Eigen::VectorXd last = line_.at(to, row);
  if (evaluator_.child_of(index, first.data()) == evaluator_.child_of(index, last.data())) {
    return crossing;
  }
  crossing.position = std::clamp(along.position(node.threshold), from, to);
  const Eigen::VectorXd there = line_.at(crossing.position, row);
  crossing.before = value_on_side(index, along.slope > 0.0, crossing, there);
  crossing.after = value_on_side(index, !(along.slope > 0.0), crossing, there);
  return crossing;
}

// Value of the crossing's input, near the crossing `there`, with which a row lies entirely on one side of a split.
double Cutter::value_on_side(int index, bool left, const Crossing& crossing, const Eigen::VectorXd& there) const {
  const int input = crossing.input;
  const double to_right = partition_.nodes[index].direction(input) > 0.0 ? 1.0 : -1.0;
  const double way = left ? -to_right : to_right;
  const auto is_on_side = [&](const Eigen::VectorXd& x) {
    const double share = evaluator_.left_share(index, x.data());
    return (share >= 1.0) == left && (share <= 0.0) == !left;
  };
  Eigen::VectorXd x = there;
  double step = 0x1p-50 * std::max(std::abs(there(input)), std::abs(line_.way(input)));
  for (; !is_on_side(x); step *= 2.0) {
    x(input) = there(input) + way * step;
  }
  return x(input);
}

}  // namespace

Pieces cut_line(const Model& model, const Partition& partition, const Evaluator& evaluator, const StraightLine& line,
                bool at_kinks) {
  return Cutter(model, partition, evaluator, line, at_kinks).run();
}

}  // namespace llmt
