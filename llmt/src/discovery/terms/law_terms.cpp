// Laws of machines, growth, friction and actuators, with one or two constants that are searched.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "discovery/terms/term_builders.hpp"
#include "discovery/terms/term_model.hpp"

namespace llmt::discovery {
namespace {

// These laws contain simpler terms, or come close to them: they must explain that much better.
constexpr double cost_of_generality = 6.0;

std::vector<double> geometric(double first, double last, int count) {
  std::vector<double> values;
  for (int k = 0; k < count; ++k) values.push_back(first * std::pow(last / first, k / static_cast<double>(count - 1)));
  return values;
}

TermConstant smooth(std::string name, std::string unit, std::vector<double> tried) {
  return {.name = std::move(name),
          .unit = std::move(unit),
          .tried = std::move(tried),
          .smooth = true,
          .kept = 1,
          .most = 1,
          .beyond = 0};
}

using OfConstants = Eigen::ArrayXd (*)(const Eigen::ArrayXd& x, const Eigen::VectorXd& constants);

ModelTerm law(const InputView& input, std::string family, std::string formula, std::string coefficient, std::string per,
              std::vector<TermConstant> constants, std::string code, OfConstants function) {
  return {
      .family = std::move(family),
      .location = input.name,
      .formula = std::move(formula),
      .inputs = {input.name},
      .coefficients = {std::move(coefficient)},
      .per = std::move(per),
      .columns = [column = input.column, function](const Rows& rows, const Eigen::VectorXd& values) -> Eigen::MatrixXd {
        return function(rows.inputs.col(column).array(), values).matrix();
      },
      .constants = std::move(constants),
      .prior_cost = cost_of_generality,
      .code = {std::move(code)}};
}

// Rising and falling ones are variants: a falling one is a rising one and an offset.
std::vector<ModelTerm> sigmoids(const InputView& input) {
  constexpr int centres = 23;
  std::vector<double> tried;
  for (int k = 1; k <= centres; ++k) tried.push_back(input.low + input.range() * k / (centres + 1.0));
  // A narrower one is a step.
  const std::vector<TermConstant> constants = {
      smooth("c", input.name, std::move(tried)),
      smooth("w", input.name, geometric(0.03 * input.range(), 0.25 * input.range(), 6))};
  return {law(input, "sigmoid", fmt::format("1/(1 + exp(-({} - c)/w))", input.name), "height", "", constants,
              "1/(1+exp(-($1-$c)/$d))",
              [](const Eigen::ArrayXd& x, const Eigen::VectorXd& c) -> Eigen::ArrayXd {
                return (1.0 + ((c(0) - x) / std::max(c(1), smallest_divisor)).min(largest_exponent).exp()).inverse();
              }),
          law(input, "sigmoid", fmt::format("1/(1 + exp(({} - c)/w))", input.name), "height", "", constants,
              "1/(1+exp(($1-$c)/$d))", [](const Eigen::ArrayXd& x, const Eigen::VectorXd& c) -> Eigen::ArrayXd {
                return (1.0 + ((x - c(0)) / std::max(c(1), smallest_divisor)).min(largest_exponent).exp()).inverse();
              })};
}

Eigen::ArrayXd falling_hill(const Eigen::ArrayXd& x, const Eigen::VectorXd& constants) {
  return (1.0 + (x / std::max(constants(0), smallest_divisor)).max(0.0).pow(constants(1))).inverse();
}

std::vector<ModelTerm> hills(const InputView& input) {
  const TermConstant half = smooth("c", input.name, geometric(0.05 * input.high, input.high, 20));
  // The rising one with n = 1 is a saturation.
  return {law(input, "hill", fmt::format("{0}^n/(c^n + {0}^n)", input.name), "limit", "",
              {half, smooth("n", "1", {1.5, 2.0, 2.5, 3.0, 4.0, 5.0, 6.0})}, "$1^$d/($c^$d+$1^$d)",
              [](const Eigen::ArrayXd& x, const Eigen::VectorXd& constants) -> Eigen::ArrayXd {
                return 1.0 - falling_hill(x, constants);
              }),
          law(input, "hill", fmt::format("c^n/(c^n + {0}^n)", input.name), "limit", "",
              {half, smooth("n", "1", {1.0, 1.5, 2.0, 2.5, 3.0, 4.0, 5.0, 6.0})}, "$c^$d/($c^$d+$1^$d)", falling_hill)};
}

ModelTerm power(const InputView& input) {
  std::vector<double> tried;
  for (double p = 0.2; p < 4.55; p += 0.15) tried.push_back(p);
  return law(input, "power", fmt::format("{}^p", input.name), "coefficient", fmt::format("{}^p", input.name),
             {smooth("p", "1", std::move(tried))}, "$1^$c",
             [](const Eigen::ArrayXd& x, const Eigen::VectorXd& constants) -> Eigen::ArrayXd {
               return x.max(0.0).pow(constants(0));
             });
}

// Stribeck's law with Coulomb's: from F_c + F_x at rest down to F_c.
ModelTerm coulomb_stribeck(const InputView& input) {
  const double far = std::max(-input.low, input.high);
  ModelTerm term =
      searched_term(input, "coulomb_stribeck", fmt::format("sign({0}) (F_c + F_x exp(-({0}/c)^2))", input.name),
                    {"F_c", "F_x"}, "", smooth("c", input.name, geometric(0.01 * far, 0.3 * far, 20)),
                    [](const Eigen::ArrayXd& v, double c) -> Eigen::MatrixXd {
                      Eigen::MatrixXd parts(v.size(), 2);
                      parts.col(0) = v.sign();
                      parts.col(1) = v.sign() * (-(v / c).square()).exp();
                      return parts;
                    },
                    {"sign($1)", "sign($1)*exp(-(($1/$c)^2))"});
  term.prior_cost = cost_of_generality;
  term.constants.front().width = true;
  return term;
}

// A valve's flow has p = 0.5.
ModelTerm signed_power(const InputView& input) {
  std::vector<double> tried;
  for (double p = 0.2; p < 3.05; p += 0.15) tried.push_back(p);
  return law(
      input, "signed_power", fmt::format("sign({0}) |{0}|^p", input.name), "coefficient",
      fmt::format("{}^p", input.name), {smooth("p", "1", std::move(tried))}, "sign($1)*abs($1)^$c",
      [](const Eigen::ArrayXd& x, const Eigen::VectorXd& p) -> Eigen::ArrayXd { return x.sign() * x.abs().pow(p(0)); });
}

// Where a limit or a dead band ends. Below zero they would be other laws, an offset and dry friction: NaN turns a fit
// back, as any column that is not finite.
double end_at(double c) { return c >= 0.0 ? c : std::numeric_limits<double>::quiet_NaN(); }

// What an actuator or a sensor that stops at +-c gives, and what one gives that begins beyond +-c.
std::vector<ModelTerm> two_sided(const InputView& input) {
  const std::string& x = input.name;
  const double far = std::max(-input.low, input.high);
  TermConstant inner = smooth("c", x, geometric(0.02 * far, 0.9 * far, 24));
  inner.width = true;
  return {law(input, "limit", fmt::format("max(-c, min(c, {}))", x), "slope", x, {inner}, "max(-($c), min($c, $1))",
              [](const Eigen::ArrayXd& v, const Eigen::VectorXd& c) -> Eigen::ArrayXd {
                const double end = end_at(c(0));
                return v.unaryExpr([end](double at) { return std::isnan(end) ? end : std::clamp(at, -end, end); });
              }),
          law(input, "dead_band", fmt::format("sign({0}) max(0, |{0}| - c)", x), "slope", x,
              {smooth("c", x, geometric(0.02 * far, 0.9 * far, 24))}, "sign($1)*max(0, abs($1) - $c)",
              [](const Eigen::ArrayXd& v, const Eigen::VectorXd& c) -> Eigen::ArrayXd {
                const double end = end_at(c(0));
                return v.sign() * v.abs().unaryExpr([end](double size) { return size < end ? 0.0 : size - end; });
              })};
}

ModelTerm friction(std::string family, std::string location, std::string formula, std::vector<std::string> inputs,
                   std::string per, std::function<Eigen::ArrayXd(const Rows& rows)> load, Eigen::Index speed,
                   std::string code) {
  return {.family = std::move(family),
          .location = std::move(location),
          .formula = std::move(formula),
          .inputs = std::move(inputs),
          .coefficients = {"coefficient"},
          .per = std::move(per),
          .columns = [own = std::move(load), speed](const Rows& rows, const Eigen::VectorXd&) -> Eigen::MatrixXd {
            return (rows.inputs.col(speed).array().sign() * own(rows).abs()).matrix();
          },
          .code = {std::move(code)}};
}

bool changes_sign(const InputView& input) { return input.low < 0.0 && input.high > 0.0; }

}  // namespace

std::vector<ModelTerm> law_terms(const InputView& input) {
  std::vector<ModelTerm> terms;
  if (input.distinct.size() < fewest_values_of_a_search) return terms;
  terms = sigmoids(input);
  if (input.low >= 0.0) {
    for (ModelTerm& term : hills(input)) terms.push_back(std::move(term));
    terms.push_back(power(input));
  }
  if (changes_sign(input)) {
    terms.push_back(coulomb_stribeck(input));
    terms.push_back(signed_power(input));
    for (ModelTerm& term : two_sided(input)) terms.push_back(std::move(term));
  }
  return terms;
}

std::vector<ModelTerm> load_frictions(const std::vector<InputView>& inputs) {
  std::vector<ModelTerm> terms;
  for (const InputView& speed : inputs) {
    if (!changes_sign(speed) || speed.distinct.size() < 3) continue;
    const std::string& v = speed.name;
    terms.push_back(friction(
        "load_friction", v, fmt::format("sign({}) |simulated output|", v), {v}, "simulated",
        [](const Rows& rows) -> Eigen::ArrayXd { return rows.simulated.array(); }, speed.column, "sign($1)*abs($s)"));
    if (inputs.size() > most_inputs_of_pairs) continue;
    for (const InputView& load : inputs) {
      if (load.column == speed.column || load.distinct.size() < 3) continue;
      const std::string& x = load.name;
      terms.push_back(friction(
          "sign_product", v + "," + x, fmt::format("sign({}) |{}|", v, x), {v, x}, x,
          [column = load.column](const Rows& rows) -> Eigen::ArrayXd { return rows.inputs.col(column).array(); },
          speed.column, "sign($1)*abs($2)"));
    }
  }
  return terms;
}

}  // namespace llmt::discovery
