// Effects that a user writes down as expressions.
#include <fmt/format.h>

#include <algorithm>
#include <memory>
#include <set>

#include "effects/effect_entries.hpp"
#include "expressions/expression.hpp"
#include "llmt/limits.hpp"

namespace llmt::robotics {
namespace {

static_assert(Expression::longest == most(Limit::expression_characters));  // that header includes no library

// The number in "q3" or "tau3", or 0 if the name is of another kind.
std::size_t joint_number(const std::string& name, const std::string& prefix) {
  if (!name.starts_with(prefix) || name.size() == prefix.size() || name.size() > prefix.size() + 3) return 0;
  const std::string digits = name.substr(prefix.size());
  if (digits.find_first_not_of("0123456789") != std::string::npos) return 0;
  return static_cast<std::size_t>(std::stoi(digits));
}

// A term, ready to be evaluated: where each of its variables stands among q of all joints, tau of all joints, columns.
struct Compiled {
  Expression expression;
  int axis;  // 0, 1, 2 of the world, or -1: the joint
  std::vector<std::size_t> places = {};
  std::vector<double> variables = {};
};

Compiled compiled(const FormulaTerm& term, const std::vector<std::string>& columns, std::size_t joints) {
  Compiled result{.expression = Expression(term.text), .axis = term.acts_on == "joint" ? -1 : term.acts_on[0] - 'x'};
  for (const std::string& name : result.expression.names()) {
    const std::size_t q = joint_number(name, "q");
    const std::size_t tau = joint_number(name, "tau");
    const std::size_t column = std::ranges::find(columns, name) - columns.begin();
    result.places.push_back(q > 0 ? q - 1 : tau > 0 ? joints + tau - 1 : 2 * joints + column);
  }
  result.variables.resize(result.places.size());
  return result;
}

}  // namespace

std::vector<std::string> names_in_formula(const std::string& text) { return Expression(text).names(); }

double scale_of(const FormulaTerm& term, bool is_prismatic) {
  constexpr double usual_rad = 1e-4;
  constexpr double usual_mm = 0.1;
  if (term.scale > 0.0) return term.scale;
  return term.acts_on == "joint" && !is_prismatic ? usual_rad : usual_mm;
}

std::vector<std::string> formula_columns(const std::vector<FormulaTerm>& terms) {
  std::set<std::string> columns;
  for (const FormulaTerm& term : terms) {
    for (const std::string& name : names_in_formula(term.text)) {
      if (joint_number(name, "q") == 0 && joint_number(name, "tau") == 0) columns.insert(name);
    }
  }
  return {columns.begin(), columns.end()};
}

std::vector<std::size_t> formula_torques(const std::vector<FormulaTerm>& terms) {
  std::set<std::size_t> joints;
  for (const FormulaTerm& term : terms) {
    for (const std::string& name : names_in_formula(term.text)) {
      if (joint_number(name, "tau") > 0) joints.insert(joint_number(name, "tau") - 1);
    }
  }
  return {joints.begin(), joints.end()};
}

std::string term_refusal(const Chain& chain, const Effect& effect, const FormulaTerm& term) {
  static const std::set<std::string> targets = {"joint", "x", "y", "z"};
  if (!targets.contains(term.acts_on)) {
    return fmt::format("a term acts on \"{}\", must be joint, x, y or z", term.acts_on);
  }
  if (term.acts_on == "joint" && effect.at.empty()) return "a term acts on a joint, but there is no \"at\"";
  if (!(term.scale >= 0.0)) return fmt::format("the scale of a term is {}, must be > 0", term.scale);
  try {
    for (const std::string& name : names_in_formula(term.text)) {
      const std::size_t number = std::max(joint_number(name, "q"), joint_number(name, "tau"));
      if (number > chain.joints.size()) {
        return fmt::format("an expression names {}, the robot has {} joints", name, chain.joints.size());
      }
    }
  } catch (const ExpressionError& error) {
    return error.what();
  }
  return "";
}

std::string formula_refusal(const Chain& chain, const Effect& effect) {
  if (effect.formula.name.empty()) return "a formula needs a name";
  if (effect.formula.name.find_first_of(".[]@,") != std::string::npos) {
    return fmt::format("the name \"{}\" of a formula must be without . , @ [ ]", effect.formula.name);
  }
  if (effect.formula.terms.empty()) return "a formula needs terms";
  for (const FormulaTerm& term : effect.formula.terms) {
    const std::string reason = term_refusal(chain, effect, term);
    if (!reason.empty()) return reason;
  }
  return "";
}

ApplyFunction compile_formula(const Chain& chain, const Effect& effect) {
  const std::vector<std::string> columns = formula_columns(effect.formula.terms);
  const auto terms = std::make_shared<std::vector<Compiled>>();
  for (const FormulaTerm& term : effect.formula.terms) {
    terms->push_back(compiled(term, columns, chain.joints.size()));
  }
  return [terms](const PoseContext& pose, std::size_t joint, std::span<const double> values, std::span<const double>,
                 Deformation& deformation) {
    const std::size_t joints = pose.chain.joints.size();
    const auto quantity = [&](std::size_t place) {
      if (place < joints) return pose.q(place);
      return place < 2 * joints ? gravity_load(pose, place - joints) : pose.columns[place - 2 * joints];
    };
    for (std::size_t k = 0; k < values.size(); ++k) {
      if (values[k] == 0.0) continue;
      Compiled& term = (*terms)[k];
      std::ranges::transform(term.places, term.variables.begin(), quantity);
      const double error = values[k] * term.expression.value(term.variables);
      (term.axis < 0 ? deformation.joint(joint) : deformation.world_mm(term.axis)) += error;
    }
  };
}

EffectType formula_effect() {
  return {.name = "formula",
          .family = "formula",
          .formula = "sum of coefficients times the user's expressions",
          .source = "the user",
          .parameters = {{.name = "coefficient", .key = "coefficients", .list = true}},
          .senses = Senses::torques,
          .nature = Nature::weight,  // it may name torques
          .elastic = true,
          .has_formula = true,
          .in_c = {.refusal = "the user's expressions are not translated to C"}};
}

}  // namespace llmt::robotics
