// Lists of terms made from others: without some of them, and beyond a threshold of an input.
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <set>
#include <stdexcept>

#include "discovery/terms/term_builders.hpp"
#include "llmt/discovery/terms.hpp"

namespace llmt::discovery {

std::vector<ModelTerm> of_families(std::vector<ModelTerm> terms, const std::vector<std::string>& only,
                                   const std::vector<std::string>& without) {
  std::set<std::string> families;
  for (const ModelTerm& term : terms) {
    if (!term.generic) families.insert(term.family);
  }
  for (const std::vector<std::string>* names : {&only, &without}) {
    for (const std::string& name : *names) {
      if (families.contains(name)) continue;
      throw std::invalid_argument(
          fmt::format("there is no family \"{}\" among the terms to try: {}", name, fmt::join(families, ", ")));
    }
  }
  const auto among = [](const std::vector<std::string>& names, const std::string& family) {
    return std::ranges::find(names, family) != names.end();
  };
  std::erase_if(terms, [&](const ModelTerm& term) {
    return !term.generic && ((!only.empty() && !among(only, term.family)) || among(without, term.family));
  });
  return terms;
}

std::vector<ModelTerm> without_duplicates(std::vector<ModelTerm> library, const std::vector<ModelTerm>& own,
                                          const Rows& rows) {
  constexpr double rounding = 1e-12;
  const auto direction = [&](const ModelTerm& term) -> Eigen::VectorXd {
    if (term.coefficients.size() != 1 || !term.constants.empty() || term.generic) return {};
    const Eigen::MatrixXd columns = term.columns(rows, {});
    return columns.col(0).norm() > 0.0 ? Eigen::VectorXd(columns.col(0).normalized()) : Eigen::VectorXd();
  };
  std::vector<Eigen::VectorXd> taken;
  for (const ModelTerm& term : own) taken.push_back(direction(term));
  std::erase_if(library, [&](const ModelTerm& term) {
    const Eigen::VectorXd mine = direction(term);
    return mine.size() > 0 && std::ranges::any_of(taken, [&](const Eigen::VectorXd& other) {
             return other.size() > 0 && 1.0 - std::abs(mine.dot(other)) < rounding;
           });
  });
  return library;
}

namespace {

// Both sides have some rows; further out there is next to nothing to see.
std::vector<double> quantiles(const Inputs& inputs, Eigen::Index column) {
  constexpr std::size_t count = 20;
  constexpr std::size_t share = 20;  // of the values that are beyond the outermost threshold: one of so many
  std::vector<double> values(inputs.values.col(column).begin(), inputs.values.col(column).end());
  std::ranges::sort(values);
  std::vector<double> distinct = values;
  distinct.erase(std::unique(distinct.begin(), distinct.end()), distinct.end());
  std::vector<double> tried;
  for (std::size_t k = 0; k < count; ++k) {
    const std::size_t outer = values.size() / share;
    const double value = values[outer + k * (values.size() - 1 - 2 * outer) / (count - 1)];
    const auto next = std::ranges::upper_bound(distinct, value);
    if (next == distinct.end()) break;
    const double between = 0.5 * (value + *next);
    if (tried.empty() || between > tried.back()) tried.push_back(between);
  }
  return tried;
}

// Of two constants and a threshold each combination is tried, and then refined.
std::vector<double> every_third(const std::vector<double>& tried) {
  std::vector<double> some;
  for (std::size_t k = 0; k < tried.size(); k += 3) some.push_back(tried[k]);
  return some;
}

ModelTerm in_regime(const ModelTerm& term, const std::string& gate, Eigen::Index column, std::vector<double> tried,
                    bool above) {
  const char* sign = above ? ">" : "<=";
  const char* symbol = term.constants.empty() ? "c" : "d";
  const char letter = static_cast<char>('c' + std::ssize(term.constants));  // of the last constant, in code
  ModelTerm own = term;
  own.location += fmt::format("{}where {} {} c", own.location.empty() ? "" : " ", gate, sign);
  own.formula = fmt::format("({}) [{} {} {}]", term.formula, gate, sign, symbol);
  own.regime = gate;
  auto place = std::ranges::find(own.inputs, gate);
  if (place == own.inputs.end()) place = own.inputs.insert(place, gate);
  const auto number = place - own.inputs.begin() + 1;
  for (std::string& code : own.code) code = fmt::format("({})*(${} {} ${})", code, number, sign, letter);
  for (TermConstant& constant : own.constants) {
    constant.kept = constant.most = 1;
    if (own.constants.size() > 1) constant.tried = every_third(constant.tried);
  }
  own.constants.push_back(
      {.name = term.constants.empty() ? "c" : "threshold", .unit = gate, .tried = std::move(tried), .smooth = false});
  own.columns = [columns = term.columns, column, above](const Rows& rows, const Eigen::VectorXd& constants) {
    const Eigen::Index last = constants.size() - 1;
    Eigen::MatrixXd values = columns(rows, constants.head(last));
    const Eigen::ArrayXd gates = rows.inputs.col(column).array();
    for (Eigen::Index i = 0; i < values.rows(); ++i) {
      if ((gates(i) > constants(last)) != above) values.row(i).setZero();
    }
    return values;
  };
  constexpr int beyond_others = 12;
  own.complexity = term.complexity + beyond_others;
  return own;
}

}  // namespace

std::vector<ModelTerm> regime_terms(const Inputs& inputs, const std::vector<ModelTerm>& library) {
  constexpr std::size_t fewest = 4;
  constexpr std::size_t most_constants = 2;
  std::vector<ModelTerm> terms;
  for (Eigen::Index j = 0; j < inputs.values.cols(); ++j) {
    if (inputs.names[j] == inputs.order) continue;
    const std::vector<double> tried = quantiles(inputs, j);
    if (tried.size() < fewest) continue;
    for (const ModelTerm& term : library) {
      const bool is_cause = !term.generic && !term.history && term.inner_state.empty() && !term.code.empty();
      const bool is_own = std::ranges::find(term.inputs, inputs.names[j]) != term.inputs.end();
      // An offset beyond a threshold is the term step, and so is a sign.
      if (!is_cause || term.family == "offset" || (is_own && term.family == "sign") ||
          term.constants.size() > (is_own ? 0 : most_constants))
        continue;
      for (const bool above : {true, false}) terms.push_back(in_regime(term, inputs.names[j], j, tried, above));
    }
  }
  return terms;
}

}  // namespace llmt::discovery
