// Terms of the row before, and shapes that no cause need have.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "discovery/terms/term_builders.hpp"

namespace llmt::discovery {
namespace {

// cos(m pi u), m = 0 ... count - 1, u = 0 ... 1 over the range; beyond it the value at its end.
Eigen::MatrixXd cosines(const Eigen::ArrayXd& x, double low, double range, int count) {
  const Eigen::ArrayXd u = ((x - low) / range).max(0.0).min(1.0);
  Eigen::MatrixXd functions(x.size(), count);
  for (int m = 0; m < count; ++m) functions.col(m) = (std::numbers::pi * m * u).cos();
  return functions;
}

std::vector<std::string> numbered(int count) {
  std::vector<std::string> names;
  for (int k = 0; k < count; ++k) names.push_back(fmt::format("c{}", k));
  return names;
}

ModelTerm smooth_shape(const InputView& input, std::string family, int count) {
  return {.family = std::move(family),
          .location = input.name,
          .formula = fmt::format("{} function of {}", count > 6 ? "some" : "smooth", input.name),
          .inputs = {input.name},
          .coefficients = numbered(count),
          .columns =
              [input, count](const Rows& rows, const Eigen::VectorXd&) {
                return cosines(rows.inputs.col(input.column).array(), input.low, input.range(), count);
              },
          .generic = true};
}

ModelTerm pair_shape(const InputView& a, const InputView& b) {
  return {.family = "?pair",
          .location = a.name + "," + b.name,
          .formula = fmt::format("smooth function of {} and {}", a.name, b.name),
          .inputs = {a.name, b.name},
          .coefficients = numbered(10),
          .columns =
              [a, b](const Rows& rows, const Eigen::VectorXd&) {
                const Eigen::MatrixXd of_a = cosines(rows.inputs.col(a.column).array(), a.low, a.range(), 4);
                const Eigen::MatrixXd of_b = cosines(rows.inputs.col(b.column).array(), b.low, b.range(), 4);
                Eigen::MatrixXd functions(rows.inputs.rows(), 10);
                Eigen::Index next = 0;
                for (Eigen::Index i = 0; i < 4; ++i) {
                  for (Eigen::Index j = 0; i + j < 4; ++j) {
                    functions.col(next++) = of_a.col(i).cwiseProduct(of_b.col(j));
                  }
                }
                return functions;
              },
          .generic = true};
}

// 0.5 + 0.5 cos(pi (x - c) / w) for |x - c| < w.
ModelTerm bump_shape(const InputView& input, int parts) {
  const double width = input.range() / parts;
  // Fewer are rather outliers than a bump.
  constexpr Eigen::Index fewest = 5;
  std::vector<double> centres;
  for (double c = input.low; c <= input.high; c += 0.25 * width) {
    const auto begin = std::ranges::upper_bound(input.distinct, c - 0.7 * width);
    const auto end = std::ranges::lower_bound(input.distinct, c + 0.7 * width);
    if (end - begin >= fewest) centres.push_back(c);
  }
  if (centres.empty()) return {};
  ModelTerm term = searched_term(
      input, "?bump", fmt::format("a bump in {}, {:.3g} wide", input.name, 2.0 * width), {"height"}, "",
      {.name = "centre", .unit = input.name, .tried = centres, .smooth = true, .kept = 1, .most = 1, .beyond = 0},
      [width](const Eigen::ArrayXd& x, double centre) -> Eigen::MatrixXd {
        const Eigen::ArrayXd u = ((x - centre) / width).abs().min(1.0);
        return (0.5 + 0.5 * (std::numbers::pi * u).cos()).matrix();
      });
  term.location = fmt::format("{}/{}", input.name, parts);
  term.generic = true;
  return term;
}

// For every row the row before it; the first has itself.
std::vector<Eigen::Index> rows_before(const Rows& rows) {
  std::vector<Eigen::Index> before(rows.sequence.size());
  for (std::size_t k = 0; k < rows.sequence.size(); ++k) {
    // A run begins where time goes back.
    const bool begins = k == 0 || !(rows.instants(rows.sequence[k]) > rows.instants(rows.sequence[k - 1]));
    before[rows.sequence[k]] = rows.sequence[begins ? k : k - 1];
  }
  return before;
}

ModelTerm sequence_term(
    const InputView& input, std::string family, std::string formula, std::string per,
    std::function<Eigen::MatrixXd(const Rows& rows, const std::vector<Eigen::Index>& before)> columns) {
  return {.family = std::move(family),
          .location = input.name,
          .formula = std::move(formula),
          .inputs = {input.name},
          .coefficients = {"coefficient"},
          .per = std::move(per),
          .columns = [own = std::move(columns)](const Rows& rows,
                                                const Eigen::VectorXd&) { return own(rows, rows_before(rows)); },
          .history = true};
}

}  // namespace

std::vector<ModelTerm> sequence_terms(const InputView& input, const std::string& order) {
  std::vector<ModelTerm> terms;
  if (input.distinct.size() < 3) return terms;
  const std::string& x = input.name;
  const Eigen::Index column = input.column;
  const std::string step = order.empty() ? "row" : order;
  terms.push_back(sequence_term(input, "previous", x + " of the row before", x,
                                [column](const Rows& rows, const std::vector<Eigen::Index>& before) -> Eigen::MatrixXd {
                                  return rows.inputs.col(column)(before);
                                }));
  terms.push_back(sequence_term(
      input, "rate", fmt::format("change of {} per {}", x, step), fmt::format("({}/{})", x, step),
      [column](const Rows& rows, const std::vector<Eigen::Index>& before) {
        Eigen::MatrixXd rate = Eigen::MatrixXd::Zero(rows.inputs.rows(), 1);
        for (Eigen::Index i = 0; i < rate.rows(); ++i) {
          const Eigen::Index k = before[i];
          if (k == i) continue;
          rate(i, 0) = (rows.inputs(i, column) - rows.inputs(k, column)) / (rows.instants(i) - rows.instants(k));
        }
        return rate;
      }));
  terms.push_back(sequence_term(input, "direction", fmt::format("+1 after {0} rose, -1 after {0} fell", x), "",
                                [column](const Rows& rows, const std::vector<Eigen::Index>& before) {
                                  Eigen::MatrixXd direction = Eigen::MatrixXd::Zero(rows.inputs.rows(), 1);
                                  for (const Eigen::Index i : rows.sequence) {
                                    const Eigen::Index k = before[i];
                                    const double change = rows.inputs(i, column) - rows.inputs(k, column);
                                    direction(i, 0) = change > 0.0 ? 1.0 : change < 0.0 ? -1.0 : direction(k, 0);
                                  }
                                  return direction;
                                }));
  return terms;
}

std::vector<ModelTerm> shapes_of(const std::vector<InputView>& inputs) {
  std::vector<ModelTerm> shapes;
  for (const InputView& input : inputs) {
    if (input.distinct.size() < 6) continue;
    shapes.push_back(smooth_shape(input, "?smooth", 5));
    if (input.distinct.size() >= 24) shapes.push_back(smooth_shape(input, "?fine", 12));
    for (const int parts : {4, 8, 16}) {
      ModelTerm bump = bump_shape(input, parts);
      if (!bump.constants.empty()) shapes.push_back(std::move(bump));
    }
  }
  for (std::size_t a = 0; a < inputs.size(); ++a) {
    for (std::size_t b = a + 1; b < inputs.size(); ++b) {
      if (inputs[a].distinct.size() >= 4 && inputs[b].distinct.size() >= 4)
        shapes.push_back(pair_shape(inputs[a], inputs[b]));
    }
  }
  return shapes;
}

}  // namespace llmt::discovery
