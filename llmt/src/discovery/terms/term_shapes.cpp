// Terms with searched constants, terms of the row before, and shapes that no cause need have.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "discovery/terms/term_builders.hpp"

namespace llmt::discovery {
namespace {

constexpr double pi = std::numbers::pi;

ModelTerm searched(const InputView& input, std::string family, std::string formula,
                   std::vector<std::string> coefficients, std::string per, TermConstant constant,
                   std::function<Eigen::MatrixXd(const Eigen::ArrayXd& x, double constant)> columns) {
  return {.family = std::move(family),
          .location = input.name,
          .formula = std::move(formula),
          .inputs = {input.name},
          .coefficients = std::move(coefficients),
          .per = std::move(per),
          .columns =
              [column = input.column, own = std::move(columns)](const Rows& rows, const Eigen::VectorXd& constants) {
                return own(rows.inputs.col(column).array(), constants(0));
              },
          .constants = {std::move(constant)}};
}

// From half a period over the range up to one period in two values, in steps that no peak of the spectrum hides
// between.
std::vector<double> periods(const InputView& input) {
  constexpr int most = 500;
  const double step = 0.2 / input.range();  // of 1/P
  const double lowest = 0.5 / input.range();
  const double highest = 0.5 * static_cast<double>(input.distinct.size() - 1) / input.range();
  const int count = std::min(most, static_cast<int>((highest - lowest) / step) + 1);
  std::vector<double> values;
  for (int k = count - 1; k >= 0; --k) values.push_back(1.0 / (lowest + k * step));
  return values;
}

std::vector<double> time_constants(const InputView& input) {
  constexpr int count = 40;
  constexpr double longest = 2.0;  // of the range: longer ones are straight lines
  const double first = std::max(0.005, 3.0 / static_cast<double>(input.distinct.size()));
  std::vector<double> values;
  for (int k = 0; k < count; ++k) {
    values.push_back(input.range() * first * std::pow(longest / first, k / static_cast<double>(count - 1)));
  }
  return values;
}

// cos(m pi u), m = 0 ... count - 1, u = 0 ... 1 over the range; beyond it the value at its end.
Eigen::MatrixXd cosines(const Eigen::ArrayXd& x, double low, double range, int count) {
  const Eigen::ArrayXd u = ((x - low) / range).max(0.0).min(1.0);
  Eigen::MatrixXd functions(x.size(), count);
  for (int m = 0; m < count; ++m) functions.col(m) = (pi * m * u).cos();
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
  ModelTerm term = searched(
      input, "?bump", fmt::format("a bump in {}, {:.3g} wide", input.name, 2.0 * width), {"height"}, "",
      {.name = "centre", .unit = input.name, .tried = centres, .smooth = true, .kept = 1, .most = 1, .beyond = 0},
      [width](const Eigen::ArrayXd& x, double centre) -> Eigen::MatrixXd {
        const Eigen::ArrayXd u = ((x - centre) / width).abs().min(1.0);
        return (0.5 + 0.5 * (pi * u).cos()).matrix();
      });
  term.location = fmt::format("{}/{}", input.name, parts);
  term.generic = true;
  return term;
}

// For every row the row before it; the first has itself.
std::vector<Eigen::Index> rows_before(const Rows& rows) {
  std::vector<Eigen::Index> before(rows.sequence.size());
  for (std::size_t k = 0; k < rows.sequence.size(); ++k) {
    before[rows.sequence[k]] = rows.sequence[k > 0 ? k - 1 : 0];
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
          .columns = [own = std::move(columns)](const Rows& rows, const Eigen::VectorXd&) {
            return own(rows, rows_before(rows));
          }};
}

}  // namespace

std::vector<double> thresholds(const std::vector<double>& distinct, std::size_t beyond, std::size_t count) {
  std::vector<double> all;
  for (std::size_t k = beyond; k + beyond <= distinct.size(); ++k) {
    if (k > 0 && k < distinct.size()) all.push_back(0.5 * (distinct[k - 1] + distinct[k]));
  }
  if (all.size() <= count) return all;
  std::vector<double> some;
  for (std::size_t k = 0; k < count; ++k) some.push_back(all[k * (all.size() - 1) / (count - 1)]);
  return some;
}

std::vector<ModelTerm> searched_terms(const InputView& input) {
  constexpr std::size_t fewest = 8;
  std::vector<ModelTerm> terms;
  if (input.distinct.size() < fewest) return terms;
  const std::string& x = input.name;
  terms.push_back(
      searched(input, "wave", fmt::format("C cos(2 pi {0}/P) + S sin(2 pi {0}/P)", x), {"C", "S"}, "",
               {.name = "P", .unit = x, .tried = periods(input), .smooth = true, .kept = 2, .most = 2, .beyond = 1},
               [](const Eigen::ArrayXd& values, double period) {
                 Eigen::MatrixXd waves(values.size(), 2);
                 waves.col(0) = (2.0 * pi / period * values).cos();
                 waves.col(1) = (2.0 * pi / period * values).sin();
                 return waves;
               }));
  const std::string since = input.low == 0.0 ? x : fmt::format("({} - {:.6g})", x, input.low);
  constexpr std::size_t most = 200;
  const std::vector<double> cuts = thresholds(input.distinct, 4, most);
  terms.push_back(searched(input, "step", fmt::format("[{} > c]", x), {"height"}, "",
                           {.name = "c", .unit = x, .tried = cuts, .smooth = false, .kept = 1, .most = 3, .beyond = 0},
                           [](const Eigen::ArrayXd& values, double cut) -> Eigen::MatrixXd {
                             return (values > cut).cast<double>().matrix();
                           }));
  terms.push_back(searched(
      input, "hinge", fmt::format("max(0, {} - c)", x), {"slope"}, x,
      {.name = "c",
       .unit = x,
       .tried = thresholds(input.distinct, 4, 60),
       .smooth = true,
       .kept = 1,
       .most = 1,
       .beyond = 1},
      [](const Eigen::ArrayXd& values, double cut) -> Eigen::MatrixXd { return (values - cut).max(0.0).matrix(); }));
  terms.push_back(searched(
      input, "settling", fmt::format("exp(-{}/tau)", since), {"A"}, "",
      {.name = "tau", .unit = x, .tried = time_constants(input), .smooth = true, .kept = 1, .most = 1, .beyond = 0},
      [low = input.low](const Eigen::ArrayXd& values, double tau) -> Eigen::MatrixXd {
        return (-(values - low).max(0.0) / std::max(tau, 1e-300)).exp().matrix();
      }));
  if (input.low >= 0.0) {
    terms.push_back(searched(
        input, "saturation", fmt::format("{0}/(c + {0})", x), {"limit"}, "",
        {.name = "c", .unit = x, .tried = time_constants(input), .smooth = true, .kept = 1, .most = 1, .beyond = 0},
        [](const Eigen::ArrayXd& values, double half) -> Eigen::MatrixXd {
          return (values / (std::max(half, 1e-300) + values)).matrix();
        }));
  }
  return terms;
}

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
