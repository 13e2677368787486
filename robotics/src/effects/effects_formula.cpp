// Effects that a user writes down as expressions, evaluated by muParser.
#include <fmt/format.h>
#include <muParser.h>

#include <algorithm>
#include <memory>
#include <set>

#include "effects/effect_entries.hpp"

namespace llmt::robotics {
namespace {

// The number in "q3" or "tau3", or 0 if the name is of another kind.
std::size_t joint_number(const std::string& name, const std::string& prefix) {
  if (!name.starts_with(prefix) || name.size() == prefix.size() || name.size() > prefix.size() + 3) return 0;
  const std::string digits = name.substr(prefix.size());
  if (digits.find_first_not_of("0123456789") != std::string::npos) return 0;
  return static_cast<std::size_t>(std::stoi(digits));
}

// Expressions with the variables they read; the parsers hold pointers into the variables.
struct Program {
  std::vector<double> variables;  // q of all joints, tau of all joints, columns
  std::vector<mu::Parser> parsers;
  std::vector<int> axes;  // 0, 1, 2 of the world, or -1: the joint
};

void define_variables(Program& program, const Chain& chain, const std::vector<std::string>& columns) {
  const std::size_t joints = chain.joints.size();
  program.variables.assign(2 * joints + columns.size(), 0.0);
  for (mu::Parser& parser : program.parsers) {
    for (std::size_t j = 0; j < joints; ++j) {
      parser.DefineVar(fmt::format("q{}", j + 1), &program.variables[j]);
      parser.DefineVar(fmt::format("tau{}", j + 1), &program.variables[joints + j]);
    }
    for (std::size_t c = 0; c < columns.size(); ++c) parser.DefineVar(columns[c], &program.variables[2 * joints + c]);
  }
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
        return fmt::format("\"{}\" names {}, the robot has {} joints", term.text, name, chain.joints.size());
      }
    }
    // Mistakes that only show when it is evaluated, such as a function with too few arguments.
    Effect one = effect;
    one.formula.terms = {term};
    one.values = {1.0};
    compile_formula(chain, one);
  } catch (const mu::Parser::exception_type& error) {
    return fmt::format("\"{}\": {}", term.text, error.GetMsg());
  }
  return "";
}

}  // namespace

std::set<std::string> names_in_formula(const std::string& text) {
  mu::Parser parser;
  parser.SetExpr(text);
  std::set<std::string> names;
  for (const auto& [name, value] : parser.GetUsedVar()) names.insert(name);
  return names;
}

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
  const auto program = std::make_shared<Program>();
  for (const FormulaTerm& term : effect.formula.terms) {
    program->parsers.emplace_back().SetExpr(term.text);
    program->axes.push_back(term.acts_on == "joint" ? -1 : term.acts_on[0] - 'x');
  }
  define_variables(*program, chain, formula_columns(effect.formula.terms));
  for (mu::Parser& parser : program->parsers) parser.Eval();
  return [program](const PoseContext& pose, std::size_t joint, std::span<const double> values, std::span<const double>,
                   Deformation& deformation) {
    const std::size_t joints = pose.chain.joints.size();
    for (std::size_t j = 0; j < joints; ++j) {
      program->variables[j] = pose.q(j);
      program->variables[joints + j] = gravity_load(pose, j);
    }
    std::ranges::copy(pose.columns, program->variables.begin() + static_cast<Eigen::Index>(2 * joints));
    for (std::size_t k = 0; k < values.size(); ++k) {
      if (values[k] == 0.0) continue;
      const double error = values[k] * program->parsers[k].Eval();
      const int axis = program->axes[k];
      (axis < 0 ? deformation.joint(joint) : deformation.world_mm(axis)) += error;
    }
  };
}

EffectType formula_effect() {
  return {.name = "formula",
          .family = "formula",
          .formula = "sum of coefficients times the user's expressions",
          .source = "the user",
          .parameters = {{.name = "coefficient", .key = "coefficients", .list = true}},
          .elastic = true};
}

}  // namespace llmt::robotics
