#include "llmt/explain.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>
#include <vector>

#include "checks.hpp"
#include "evaluator.hpp"
#include "parallel.hpp"
#include "regressors.hpp"

namespace llmt {
namespace {

/// Positions on the line that differ by less count as one.
constexpr double same_position = 1e-12;

/// Transitions shorter than this part of the line count as jumps.
constexpr double short_transition = 1e-9;

/// Pieces are halved at most this often on one line, and no further than to this length.
constexpr int most_halvings = 5000;
constexpr double shortest_piece = 1e-9;

/// How well a line is integrated.
struct Precision {
  double tolerance;  // of the sum over a piece, as a fraction of the output's range
  bool exact;        // cut at all kinks, orders by degree; else equal pieces and one order
};
constexpr Precision fine = {1e-10, true};
constexpr Precision coarse = {1e-4, false};
constexpr int coarse_pieces = 8;

struct Quadrature {
  std::vector<double> nodes;  // in 0 ... 1
  std::vector<double> weights;
};

/// Gauss-Legendre of a given order: zeros of the Legendre polynomial by Newton's method.
Quadrature gauss_legendre(int order) {
  Quadrature rule;
  for (int i = 1; i <= order; ++i) {
    double z = std::cos(std::numbers::pi * (i - 0.25) / (order + 0.5));
    double derivative = 1.0;
    for (int iteration = 0; iteration < 20; ++iteration) {
      double value = 1.0;
      double before = 0.0;
      for (int k = 1; k <= order; ++k) {
        const double next = ((2.0 * k - 1.0) * z * value - (k - 1.0) * before) / k;
        before = value;
        value = next;
      }
      derivative = order * (z * value - before) / (z * z - 1.0);
      z -= value / derivative;
    }
    rule.nodes.push_back(0.5 * (1.0 - z));
    rule.weights.push_back(1.0 / ((1.0 - z * z) * derivative * derivative));
  }
  return rule;
}

constexpr int highest_order = 16;

const Quadrature& quadrature(int order) {
  static const std::array<Quadrature, highest_order> rules = [] {
    std::array<Quadrature, highest_order> all;
    for (int k = 0; k < highest_order; ++k) {
      all[static_cast<std::size_t>(k)] = gauss_legendre(k + 1);
    }
    return all;
  }();
  return rules[static_cast<std::size_t>(std::clamp(order, 1, highest_order) - 1)];
}

/// A place on the line where an input passes a threshold without transition.
struct Crossing {
  double position = 0.0;
  int input = 0;
  double before = 0.0;  // values of the input on the two sides
  double after = 0.0;
};

/// The shares of one partition along one line.
class Line {
 public:
  Line(const Model& model, const Partition& partition, const Evaluator& evaluator,
       const Eigen::Ref<const Eigen::VectorXd>& point, const Eigen::Ref<const Eigen::VectorXd>& reference,
       const Precision& precision)
      : model_(model),
        partition_(partition),
        evaluator_(evaluator),
        precision_(precision),
        has_products_(std::any_of(model.regressors().begin(), model.regressors().end(), is_product)),
        point_(point),
        reference_(reference),
        way_(Eigen::VectorXd::Zero(point.size())),
        deviations_(std::ssize(model.regressors())) {
    for (std::ptrdiff_t j = 0; j < point_.size(); ++j) {
      const bool missing = std::isnan(point_(j));
      if (model.inputs()[static_cast<std::size_t>(j)].is_categorical() || missing || std::isnan(reference_(j))) {
        if (!(point_(j) == reference_(j) || (missing && std::isnan(reference_(j))))) {
          switched_.push_back(j);
        }
      } else if (point_(j) != reference_(j)) {
        way_(j) = point_(j) - reference_(j);
        moving_.push_back(j);
      }
    }
    const std::ptrdiff_t outputs = std::ssize(partition.outputs);
    tolerance_.resize(outputs);
    for (std::ptrdiff_t o = 0; o < outputs; ++o) {
      const OutputColumn& output =
          model.outputs()[static_cast<std::size_t>(partition.outputs[static_cast<std::size_t>(o)])];
      tolerance_(o) = precision_.tolerance * (output.high - output.low) +
                      1e-14 * std::max(std::abs(output.low), std::abs(output.high));
    }
    shares_.setZero(outputs, point_.size());
  }

  /// Sets the rows of the partition's outputs.
  void run(Attribution& result) {
    cut();
    Eigen::VectorXd row = reference_;
    Eigen::VectorXd value = predict(row);
    set(result.reference, value);
    double from = 0.0;
    std::size_t next = 0;
    for (std::size_t k = 0; k < cuts_.size();) {
      const double to = cuts_[k];
      // Half as far as cut() moves cuts to the middle and the end, so that these are never skipped.
      for (; k < cuts_.size() && cuts_[k] <= to + 0.5 * same_position; ++k) {
      }
      const std::size_t first = next;
      for (; next < crossings_.size() && crossings_[next].position <= to + same_position; ++next) {
      }
      Eigen::VectorXd end = at(to, row);
      for (std::size_t c = next; c-- > first;) {  // the first of an input wins
        end(crossings_[c].input) = crossings_[c].before;
      }
      Eigen::VectorXd end_value = predict(end);
      integrate(from, to, row, value, end_value);
      std::stable_sort(crossings_.begin() + static_cast<std::ptrdiff_t>(first),
                       crossings_.begin() + static_cast<std::ptrdiff_t>(next),
                       [](const Crossing& a, const Crossing& b) { return a.input < b.input; });
      for (std::size_t c = first; c < next; ++c) {
        jump(crossings_[c].input, crossings_[c].after, end, end_value);
      }
      if (to == 0.5) {
        for (const std::ptrdiff_t j : switched_) {
          jump(j, point_(j), end, end_value);
        }
      }
      row = std::move(end);
      value = std::move(end_value);
      from = to;
    }
    set(result.prediction, value);
    for (std::size_t o = 0; o < partition_.outputs.size(); ++o) {
      result.contributions.row(partition_.outputs[o]) = shares_.row(static_cast<std::ptrdiff_t>(o));
    }
  }

 private:
  void set(Eigen::VectorXd& values, const Eigen::VectorXd& of_partition) const {
    for (std::size_t o = 0; o < partition_.outputs.size(); ++o) {
      values(partition_.outputs[o]) = of_partition(static_cast<std::ptrdiff_t>(o));
    }
  }

  /// The inputs at a position; those that do not move as in `row`.
  Eigen::VectorXd at(double position, const Eigen::VectorXd& row) const {
    Eigen::VectorXd x = row;
    for (const std::ptrdiff_t j : moving_) {
      x(j) = position == 1.0 ? point_(j) : reference_(j) + position * way_(j);
    }
    return x;
  }

  Eigen::VectorXd predict(const Eigen::VectorXd& row) {
    deviations_at(model_.inputs(), model_.regressors(), row.data(), deviations_.data());
    Eigen::VectorXd values(std::ssize(partition_.outputs));
    evaluator_.activate(row.data(), active_);
    evaluator_.combine(active_, deviations_.data(), values.data());
    return values;
  }

  /// Sets one input, and gives it what that changes.
  void jump(std::ptrdiff_t input, double to, Eigen::VectorXd& row, Eigen::VectorXd& value) {
    row(input) = to;
    const Eigen::VectorXd changed = predict(row);
    shares_.col(input) += changed - value;
    value = changed;
  }

  /// Positions of cuts and of crossings, ascending.
  void cut() {
    cuts_ = {1.0};
    if (!switched_.empty()) {
      cuts_.push_back(0.5);
    }
    if (!precision_.exact && partition_.validity.kind != ValidityKind::crisp) {
      for (int k = 1; k < coarse_pieces; ++k) {
        cuts_.push_back(static_cast<double>(k) / coarse_pieces);
      }
    }
    if (precision_.exact && has_products_) {
      cut_at_extent();
    }
    if (partition_.validity.kind == ValidityKind::gaussian) {
      for (const Node& node : partition_.nodes) {
        cut_at_ranges(node, 0.0, 1.0);
      }
    } else {
      // Inputs that are switched have one value on each half.
      visit(0, 0.0, switched_.empty() ? 1.0 : 0.5, reference_);
      if (!switched_.empty()) {
        Eigen::VectorXd row = reference_;
        for (const std::ptrdiff_t j : switched_) {
          row(j) = point_(j);
        }
        visit(0, 0.5, 1.0, row);
      }
    }
    // In the order in which an input meets them, each once.
    std::sort(crossings_.begin(), crossings_.end(), [&](const Crossing& a, const Crossing& b) {
      return a.position != b.position ? a.position < b.position
             : a.input != b.input     ? a.input < b.input
                                      : (a.before - b.before) * way_(a.input) < 0.0;
    });
    crossings_.erase(std::unique(crossings_.begin(), crossings_.end(),
                                 [](const Crossing& a, const Crossing& b) {
                                   return a.input == b.input && a.before == b.before && a.after == b.after;
                                 }),
                     crossings_.end());
    for (const Crossing& crossing : crossings_) {
      cuts_.push_back(crossing.position);
    }
    std::sort(cuts_.begin(), cuts_.end());
    // Of positions that count as one, the middle and the end of the line are kept as they are.
    for (double& position : cuts_) {
      for (const double kept : {0.5, 1.0}) {
        if ((kept == 1.0 || !switched_.empty()) && std::abs(position - kept) <= same_position) {
          position = kept;
        }
      }
    }
  }

  void cut_at(double position, double from, double to) {
    if (position > from && position < to) {
      cuts_.push_back(position);
    }
  }

  /// Where on the line the product of two deviations has a value, both within the training extent.
  std::vector<double> positions_of_product(const Regressor& regressor, double value) const {
    const std::ptrdiff_t i = regressor.input;
    const std::ptrdiff_t j = regressor.second_input;
    const double first = reference_(i) - model_.inputs()[static_cast<std::size_t>(i)].centre;
    const double second = reference_(j) - model_.inputs()[static_cast<std::size_t>(j)].centre;
    const double square = way_(i) * way_(j);
    const double half = 0.5 * (first * way_(j) + second * way_(i));
    const double constant = first * second - value;
    if (square == 0.0) {
      return half == 0.0 ? std::vector<double>{} : std::vector<double>{-0.5 * constant / half};
    }
    // No solution, or a missing factor: NaN, and no cut.
    const double larger = -(half + std::copysign(std::sqrt(half * half - square * constant), half));
    return {larger / square, constant / larger};
  }

  /// Where factors of products leave the training extent, and where their holds end.
  void cut_at_extent() {
    for (const std::ptrdiff_t j : moving_) {
      const InputColumn& input = model_.inputs()[static_cast<std::size_t>(j)];
      const double round = rounding_of_hold * (input.high - input.low);
      for (const double bound : {input.low - round, input.low, input.high, input.high + round}) {
        cut_at((bound - reference_(j)) / way_(j), 0.0, 1.0);
      }
    }
  }

  /// Where a node's guard sets in or ends.
  void cut_at_ranges(const Node& node, double from, double to) {
    for (std::size_t k = 0; precision_.exact && k < model_.regressors().size(); ++k) {
      const Regressor& regressor = model_.regressors()[k];
      const std::ptrdiff_t column = static_cast<std::ptrdiff_t>(k);
      const double round = rounding_of_hold * (node.high(column) - node.low(column));
      for (const double bound :
           {node.low(column) - round, node.low(column), node.high(column), node.high(column) + round}) {
        if (is_product(regressor)) {
          for (const double position : positions_of_product(regressor, bound + regressor.centre)) {
            cut_at(position, from, to);
          }
          continue;
        }
        if (regressor.level >= 0 || way_(regressor.input) == 0.0) {
          break;
        }
        cut_at((bound + regressor.centre - reference_(regressor.input)) / way_(regressor.input), from, to);
      }
    }
  }

  /// Cuts and crossings below a node that is reached from `from` to `to`.
  void visit(int index, double from, double to, const Eigen::VectorXd& row) {
    const Node& node = partition_.nodes[static_cast<std::size_t>(index)];
    cut_at_ranges(node, from, to);
    if (node.is_leaf()) {
      return;
    }
    const std::ptrdiff_t j = node.split_input;
    const double way = way_(j);
    if (way == 0.0) {
      const double left = evaluator_.left_share(index, row.data());
      if (left > 0.0) {
        visit(node.left, from, to, row);
      }
      if (left < 1.0) {
        visit(node.right, from, to, row);
      }
      return;
    }
    const int first = way > 0.0 ? node.left : node.right;
    const int second = way > 0.0 ? node.right : node.left;
    const auto position = [&](double value) { return (value - reference_(j)) / way; };
    double begins = position(node.threshold - std::copysign(node.half_width, way));
    double ends = position(node.threshold + std::copysign(node.half_width, way));
    if (node.half_width <= short_transition * std::abs(way)) {
      const auto on_line = [&](double value) {
        return std::clamp(value, std::min(reference_(j), point_(j)), std::max(reference_(j), point_(j)));
      };
      const double left = on_line(node.threshold - node.half_width);
      const double right =
          on_line(std::nextafter(node.threshold + node.half_width, std::numeric_limits<double>::infinity()));
      if (left == right) {  // the whole line is on one side
        visit(reference_(j) <= node.threshold ? node.left : node.right, from, to, row);
        return;
      }
      const Crossing crossing{.position = std::clamp(position(node.threshold), 0.0, 1.0),
                              .input = static_cast<int>(j),
                              .before = way > 0.0 ? left : right,
                              .after = way > 0.0 ? right : left};
      begins = ends = crossing.position;
      if (begins >= from - same_position && begins <= to + same_position) {
        crossings_.push_back(crossing);
      }
    } else if (precision_.exact) {
      cut_at(begins, from, to);
      cut_at(ends, from, to);
    }
    if (ends >= from - same_position) {
      visit(first, from, std::max(from, std::min(to, ends)), row);
    }
    if (begins <= to + same_position) {
      visit(second, std::min(to, std::max(from, begins)), to, row);
    }
  }

  /// Degree of the prediction, as a polynomial of the position, around a point on the line.
  int degree(int index, const Eigen::VectorXd& row) const {
    const Node& node = partition_.nodes[static_cast<std::size_t>(index)];
    if (node.is_leaf()) {
      return has_products_ ? 8 : 2;  // where a guard sets in, and the holds of both factors
    }
    const double left = evaluator_.left_share(index, row.data());
    if (left >= 1.0 || left <= 0.0) {
      return degree(left >= 1.0 ? node.left : node.right, row);
    }
    const int of_transition = way_(node.split_input) == 0.0 ? 0 : partition_.validity.smoothness == 1 ? 3 : 5;
    return of_transition + std::max(degree(node.left, row), degree(node.right, row));
  }

  /// Mean of dF/dx_j (point_j - reference_j) between two positions, outputs x inputs.
  Eigen::MatrixXd mean_rate(double from, double to, const Eigen::VectorXd& row, int order) {
    const Quadrature& rule = quadrature(order);
    Eigen::MatrixXd mean = Eigen::MatrixXd::Zero(shares_.rows(), shares_.cols());
    for (std::size_t i = 0; i < rule.nodes.size(); ++i) {
      const Eigen::VectorXd x = at(from + rule.nodes[i] * (to - from), row);
      deviations_at(model_.inputs(), model_.regressors(), x.data(), deviations_.data());
      evaluator_.derivatives(x.data(), deviations_.data(), by_input_, by_regressor_);
      add_through_regressors(model_.inputs(), model_.regressors(), x.data(), by_regressor_, by_input_);
      for (const std::ptrdiff_t j : moving_) {
        mean.col(j) += rule.weights[i] * way_(j) * by_input_.col(j);
      }
    }
    return mean;
  }

  /// Adds the shares of a piece in which nothing jumps.
  void integrate(double from, double to, const Eigen::VectorXd& row, const Eigen::VectorXd& value,
                 const Eigen::VectorXd& end_value) {
    const bool gaussian = partition_.validity.kind == ValidityKind::gaussian;
    const double length = to - from;
    const Eigen::VectorXd change = end_value - value;
    if (moving_.empty() || (length <= 0.0 && change.isZero(0.0))) {
      return;
    }
    const double middle = from + 0.5 * length;
    const Eigen::VectorXd middle_row = at(middle, row);
    const int of_prediction = !precision_.exact || gaussian ? 8 : degree(0, middle_row);
    Eigen::MatrixXd rate = mean_rate(from, to, row, (of_prediction + 1) / 2);
    const auto adds_up = [&] {
      return ((change - length * rate.rowwise().sum()).array().abs() <= tolerance_.array()).all();
    };
    bool accepted = adds_up();
    if (precision_.exact && (!accepted || gaussian)) {
      // Twice the order: enough for a held output, and a second opinion on what is not a polynomial.
      const Eigen::MatrixXd better = mean_rate(from, to, row, 2 * of_prediction);
      const bool agree =
          ((length * (better - rate)).cwiseAbs().rowwise().maxCoeff().array() <= tolerance_.array()).all();
      rate = better;
      accepted = adds_up() && (agree || !gaussian);
    }
    if (!accepted && length > shortest_piece && halvings_ < most_halvings) {
      ++halvings_;
      const Eigen::VectorXd middle_value = predict(middle_row);
      integrate(from, middle, row, value, middle_value);
      integrate(middle, to, row, middle_value, end_value);
      return;
    }
    Eigen::MatrixXd share = length * rate;
    const Eigen::VectorXd rest = change - share.rowwise().sum();
    for (std::ptrdiff_t o = 0; o < share.rows(); ++o) {
      const double total = rate.row(o).cwiseAbs().sum();
      for (const std::ptrdiff_t j : moving_) {
        share(o, j) +=
            rest(o) * (total > 0.0 ? std::abs(rate(o, j)) / total : 1.0 / static_cast<double>(moving_.size()));
      }
    }
    shares_ += share;
  }

  const Model& model_;
  const Partition& partition_;
  const Evaluator& evaluator_;
  Precision precision_;
  bool has_products_;
  Eigen::VectorXd point_;
  Eigen::VectorXd reference_;
  Eigen::VectorXd way_;                   // point - reference where an input moves, else 0
  std::vector<std::ptrdiff_t> moving_;    // inputs
  std::vector<std::ptrdiff_t> switched_;  // inputs that change at the middle of the line
  std::vector<double> cuts_;              // ends of pieces
  std::vector<Crossing> crossings_;
  Eigen::VectorXd tolerance_;
  Eigen::MatrixXd shares_;
  int halvings_ = 0;
  Eigen::VectorXd deviations_;
  std::vector<Activation> active_;
  Eigen::MatrixXd by_input_;
  Eigen::MatrixXd by_regressor_;
};

std::vector<Evaluator> evaluators_of(const Model& model) {
  std::vector<Evaluator> evaluators;
  for (const Partition& partition : model.partitions()) {
    evaluators.emplace_back(partition, model.inputs(), std::ssize(model.regressors()));
  }
  return evaluators;
}

Attribution attribute_with(const Model& model, const std::vector<Evaluator>& evaluators,
                           const Eigen::Ref<const Eigen::VectorXd>& point,
                           const Eigen::Ref<const Eigen::VectorXd>& reference, const Precision& precision) {
  Attribution result{Eigen::VectorXd(model.num_outputs()), Eigen::VectorXd(model.num_outputs()),
                     Eigen::MatrixXd(model.num_outputs(), model.num_inputs())};
  for (std::size_t p = 0; p < evaluators.size(); ++p) {
    Line(model, model.partitions()[p], evaluators[p], point, reference, precision).run(result);
  }
  return result;
}

void check_point(const char* argument, const Model& model, const Eigen::Ref<const Eigen::VectorXd>& point) {
  if (point.size() != model.num_inputs()) {
    throw std::invalid_argument(fmt::format("llmt::attribute: {} has {} entries, the model has {} inputs", argument,
                                            point.size(), model.num_inputs()));
  }
  check_finite_or_missing("llmt::attribute", argument, point);
}

}  // namespace

Eigen::VectorXd reference_point(const Model& model) {
  Eigen::VectorXd reference(model.num_inputs());
  std::transform(model.inputs().begin(), model.inputs().end(), reference.begin(), [](const InputColumn& input) {
    return input.is_categorical() ? std::numeric_limits<double>::quiet_NaN() : input.centre;
  });
  return reference;
}

Attribution attribute(const Model& model, const Eigen::Ref<const Eigen::VectorXd>& point,
                      const Eigen::Ref<const Eigen::VectorXd>& reference) {
  check_point("point", model, point);
  check_point("reference", model, reference);
  return attribute_with(model, evaluators_of(model), point, reference, fine);
}

Attribution attribute(const Model& model, const Eigen::Ref<const Eigen::VectorXd>& point) {
  return attribute(model, point, reference_point(model));
}

Eigen::MatrixXd importance(const Model& model, const Eigen::Ref<const Eigen::MatrixXd>& inputs, int max_threads) {
  if (inputs.rows() < 1 || inputs.cols() != model.num_inputs()) {
    throw std::invalid_argument(
        fmt::format("llmt::importance: inputs is {} x {}, it must have a row and the model's {} inputs", inputs.rows(),
                    inputs.cols(), model.num_inputs()));
  }
  check_finite_or_missing("llmt::importance", "inputs", inputs);
  const std::vector<Evaluator> evaluators = evaluators_of(model);
  const Eigen::VectorXd reference = reference_point(model);
  const std::ptrdiff_t count = std::min(inputs.rows(), importance_rows);
  std::vector<Eigen::MatrixXd> of_row(static_cast<std::size_t>(count));
  parallel_for(count, max_threads, [&](std::ptrdiff_t k) {
    const Eigen::VectorXd point = inputs.row(k * inputs.rows() / count).transpose();
    of_row[static_cast<std::size_t>(k)] =
        attribute_with(model, evaluators, point, reference, coarse).contributions.cwiseAbs();
  });
  Eigen::MatrixXd sum = Eigen::MatrixXd::Zero(model.num_outputs(), model.num_inputs());
  for (const Eigen::MatrixXd& contributions : of_row) {
    sum += contributions;
  }
  for (std::ptrdiff_t o = 0; o < sum.rows(); ++o) {
    const OutputColumn& output = model.outputs()[static_cast<std::size_t>(o)];
    const double rounding = 1e-14 * std::max(std::abs(output.low), std::abs(output.high));
    const double total = sum.row(o).sum();
    sum.row(o) *= total > rounding * static_cast<double>(count) ? 1.0 / total : 0.0;
  }
  return sum;
}

}  // namespace llmt
