#include "llmt/discovery/terms.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <numbers>
#include <stdexcept>
#include <string_view>

#include "discovery/recording/recording.hpp"
#include "discovery/recording/refuse.hpp"
#include "discovery/terms/term_builders.hpp"

namespace llmt::discovery {
namespace {

// By the ending of the name; or by a usual name of a joint's angle, and values that radians may have.
bool is_angle(const InputView& input) {
  const std::string& name = input.name;
  if (name.ends_with("_deg") || name.ends_with("_rad")) return true;
  constexpr std::array<std::string_view, 6> usual = {"q", "theta", "phi", "psi", "angle", "joint"};
  const std::string_view letters = std::string_view(name).substr(0, name.find_last_not_of("_0123456789") + 1);
  const bool is_named = std::ranges::find(usual, letters) != usual.end() || letters.ends_with("_angle");
  constexpr double shortest = 1.0;  // a shorter piece of a sine is a parabola
  constexpr double longest = 4.0 * std::numbers::pi;
  return is_named && input.range() >= shortest && input.range() <= longest;
}

InputView view(const Inputs& inputs, Eigen::Index column) {
  InputView own{.column = column, .name = inputs.names[column], .low = 0.0, .high = 0.0, .distinct = {}};
  const auto values = inputs.values.col(column);
  own.distinct.assign(values.begin(), values.end());
  std::ranges::sort(own.distinct);
  own.distinct.erase(std::unique(own.distinct.begin(), own.distinct.end()), own.distinct.end());
  if (own.distinct.empty()) return own;
  own.low = own.distinct.front();
  own.high = own.distinct.back();
  return own;
}

ModelTerm harmonic(const InputView& input, int order) {
  const double radians = input.name.ends_with("_deg") ? std::numbers::pi / 180.0 : 1.0;
  const std::string h = order == 1 ? "" : fmt::format("{} ", order);
  return {.family = fmt::format("harmonic{}", order),
          .location = input.name,
          .formula = fmt::format("C cos({0}{1}) + S sin({0}{1})", h, input.name),
          .inputs = {input.name},
          .coefficients = {"C", "S"},
          .columns =
              [column = input.column, factor = radians * order](const Rows& rows, const Eigen::VectorXd&) {
                Eigen::MatrixXd waves(rows.inputs.rows(), 2);
                waves.col(0) = (factor * rows.inputs.col(column).array()).cos();
                waves.col(1) = (factor * rows.inputs.col(column).array()).sin();
                return waves;
              },
          .code = {fmt::format("cos({}*$1)", radians * order), fmt::format("sin({}*$1)", radians * order)}};
}

// a^power b.
ModelTerm power_product(const char* family, const InputView& a, int power, const InputView& b) {
  const std::string formula = fmt::format("{}{} {}", a.name, power == 1 ? "" : fmt::format("^{}", power), b.name);
  return {.family = family,
          .location = a.name + "," + b.name,
          .formula = formula,
          .inputs = {a.name, b.name},
          .coefficients = {"coefficient"},
          .per = fmt::format("({})", formula),
          .columns = [i = a.column, power, j = b.column](const Rows& rows, const Eigen::VectorXd&) -> Eigen::MatrixXd {
            Eigen::VectorXd values = rows.inputs.col(j);
            for (int k = 0; k < power; ++k) values.array() *= rows.inputs.col(i).array();
            return values;
          },
          .code = {power == 1 ? "$1*$2" : fmt::format("$1^{}*$2", power)}};
}

ModelTerm product(const InputView& a, const InputView& b) { return power_product("product", a, 1, b); }

ModelTerm square_product(const InputView& a, const InputView& b) { return power_product("square_product", a, 2, b); }

std::vector<ModelTerm> products_of(const std::vector<InputView>& inputs) {
  std::vector<ModelTerm> terms;
  for (std::size_t a = 0; a < inputs.size(); ++a) {
    for (std::size_t b = a + 1; b < inputs.size(); ++b) terms.push_back(product(inputs[a], inputs[b]));
  }
  if (inputs.size() > most_inputs_of_pairs) return terms;
  for (const InputView& a : inputs) {
    for (const InputView& b : inputs) {
      if (a.column != b.column && a.distinct.size() > 2) terms.push_back(square_product(a, b));
    }
  }
  return terms;
}

std::vector<ModelTerm> output_terms() {
  const auto term = [](std::string family, std::string formula, std::string per, std::string code, auto columns) {
    return ModelTerm{.family = std::move(family),
                     .location = "",
                     .formula = std::move(formula),
                     .inputs = {},
                     .coefficients = {"coefficient"},
                     .per = std::move(per),
                     .columns = columns,
                     .code = {std::move(code)}};
  };
  return {term("offset", "1", "", "1",
               [](const Rows& rows, const Eigen::VectorXd&) -> Eigen::MatrixXd {
                 return Eigen::VectorXd::Ones(rows.inputs.rows());
               }),
          term("gain", "simulated output", "simulated", "$s",
               [](const Rows& rows, const Eigen::VectorXd&) -> Eigen::MatrixXd { return rows.simulated; }),
          term("gain_curvature", "simulated output^2", "simulated^2", "$s^2",
               [](const Rows& rows, const Eigen::VectorXd&) -> Eigen::MatrixXd {
                 return rows.simulated.array().square().matrix();
               })};
}

void add_functions(const InputView& input, std::vector<ModelTerm>& terms) {
  const std::string& x = input.name;
  const std::size_t levels = input.distinct.size();
  terms.push_back(function_term(
      input, "linear", x, x, [](double v) { return v; }, "$1"));
  if (levels > 2)
    terms.push_back(function_term(
        input, "square", x + "^2", x + "^2", [](double v) { return v * v; }, "$1^2"));
  if (levels > 3)
    terms.push_back(function_term(
        input, "cube", x + "^3", x + "^3", [](double v) { return v * v * v; }, "$1^3"));
  if (input.low < 0.0 && input.high > 0.0 && levels > 2) {
    terms.push_back(function_term(
        input, "absolute", "|" + x + "|", x, [](double v) { return std::abs(v); }, "abs($1)"));
    terms.push_back(function_term(
        input, "sign", "sign(" + x + ")", "", [](double v) { return v > 0.0   ? 1.0
                                                                    : v < 0.0 ? -1.0
                                                                              : 0.0; },
        "sign($1)"));
    if (levels > 3) {
      terms.push_back(function_term(
          input, "signed_square", fmt::format("{0} |{0}|", x), x + "^2", [](double v) { return v * std::abs(v); },
          "$1*abs($1)"));
    }
  }
  if (input.low >= 0.0 && levels > 3) {
    terms.push_back(function_term(
        input, "root", fmt::format("sqrt({})", x), x + "^0.5", [](double v) { return std::sqrt(v); }, "sqrt($1)"));
  }
  if (input.low > 0.0 && levels > 3) {
    terms.push_back(function_term(
        input, "log", fmt::format("ln({})", x), "", [](double v) { return std::log(v); }, "ln($1)"));
    terms.push_back(function_term(
        input, "reciprocal", "1/" + x, x + "^-1", [](double v) { return 1.0 / v; }, "1/$1"));
  }
  if (is_angle(input) && levels > 4) {
    terms.push_back(harmonic(input, 1));
    terms.push_back(harmonic(input, 2));
  }
}

// A constant, one input, functions of it, several inputs, a constant that is searched, the row before.
int complexity_of(const ModelTerm& term) {
  static const std::map<std::string, int> of_family = {{"offset", 1},
                                                       {"linear", 2},
                                                       {"gain", 2},
                                                       {"square", 3},
                                                       {"sign", 3},
                                                       {"absolute", 3},
                                                       {"cube", 4},
                                                       {"root", 4},
                                                       {"log", 4},
                                                       {"reciprocal", 4},
                                                       {"signed_square", 4},
                                                       {"signed_power", 9},
                                                       {"gain_curvature", 4},
                                                       {"harmonic1", 5},
                                                       {"harmonic2", 5},
                                                       {"product", 6},
                                                       {"square_product", 7},
                                                       {"sign_product", 6},
                                                       {"load_friction", 5},
                                                       {"power", 9},
                                                       {"hill", 9},
                                                       {"sigmoid", 9},
                                                       {"coulomb_stribeck", 9},
                                                       {"limit", 9},
                                                       {"dead_band", 9},
                                                       {"rate", 10},
                                                       {"direction", 10},
                                                       {"previous", 11}};
  constexpr int with_constant = 8;
  const auto found = of_family.find(term.family);
  return found != of_family.end() ? found->second : with_constant;
}

}  // namespace

ModelTerm function_term(const InputView& input, std::string family, std::string formula, std::string per,
                        double (*function)(double), std::string code) {
  return {.family = std::move(family),
          .location = input.name,
          .formula = std::move(formula),
          .inputs = {input.name},
          .coefficients = {"coefficient"},
          .per = std::move(per),
          .columns = [column = input.column, function](const Rows& rows, const Eigen::VectorXd&) -> Eigen::MatrixXd {
            return rows.inputs.col(column).unaryExpr(function);
          },
          .code = {std::move(code)}};
}

ModelTerm own_term(std::string name, std::string formula, std::function<double(const Eigen::VectorXd& row)> function) {
  return {.family = std::move(name),
          .location = "",
          .formula = std::move(formula),
          .inputs = {},
          .coefficients = {"coefficient"},
          .columns = [own = std::move(function)](const Rows& rows, const Eigen::VectorXd&) {
            Eigen::MatrixXd column(rows.inputs.rows(), 1);
            for (Eigen::Index i = 0; i < column.rows(); ++i) column(i, 0) = own(rows.inputs.row(i).transpose());
            return column;
          }};
}

std::vector<ModelTerm> standard_terms(const Inputs& inputs, std::vector<UntestableCause>* untestable) {
  check_inputs(inputs);
  if (!inputs.order.empty()) order_column(inputs);
  std::vector<InputView> moving;
  for (Eigen::Index j = 0; j < inputs.values.cols(); ++j) {
    InputView own = view(inputs, j);
    if (own.distinct.size() > 1) {
      moving.push_back(std::move(own));
    } else if (untestable != nullptr) {
      untestable->push_back({own.name, "the input is constant"});
    }
  }
  std::vector<ModelTerm> terms = output_terms();
  const auto add = [&](std::vector<ModelTerm> more) {
    for (ModelTerm& term : more) terms.push_back(std::move(term));
  };
  for (const InputView& input : moving) {
    add_functions(input, terms);
    add(searched_terms(input));
    add(law_terms(input));
    if (input.name != inputs.order && input.distinct.size() > 2) add(sequence_terms(input, inputs.order));
  }
  add(products_of(moving));
  add(load_frictions(moving));
  for (ModelTerm& term : terms) term.complexity = complexity_of(term);
  add(shapes_of(moving));
  return terms;
}

std::vector<ModelTerm> row_before_terms(const Inputs& inputs, const std::string& input) {
  check_inputs(inputs);
  const auto place = std::ranges::find(inputs.names, input);
  if (place == inputs.names.end()) refuse("row_before_terms", fmt::format("\"{}\" is not an input", input));
  return sequence_terms(view(inputs, place - inputs.names.begin()), inputs.order);
}

Rows rows_of(const Inputs& inputs, const Eigen::VectorXd& simulated) {
  Rows rows = Recording(inputs).rows();
  rows.simulated = simulated;
  return rows;
}

}  // namespace llmt::discovery
