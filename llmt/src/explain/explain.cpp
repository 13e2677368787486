#include "llmt/explain.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "base/checks.hpp"
#include "base/parallel.hpp"
#include "explain/straight_line.hpp"
#include "model/evaluator.hpp"
#include "model/through_regressors.hpp"
#include "numerics/quadrature.hpp"

namespace llmt {
namespace {

// Pieces are halved at most this often on one line, and no further than to this length.
constexpr int most_halvings = 5000;
constexpr double shortest_piece = 1e-9;

// How well a line is integrated.
struct Precision {
  double tolerance;  // of the sum over a piece, as a fraction of the output's range
  bool exact;        // cut at all kinks, orders by degree; else equal pieces and one order
};
constexpr Precision fine = {1e-10, true};
constexpr Precision coarse = {1e-4, false};
constexpr int coarse_pieces = 8;

// The shares of one partition along one line.
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
        line_(model, reference, point),
        deviations_(std::ssize(model.regressors())) {
    const Eigen::Index outputs = std::ssize(partition.outputs);
    tolerance_.resize(outputs);
    for (Eigen::Index o = 0; o < outputs; ++o) {
      const OutputColumn& output = model.outputs()[partition.outputs[o]];
      tolerance_(o) = precision_.tolerance * (output.high - output.low) +
                      1e-14 * std::max(std::abs(output.low), std::abs(output.high));
    }
    shares_.setZero(outputs, point.size());
  }

  // Sets the rows of the partition's outputs.
  void run(Attribution& result) {
    Pieces pieces = cut_line(model_, partition_, evaluator_, line_, precision_.exact);
    std::vector<double>& cuts = pieces.cuts;
    std::vector<Crossing>& crossings = pieces.crossings;
    if (!precision_.exact && partition_.validity.kind != ValidityKind::crisp) {
      for (int k = 1; k < coarse_pieces; ++k) {
        cuts.push_back(static_cast<double>(k) / coarse_pieces);
      }
      std::ranges::sort(cuts);
    }
    Eigen::VectorXd row = line_.reference;
    Eigen::VectorXd value = predict(row);
    set(result.reference, value);
    double from = 0.0;
    std::size_t next = 0;
    for (std::size_t k = 0; k < cuts.size();) {
      const double to = cuts[k];
      // Half as far as cut_line() moves cuts to the middle and the end, so that these are never skipped.
      for (; k < cuts.size() && cuts[k] <= to + 0.5 * same_position; ++k) {
      }
      const std::size_t first = next;
      for (; next < crossings.size() && crossings[next].position <= to + same_position; ++next) {
      }
      Eigen::VectorXd end = line_.at(to, row);
      for (std::size_t c = next; c-- > first;) {  // the first of an input wins
        end(crossings[c].input) = crossings[c].before;
      }
      Eigen::VectorXd end_value = predict(end);
      integrate(from, to, row, value, end_value);
      std::stable_sort(crossings.begin() + static_cast<Eigen::Index>(first),
                       crossings.begin() + static_cast<Eigen::Index>(next),
                       [](const Crossing& a, const Crossing& b) { return a.input < b.input; });
      for (std::size_t c = first; c < next; ++c) {
        jump(crossings[c].input, crossings[c].after, crossings[c].parts, end, end_value);
      }
      if (to == 0.5) {
        for (const Eigen::Index j : line_.switched) {
          jump(j, line_.point(j), {}, end, end_value);
        }
      }
      row = std::move(end);
      value = std::move(end_value);
      from = to;
    }
    set(result.prediction, value);
    for (std::size_t o = 0; o < partition_.outputs.size(); ++o) {
      result.contributions.row(partition_.outputs[o]) = shares_.row(o);
    }
  }

 private:
  void set(Eigen::VectorXd& values, const Eigen::VectorXd& of_partition) const {
    for (std::size_t o = 0; o < partition_.outputs.size(); ++o) {
      values(partition_.outputs[o]) = of_partition(o);
    }
  }

  Eigen::VectorXd predict(const Eigen::VectorXd& row) {
    deviations_at(model_.inputs(), model_.regressors(), row.data(), deviations_.data());
    Eigen::VectorXd values(std::ssize(partition_.outputs));
    evaluator_.activate(row.data(), active_);
    evaluator_.combine(active_, deviations_.data(), values.data());
    return values;
  }

  // Sets one input, and gives it what that changes; or all inputs their `parts` of it.
  void jump(Eigen::Index input, double to, const Eigen::VectorXd& parts, Eigen::VectorXd& row, Eigen::VectorXd& value) {
    row(input) = to;
    const Eigen::VectorXd changed = predict(row);
    if (parts.size() > 0) {
      shares_ += (changed - value) * parts.transpose();
    } else {
      shares_.col(input) += changed - value;
    }
    value = changed;
  }

  // Degree of the prediction, as a polynomial of the position, around a point on the line.
  int degree(int index, const Eigen::VectorXd& row) const {
    const Node& node = partition_.nodes[index];
    if (node.is_leaf()) {
      return has_products_ ? 8 : 2;  // where a guard sets in, and the holds of both factors
    }
    const double left = evaluator_.left_share(index, row.data());
    if (left >= 1.0 || left <= 0.0) return degree(left >= 1.0 ? node.left : node.right, row);
    const bool moves = node.is_oblique() || line_.way(node.split_input) != 0.0;
    const int of_transition = !moves ? 0 : partition_.validity.smoothness == 1 ? 3 : 5;
    return of_transition + std::max(degree(node.left, row), degree(node.right, row));
  }

  // Mean of dF/dx_j (point_j - reference_j) between two positions, outputs x inputs.
  Eigen::MatrixXd mean_rate(double from, double to, const Eigen::VectorXd& row, int order) {
    const Quadrature& rule = quadrature(order);
    Eigen::MatrixXd mean = Eigen::MatrixXd::Zero(shares_.rows(), shares_.cols());
    for (std::size_t i = 0; i < rule.nodes.size(); ++i) {
      const Eigen::VectorXd x = line_.at(from + rule.nodes[i] * (to - from), row);
      deviations_at(model_.inputs(), model_.regressors(), x.data(), deviations_.data());
      evaluator_.derivatives(x.data(), deviations_.data(), by_input_, by_regressor_);
      add_through_regressors(model_.inputs(), model_.regressors(), x.data(), by_regressor_, by_input_);
      for (const Eigen::Index j : line_.moving) {
        mean.col(j) += rule.weights[i] * line_.way(j) * by_input_.col(j);
      }
    }
    return mean;
  }

  // Adds the shares of a piece in which nothing jumps.
  void integrate(double from, double to, const Eigen::VectorXd& row, const Eigen::VectorXd& value,
                 const Eigen::VectorXd& end_value) {
    const ValidityKind kind = partition_.validity.kind;
    const bool polynomial = kind == ValidityKind::crisp || kind == ValidityKind::blend;
    const double length = to - from;
    const Eigen::VectorXd change = end_value - value;
    if (line_.moving.empty() || (length <= 0.0 && change.isZero(0.0))) return;
    const double middle = from + 0.5 * length;
    const Eigen::VectorXd middle_row = line_.at(middle, row);
    const int of_prediction = !precision_.exact || !polynomial ? 8 : degree(0, middle_row);
    Eigen::MatrixXd rate = mean_rate(from, to, row, (of_prediction + 1) / 2);
    const auto adds_up = [&] {
      return ((change - length * rate.rowwise().sum()).array().abs() <= tolerance_.array()).all();
    };
    bool accepted = adds_up();
    if (precision_.exact && (!accepted || !polynomial)) {
      // Twice the order: enough for a held output, and a second opinion on what is not a polynomial.
      const Eigen::MatrixXd better = mean_rate(from, to, row, 2 * of_prediction);
      const bool agree =
          ((length * (better - rate)).cwiseAbs().rowwise().maxCoeff().array() <= tolerance_.array()).all();
      rate = better;
      accepted = adds_up() && (agree || polynomial);
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
    for (Eigen::Index o = 0; o < share.rows(); ++o) {
      const double total = rate.row(o).cwiseAbs().sum();
      for (const Eigen::Index j : line_.moving) {
        share(o, j) +=
            rest(o) * (total > 0.0 ? std::abs(rate(o, j)) / total : 1.0 / static_cast<double>(line_.moving.size()));
      }
    }
    shares_ += share;
  }

  const Model& model_;
  const Partition& partition_;
  const Evaluator& evaluator_;
  Precision precision_;
  bool has_products_;
  StraightLine line_;
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
  const Eigen::Index count = std::min(inputs.rows(), importance_rows);
  std::vector<Eigen::MatrixXd> of_row(count);
  parallel_for(count, max_threads, [&](Eigen::Index k) {
    const Eigen::VectorXd point = inputs.row(k * inputs.rows() / count).transpose();
    of_row[k] = attribute_with(model, evaluators, point, reference, coarse).contributions.cwiseAbs();
  });
  Eigen::MatrixXd sum = Eigen::MatrixXd::Zero(model.num_outputs(), model.num_inputs());
  for (const Eigen::MatrixXd& contributions : of_row) {
    sum += contributions;
  }
  for (Eigen::Index o = 0; o < sum.rows(); ++o) {
    const OutputColumn& output = model.outputs()[o];
    const double rounding = 1e-14 * std::max(std::abs(output.low), std::abs(output.high));
    const double total = sum.row(o).sum();
    sum.row(o) *= total > rounding * static_cast<double>(count) ? 1.0 / total : 0.0;
  }
  return sum;
}

}  // namespace llmt
