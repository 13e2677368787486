#include "study/ode_system.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <fstream>
#include <nlohmann/json.hpp>
#include <span>
#include <sstream>
#include <stdexcept>

namespace bench {
namespace {

// A part of an expression and the sign + - * / before it.
struct Part {
  char sign;
  std::string text;
};

// The parts at the top level between two kinds of signs; `first` stands before a part without one.
std::vector<Part> parts(const std::string& expression, const std::string& signs, char first) {
  std::vector<Part> result;
  char sign = first;
  std::string text;
  int depth = 0;
  for (const char c : expression) {
    if (c == ' ') continue;
    depth += c == '(' ? 1 : c == ')' ? -1 : 0;
    if (depth > 0 || signs.find(c) == std::string::npos) {
      text += c;
      continue;
    }
    if (!text.empty()) result.push_back({sign, text});
    text.clear();
    sign = c;
  }
  if (!text.empty()) result.push_back({sign, text});
  return result;
}

// The inside of "(...)", empty if `text` is not one pair of brackets.
std::string inside_of(const std::string& text) {
  if (text.front() != '(') return {};
  int depth = 0;
  for (std::size_t k = 0; k < text.size(); ++k) {
    depth += text[k] == '(' ? 1 : text[k] == ')' ? -1 : 0;
    if (depth == 0) return k + 1 == text.size() ? text.substr(1, k - 1) : "";
  }
  return {};
}

std::string product_of(const std::vector<Part>& factors) {
  std::string text = factors.front().text;
  for (const Part& factor : std::span(factors).subspan(1)) text += factor.sign + factor.text;
  return text;
}

std::string replaced(std::string text, const std::string& what, const std::string& by) {
  for (auto at = text.find(what); at != std::string::npos; at = text.find(what, at + by.size())) {
    text.replace(at, what.size(), by);
  }
  return text;
}

OdeSystem system_of(const nlohmann::json& entry) {
  OdeSystem system;
  system.id = entry.at("id").get<int>();
  std::map<std::string, double> constants;
  const auto values = entry.at("consts").at(0).get<std::vector<double>>();
  for (std::size_t k = 0; k < values.size(); ++k) constants[fmt::format("c_{}", k)] = values[k];
  std::istringstream equations(entry.at("eq").get<std::string>());
  for (std::string equation; std::getline(equations, equation, '|');) {
    std::vector<OdeTerm> terms;
    // muParser has no cotangent.
    const std::string text = replaced(equation, "cot(", "1/tan(");
    for (const std::string& summand : summands(text)) terms.push_back({summand, StateFunction(summand, constants)});
    system.components.push_back(std::move(terms));
  }
  for (const auto& start : entry.at("init")) {
    const auto state = start.get<std::vector<double>>();
    if (state.size() != system.components.size()) throw std::runtime_error("init has another length than eq");
    system.starts.push_back(Eigen::Map<const Eigen::VectorXd>(state.data(), std::ssize(state)));
  }
  return system;
}

}  // namespace

std::vector<std::string> summands(const std::string& expression) {
  std::vector<std::string> result;
  for (const Part& summand : parts(expression, "+-", '+')) {
    std::vector<Part> factors = parts(summand.text, "*/", '*');
    std::vector<std::string> products;
    for (Part& factor : factors) {
      const std::string inside = inside_of(factor.text);
      if (factor.sign == '/' || inside.empty()) continue;
      const std::vector<std::string> inner = summands(inside);
      if (inner.size() < 2) continue;
      for (const std::string& one : inner) {
        factor.text = fmt::format("({})", one);
        for (const std::string& product : summands(product_of(factors))) products.push_back(product);
      }
      break;
    }
    if (products.empty()) products.push_back(product_of(factors));
    for (const std::string& product : products) {
      const bool negative = product.front() == '-';
      if (summand.sign == '+') result.push_back(product);
      if (summand.sign == '-') result.push_back(negative ? product.substr(1) : "-" + product);
    }
  }
  return result;
}

StateFunction::StateFunction(const std::string& text, const std::map<std::string, double>& constants)
    : expression_(text, constants) {
  for (const std::string& name : expression_.names()) {
    if (!name.starts_with("x_")) throw std::runtime_error(fmt::format("\"{}\" in \"{}\" is no state", name, text));
    states_.push_back(std::stoi(name.substr(2)));
  }
  values_.resize(states_.size());
}

double StateFunction::at(const Eigen::VectorXd& state) {
  for (std::size_t k = 0; k < states_.size(); ++k) values_[k] = state(states_[k]);
  return expression_.value(values_);
}

Eigen::VectorXd OdeSystem::derivative(const Eigen::VectorXd& state) {
  Eigen::VectorXd result = Eigen::VectorXd::Zero(std::ssize(components));
  for (std::size_t i = 0; i < components.size(); ++i) {
    for (OdeTerm& term : components[i]) result(i) += term.function.at(state);
  }
  return result;
}

std::vector<OdeSystem> read_odes(const std::string& file) {
  std::ifstream stream(file);
  std::vector<OdeSystem> systems;
  try {
    for (const nlohmann::json& entry : nlohmann::json::parse(stream)) systems.push_back(system_of(entry));
  } catch (const std::exception& error) {
    throw std::runtime_error(fmt::format("{}: system {}: {}", file, systems.size() + 1, error.what()));
  }
  return systems;
}

Eigen::MatrixXd trajectories(OdeSystem& system) {
  constexpr int steps = 5000;
  constexpr double step = 10.0 / steps;
  std::vector<Eigen::VectorXd> states;
  for (Eigen::VectorXd state : system.starts) {
    for (int k = 0; k <= steps && state.allFinite(); ++k) {
      states.push_back(state);
      const Eigen::VectorXd a = system.derivative(state);
      const Eigen::VectorXd b = system.derivative(state + 0.5 * step * a);
      const Eigen::VectorXd c = system.derivative(state + 0.5 * step * b);
      const Eigen::VectorXd d = system.derivative(state + step * c);
      state += step / 6.0 * (a + 2.0 * b + 2.0 * c + d);
    }
  }
  Eigen::MatrixXd all(std::ssize(states), std::ssize(system.components));
  for (std::size_t k = 0; k < states.size(); ++k) all.row(k) = states[k].transpose();
  return all;
}

}  // namespace bench
