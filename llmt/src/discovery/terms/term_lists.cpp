// Lists of terms without some of them.
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <set>
#include <stdexcept>

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

}  // namespace llmt::discovery
