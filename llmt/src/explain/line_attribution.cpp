#include "explain/line_attribution.hpp"

#include <algorithm>
#include <cmath>
#include <span>
#include <vector>

#include "explain/straight_line.hpp"
#include "numerics/chebyshev.hpp"
#include "numerics/quadrature.hpp"
#include "partition/through_regressors.hpp"

namespace llmt {
namespace {

// Pieces are halved at most this often on one line, and no further than to this length.
constexpr int most_halvings = 5000;
constexpr double shortest_piece = 1e-9;

// Bounds on the time of one line: on the values of local models that are computed for its integrals, and on the number
// of pieces times that of leaves. Beyond them the line is not cut at kinks, pieces are not halved, and integrals are of
// low order. Trees that are fitted stay far below; a file may hold a chain of a thousand leaves that all overlap.
constexpr double most_values_of_line = 2e8;
constexpr double most_coarse_values = 1e6;
constexpr double most_pieces_and_leaves = 2e7;

// A prediction that is no polynomial is taken for one of this degree; if little precision is asked for, every one is.
constexpr int usual_degree = 8;

// Equal pieces of a line that is not cut at kinks.
constexpr int coarse_pieces = 8;

// Relative rounding of a prediction.
constexpr double rounding_of_outputs = 1e-14;

// The shares of one partition along one line.
class Line {
 public:
  Line(const Model& model, const Partition& partition, const Evaluator& evaluator,
       const Eigen::Ref<const Eigen::VectorXd>& point, const Eigen::Ref<const Eigen::VectorXd>& reference,
       const Precision& precision);

  LineAttribution run();

 private:
  // A position on the line: inputs and prediction of the partition there.
  struct Place {
    double position = 0.0;
    Eigen::VectorXd row;
    Eigen::VectorXd value;
  };

  Pieces pieces();
  Eigen::VectorXd predict(const Eigen::VectorXd& row);
  Eigen::VectorXd predict_unclamped(const Eigen::VectorXd& row);

  // One piece of the line after the other, and the jumps between them.
  Place move_to(const Place& from, double to, std::span<Crossing> crossings);
  void jump(Eigen::Index input, double to, const Eigen::VectorXd& parts, Place& place);

  bool is_polynomial() const {
    return partition_.validity.kind == ValidityKind::crisp || partition_.validity.kind == ValidityKind::blend;
  }
  bool may_go_on() const { return values_ < (precision_.exact ? most_values_of_line : most_coarse_values); }

  // The integral of X.1 over a piece.
  int degree(const Eigen::VectorXd& row) const;
  Eigen::MatrixXd mean_rate(double from, double to, const Eigen::VectorXd& row, int order);
  bool estimate_rate(const Place& from, const Place& to, const Eigen::VectorXd& middle_row, Eigen::MatrixXd& rate);
  void integrate(const Place& from, const Place& to);
  void integrate_one_side(const Place& from, const Place& to);
  std::vector<double> entries_of_range(const Place& from, double to);
  void add_shares(double length, const Eigen::VectorXd& change, const Eigen::MatrixXd& rate);

  const Model& model_;
  const Partition& partition_;
  const Evaluator& evaluator_;
  Precision precision_;
  bool has_products_;
  StraightLine line_;
  Eigen::VectorXd tolerance_;  // of the sum over a piece, per output
  Eigen::MatrixXd shares_;     // outputs of the partition x inputs
  int halvings_ = 0;
  double values_ = 0.0;  // of local models, that were computed

  // Work space.
  Eigen::VectorXd deviations_;
  std::vector<Activation> active_;
  Eigen::MatrixXd by_input_;
  Eigen::MatrixXd by_regressor_;
};

Line::Line(const Model& model, const Partition& partition, const Evaluator& evaluator,
           const Eigen::Ref<const Eigen::VectorXd>& point, const Eigen::Ref<const Eigen::VectorXd>& reference,
           const Precision& precision)
    : model_(model),
      partition_(partition),
      evaluator_(evaluator),
      precision_(precision),
      has_products_(std::any_of(model.regressors().begin(), model.regressors().end(), is_product)),
      line_(model, reference, point),
      deviations_(std::ssize(model.regressors())) {
  const Eigen::Index outputs = std::ssize(partition.outputs);
  tolerance_.resize(outputs);
  for (Eigen::Index o = 0; o < outputs; ++o) {
    const OutputColumn& output = model.outputs()[partition.outputs[o]];
    tolerance_(o) = precision_.tolerance * (output.high - output.low) +
                    rounding_of_outputs * std::max(std::abs(output.low), std::abs(output.high));
  }
  shares_.setZero(outputs, point.size());
}

LineAttribution Line::run() {
  Pieces pieces = this->pieces();
  const std::vector<double>& cuts = pieces.cuts;
  std::vector<Crossing>& crossings = pieces.crossings;
  Place at{0.0, line_.reference, predict(line_.reference)};
  LineAttribution result;
  result.reference = at.value;
  std::size_t next = 0;  // crossing
  for (std::size_t k = 0; k < cuts.size();) {
    const double to = cuts[k];
    // Half as far as cut_line() moves cuts to the middle and the end, so that these are never skipped.
    while (k < cuts.size() && cuts[k] <= to + 0.5 * same_position) ++k;
    const std::size_t first = next;
    while (next < crossings.size() && crossings[next].position <= to + same_position) ++next;
    at = move_to(at, to, std::span(crossings).subspan(first, next - first));
  }
  result.prediction = at.value;
  result.contributions = shares_;
  return result;
}

Pieces Line::pieces() {
  Pieces pieces = cut_line(model_, partition_, evaluator_, line_, precision_.exact);
  const double leaves = static_cast<double>(partition_.num_leaves());
  if (precision_.exact && partition_.validity.kind != ValidityKind::crisp &&
      static_cast<double>(pieces.cuts.size()) * leaves > most_pieces_and_leaves) {
    precision_.exact = false;
    pieces = cut_line(model_, partition_, evaluator_, line_, false);
  }
  if (!precision_.exact && partition_.validity.kind != ValidityKind::crisp) {
    for (int k = 1; k < coarse_pieces; ++k) {
      pieces.cuts.push_back(static_cast<double>(k) / coarse_pieces);
    }
    std::ranges::sort(pieces.cuts);
  }
  return pieces;
}

Eigen::VectorXd Line::predict(const Eigen::VectorXd& row) {
  Eigen::VectorXd values = predict_unclamped(row);
  evaluator_.clamp(values.data());
  return values;
}

Eigen::VectorXd Line::predict_unclamped(const Eigen::VectorXd& row) {
  deviations_at(model_.inputs(), model_.regressors(), row.data(), deviations_.data());
  Eigen::VectorXd values(std::ssize(partition_.outputs));
  evaluator_.activate(row.data(), active_);
  evaluator_.combine_unclamped(active_, deviations_.data(), values.data());
  values_ += static_cast<double>(active_.size());
  return values;
}

// Adds the shares from one position to the next and of the jumps there. `crossings`: those at the next position.
Line::Place Line::move_to(const Place& from, double to, std::span<Crossing> crossings) {
  Place end{to, line_.at(to, from.row), {}};
  for (std::size_t c = crossings.size(); c-- > 0;) {  // the first of an input wins
    end.row(crossings[c].input) = crossings[c].before;
  }
  end.value = predict(end.row);
  integrate(from, end);
  std::ranges::stable_sort(crossings, {}, &Crossing::input);
  for (const Crossing& crossing : crossings) {
    jump(crossing.input, crossing.after, crossing.parts, end);
  }
  if (to == 0.5) {
    for (const Eigen::Index j : line_.switched) {
      jump(j, line_.point(j), {}, end);
    }
  }
  return end;
}

// Sets one input and adds the change of the prediction to its share; or to the shares of all inputs by their `parts`.
void Line::jump(Eigen::Index input, double to, const Eigen::VectorXd& parts, Place& place) {
  place.row(input) = to;
  const Eigen::VectorXd changed = predict(place.row);
  if (parts.size() > 0) {
    shares_ += (changed - place.value) * parts.transpose();
  } else {
    shares_.col(input) += changed - place.value;
  }
  place.value = changed;
}

// Degree of the prediction, as a polynomial of the position, around a point on the line.
int Line::degree(const Eigen::VectorXd& row) const {
  struct OpenNode {
    int node;
    int degree;  // of the validity
  };
  std::vector<OpenNode> open = {{0, 0}};
  int largest = 0;
  while (!open.empty()) {
    const auto [index, of_validity] = open.back();
    open.pop_back();
    const Node& node = partition_.nodes[index];
    if (node.is_leaf()) {
      // A guard sets in at two positions; products have the holds of both factors besides.
      largest = std::max(largest, of_validity + (has_products_ ? 8 : 2));
      continue;
    }
    const double left = evaluator_.left_share(index, row.data());
    const bool moves = node.is_oblique() || line_.way(node.split_input) != 0.0;
    const bool is_shared = !(left >= 1.0 || left <= 0.0);
    const int more = is_shared && moves ? 3 : 0;
    if (!(left <= 0.0)) open.push_back({node.left, of_validity + more});
    if (!(left >= 1.0)) open.push_back({node.right, of_validity + more});
  }
  return largest;
}

// Mean of dF/dx_j (point_j - reference_j) between two positions, outputs x inputs.
Eigen::MatrixXd Line::mean_rate(double from, double to, const Eigen::VectorXd& row, int order) {
  const Quadrature& rule = quadrature(order);
  Eigen::MatrixXd mean = Eigen::MatrixXd::Zero(shares_.rows(), shares_.cols());
  for (std::size_t i = 0; i < rule.nodes.size(); ++i) {
    const Eigen::VectorXd x = line_.at(from + rule.nodes[i] * (to - from), row);
    deviations_at(model_.inputs(), model_.regressors(), x.data(), deviations_.data());
    evaluator_.derivatives(x.data(), deviations_.data(), by_input_, by_regressor_);
    values_ += static_cast<double>(active_.size());  // as many as at the end of the piece, or nearly so
    add_through_regressors(model_.inputs(), model_.regressors(), x.data(), by_regressor_, by_input_);
    for (const Eigen::Index j : line_.moving) {
      mean.col(j) += rule.weights[i] * line_.way(j) * by_input_.col(j);
    }
  }
  return mean;
}

// Sets the mean rates of a piece. True if they are good enough: the shares of the piece add up to the change of the
// prediction, and where the prediction is no polynomial two orders of integration agree.
bool Line::estimate_rate(const Place& from, const Place& to, const Eigen::VectorXd& middle_row, Eigen::MatrixXd& rate) {
  const bool polynomial = is_polynomial();
  const double length = to.position - from.position;
  const Eigen::VectorXd change = to.value - from.value;
  const auto adds_up = [&] {
    return ((change - length * rate.rowwise().sum()).array().abs() <= tolerance_.array()).all();
  };
  const bool exact = precision_.exact && may_go_on();
  const int of_prediction = !exact || !polynomial ? usual_degree : degree(middle_row);
  rate = mean_rate(from.position, to.position, from.row, (of_prediction + 1) / 2);
  bool accepted = adds_up();
  if (exact && (!accepted || !polynomial)) {
    // Twice the order: enough for a held output, and a second opinion on what is not a polynomial.
    const Eigen::MatrixXd better = mean_rate(from.position, to.position, from.row, 2 * of_prediction);
    const bool agree = ((length * (better - rate)).cwiseAbs().rowwise().maxCoeff().array() <= tolerance_.array()).all();
    rate = better;
    accepted = adds_up() && (agree || polynomial);
  }
  return accepted;
}

// The positions, ascending, at which an output enters or leaves the range that it is clamped to. They are exact if the
// prediction is a polynomial; else they are near enough for halves of the piece to be cut better.
std::vector<double> Line::entries_of_range(const Place& from, double to) {
  if (!evaluator_.has_output_range() || line_.moving.empty()) return {};
  const double length = to - from.position;
  const bool polynomial = precision_.exact && may_go_on() && is_polynomial();
  const int of_prediction = polynomial ? degree(line_.at(from.position + 0.5 * length, from.row)) : usual_degree;
  const std::vector<double> points = chebyshev_points(of_prediction);
  Eigen::MatrixXd values(std::ssize(partition_.outputs), std::ssize(points));
  for (std::size_t k = 0; k < points.size(); ++k) {
    values.col(k) = predict_unclamped(line_.at(from.position + points[k] * length, from.row));
  }
  std::vector<double> positions;
  for (Eigen::Index o = 0; o < values.rows(); ++o) {
    const Eigen::VectorXd coefficients = chebyshev_coefficients(values.row(o).transpose());
    for (const double bound : evaluator_.output_range().row(o)) {
      for (const double point : positions_of_level(coefficients, bound)) {
        positions.push_back(from.position + point * length);
      }
    }
  }
  std::erase_if(positions, [&](double position) {
    return position <= from.position + same_position || position >= to - same_position;
  });
  std::ranges::sort(positions);
  return positions;
}

// Adds the shares of a piece in which nothing jumps.
void Line::integrate(const Place& from, const Place& to) {
  Place at = from;
  for (const double position : entries_of_range(from, to.position)) {
    Place next{position, from.row, predict(line_.at(position, from.row))};
    integrate_one_side(at, next);
    at = std::move(next);
  }
  integrate_one_side(at, to);
}

// Adds the shares of a piece in which nothing jumps, and each output is clamped everywhere or nowhere.
void Line::integrate_one_side(const Place& from, const Place& to) {
  const double length = to.position - from.position;
  const Eigen::VectorXd change = to.value - from.value;
  if (line_.moving.empty() || (length <= 0.0 && change.isZero(0.0))) return;
  Place middle{from.position + 0.5 * length, {}, {}};
  middle.row = line_.at(middle.position, from.row);
  Eigen::MatrixXd rate;
  const bool accepted = estimate_rate(from, to, middle.row, rate);
  if (!accepted && length > shortest_piece && halvings_ < most_halvings && may_go_on()) {
    ++halvings_;
    middle.value = predict(middle.row);
    integrate(from, middle);
    integrate({middle.position, from.row, middle.value}, to);
    return;
  }
  add_shares(length, change, rate);
}

// The shares of a piece may not add up to the change. The rest is divided over the inputs in proportion to their rates.
void Line::add_shares(double length, const Eigen::VectorXd& change, const Eigen::MatrixXd& rate) {
  Eigen::MatrixXd share = length * rate;
  const Eigen::VectorXd rest = change - share.rowwise().sum();
  for (Eigen::Index o = 0; o < share.rows(); ++o) {
    const double total = rate.row(o).cwiseAbs().sum();
    for (const Eigen::Index j : line_.moving) {
      share(o, j) +=
          rest(o) * (total > 0.0 ? std::abs(rate(o, j)) / total : 1.0 / static_cast<double>(line_.moving.size()));
    }
  }
  shares_ += share;
}

}  // namespace

LineAttribution attribute_along_line(const Model& model, const Partition& partition, const Evaluator& evaluator,
                                     const Eigen::Ref<const Eigen::VectorXd>& point,
                                     const Eigen::Ref<const Eigen::VectorXd>& reference, const Precision& precision) {
  return Line(model, partition, evaluator, point, reference, precision).run();
}

}  // namespace llmt
