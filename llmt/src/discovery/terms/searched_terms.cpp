// Terms with a constant that is searched.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "discovery/terms/term_builders.hpp"
#include "discovery/terms/term_model.hpp"

namespace llmt::discovery {
namespace {

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

using OfInput = Eigen::ArrayXd (*)(const Eigen::ArrayXd& x, double constant);

// Coefficient times one function of the input and a smooth constant.
ModelTerm one_function(const InputView& input, std::string family, std::string formula, std::string coefficient,
                       TermConstant constant, OfInput function, std::string code) {
  const std::string per = family.starts_with("hinge") ? input.name : "";
  return searched_term(
      input, std::move(family), std::move(formula), {std::move(coefficient)}, per, std::move(constant),
      [function](const Eigen::ArrayXd& x, double value) -> Eigen::MatrixXd { return function(x, value).matrix(); },
      {std::move(code)});
}

TermConstant smooth_constant(const InputView& input, std::string name, std::vector<double> tried, int beyond = 0) {
  return {.name = std::move(name),
          .unit = input.name,
          .tried = std::move(tried),
          .smooth = true,
          .kept = 1,
          .most = 1,
          .beyond = beyond};
}

// tanh(x/c) and alike turn over within the range, from the share `narrowest` of its farther end on; longer constants
// are straight lines and cubes.
std::vector<double> widths(const InputView& input, double narrowest, double widest = 1.0) {
  constexpr int count = 24;
  const double far = std::max(-input.low, input.high);
  std::vector<double> values;
  for (int k = 0; k < count; ++k) {
    values.push_back(far * widest * std::pow(narrowest / widest, 1.0 - k / static_cast<double>(count - 1)));
  }
  return values;
}

ModelTerm wave(const InputView& input) {
  const std::string& x = input.name;
  return searched_term(
      input, "wave", fmt::format("C cos(2 pi {0}/P) + S sin(2 pi {0}/P)", x), {"C", "S"}, "",
      {.name = "P", .unit = x, .tried = periods(input), .smooth = true, .kept = 2, .most = 2, .beyond = 1},
      [](const Eigen::ArrayXd& values, double period) {
        Eigen::MatrixXd waves(values.size(), 2);
        waves.col(0) = (2.0 * std::numbers::pi / period * values).cos();
        waves.col(1) = (2.0 * std::numbers::pi / period * values).sin();
        return waves;
      },
      {fmt::format("cos({}*$1/$c)", 2.0 * std::numbers::pi), fmt::format("sin({}*$1/$c)", 2.0 * std::numbers::pi)});
}

ModelTerm step(const InputView& input) {
  constexpr std::size_t most = 200;
  return one_function(
      input, "step", fmt::format("[{} > c]", input.name), "height",
      {.name = "c",
       .unit = input.name,
       .tried = thresholds(input.distinct, 4, most),
       .smooth = false,
       .kept = 1,
       .most = 3,
       .beyond = 0},
      [](const Eigen::ArrayXd& x, double cut) -> Eigen::ArrayXd { return (x > cut).cast<double>(); }, "($1 > $c)");
}

std::vector<ModelTerm> hinges(const InputView& input) {
  constexpr std::size_t most = 60;
  const TermConstant cut = smooth_constant(input, "c", thresholds(input.distinct, 4, most), 1);
  // Downwards it is another line and offset away from upwards: only one that ends at zero tells them apart.
  TermConstant downwards = cut;
  downwards.beyond = 0;
  return {one_function(
              input, "hinge", fmt::format("max(0, {} - c)", input.name), "slope", cut,
              [](const Eigen::ArrayXd& x, double c) -> Eigen::ArrayXd { return (x - c).max(0.0); }, "max(0, $1 - $c)"),
          one_function(
              input, "hinge_below", fmt::format("max(0, c - {})", input.name), "slope", downwards,
              [](const Eigen::ArrayXd& x, double c) -> Eigen::ArrayXd { return (c - x).max(0.0); }, "max(0, $c - $1)")};
}

ModelTerm settling(const InputView& input) {
  const std::string& x = input.name;
  const std::string since = input.low == 0.0 ? x : fmt::format("({} - {:.6g})", x, input.low);
  return searched_term(input, "settling", fmt::format("exp(-{}/tau)", since), {"A"}, "",
                       smooth_constant(input, "tau", time_constants(input)),
                       [low = input.low](const Eigen::ArrayXd& values, double tau) -> Eigen::MatrixXd {
                         return ((low - values) / std::max(tau, smallest_divisor)).min(largest_exponent).exp().matrix();
                       },
                       {fmt::format("exp(-($1 - ({}))/$c)", input.low)});
}

// Functions of inputs that change sign: those that saturate on both sides, and friction that falls as the speed grows.
std::vector<ModelTerm> odd_functions(const InputView& input) {
  const std::string& x = input.name;
  TermConstant width = smooth_constant(input, "c", widths(input, 0.01));
  width.width = true;
  // A narrower one is a sign and a line: Coulomb's and viscous friction.
  // Stribeck's peak has gone before the farther end. A wider one is a sign and a square.
  TermConstant peak = smooth_constant(input, "c", widths(input, 0.01, 0.3));
  peak.width = true;
  const TermConstant wide = smooth_constant(input, "c", widths(input, 0.05));
  return {one_function(
              input, "tanh", fmt::format("tanh({}/c)", x), "limit", width,
              [](const Eigen::ArrayXd& v, double c) -> Eigen::ArrayXd { return (v / c).tanh(); }, "tanh($1/$c)"),
          one_function(
              input, "asinh", fmt::format("asinh({}/c)", x), "coefficient", wide,
              [](const Eigen::ArrayXd& v, double c) -> Eigen::ArrayXd { return (v / c).asinh(); }, "asinh($1/$c)"),
          one_function(
              input, "stribeck", fmt::format("sign({0}) exp(-({0}/c)^2)", x), "height", peak,
              [](const Eigen::ArrayXd& v, double c) -> Eigen::ArrayXd { return v.sign() * (-(v / c).square()).exp(); },
              "sign($1)*exp(-(($1/$c)^2))")};
}

}  // namespace

ModelTerm searched_term(const InputView& input, std::string family, std::string formula,
                        std::vector<std::string> coefficients, std::string per, TermConstant constant,
                        std::function<Eigen::MatrixXd(const Eigen::ArrayXd& x, double constant)> columns,
                        std::vector<std::string> code) {
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
          .constants = {std::move(constant)},
          .code = std::move(code)};
}

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
  std::vector<ModelTerm> terms;
  if (input.distinct.size() < fewest_values_of_a_search) return terms;
  terms = {wave(input), step(input)};
  for (ModelTerm& term : hinges(input)) terms.push_back(std::move(term));
  terms.push_back(settling(input));
  if (input.low >= 0.0) {
    terms.push_back(one_function(
        input, "saturation", fmt::format("{0}/(c + {0})", input.name), "limit",
        smooth_constant(input, "c", time_constants(input)),
        [](const Eigen::ArrayXd& x, double half) -> Eigen::ArrayXd {
          return x / (std::max(half, smallest_divisor) + x);
        },
        "$1/($c + $1)"));
  }
  if (input.low < 0.0 && input.high > 0.0) {
    for (ModelTerm& term : odd_functions(input)) terms.push_back(std::move(term));
  }
  return terms;
}

}  // namespace llmt::discovery
