#include "discovery/search/scoring.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <map>

namespace llmt::discovery {
namespace {

// Directions with less of themselves outside the rest of a set than this are taken as dependent on it.
constexpr double smallest_pivot = 3e-3;

double log_binomial(double n, double k) {
  return std::lgamma(n + 1.0) - std::lgamma(k + 1.0) - std::lgamma(std::max(0.0, n - k) + 1.0);
}

}  // namespace

bool contains(const Set& set, std::size_t candidate) { return std::ranges::binary_search(set, candidate); }

Set with(Set set, std::size_t candidate) {
  set.insert(std::ranges::upper_bound(set, candidate), candidate);
  return set;
}

Set without(Set set, std::size_t candidate) {
  std::erase(set, candidate);
  return set;
}

Set filtered(const Set& set, const std::function<bool(std::size_t)>& keep) {
  Set kept;
  std::ranges::copy_if(set, std::back_inserter(kept), keep);
  return kept;
}

Scoring::Scoring(const Workspace& workspace, const std::vector<EffectCandidate>& candidates)
    : workspace_(&workspace),
      candidates_(&candidates),
      log_degrees_(std::log(workspace.independent_share() * workspace.degrees())) {
  std::map<std::string, std::size_t> numbers;
  for (std::size_t a = 0; a < candidates.size(); ++a) {
    const std::size_t family = numbers.try_emplace(candidates[a].family, numbers.size()).first->second;
    family_.push_back(family);
    family_choices_.resize(numbers.size(), 0.0);
    if (usable(a)) family_choices_[family] += 1.0;
  }
  families_ = static_cast<double>(std::ranges::count_if(family_choices_, [](double n) { return n > 0.0; }));
  for (std::size_t a = 0; a < candidates.size(); ++a) single_costs_.push_back(cost({a}));
}

double Scoring::misfit(double left, Eigen::Index directions) const {
  const double n = workspace_->degrees();
  const double share = workspace_->independent_share();
  const double used = static_cast<double>(directions) + workspace_->dropped_degrees();
  // Schwarz's approximation is for few directions and many data.
  constexpr double largest_share = 0.4;
  if (used > largest_share * share * n) return impossible;
  // Exact data: below rounding nothing can be told apart.
  const double least =
      std::max(workspace_->resolution() * workspace_->given_sum_of_squares(), std::numeric_limits<double>::min());
  return share * n * std::log(std::max(left, least) / (n - used));
}

double Scoring::outlier_cost() const {
  return static_cast<double>(workspace_->components()) * log_degrees_ + 2.0 * std::log(std::max(1.0, families_)) +
         2.0 * std::log(static_cast<double>(workspace_->samples()));
}

// The cost of choosing the family and `used` of its members.
double Scoring::family_cost(std::size_t family, double used) const {
  return used > 0.0 ? 2.0 * (std::log(std::max(1.0, families_)) + log_binomial(family_choices_[family], used)) : 0.0;
}

double Scoring::cost(const Set& set) const {
  double sum = static_cast<double>(workspace_->dropped().size()) * outlier_cost();
  std::map<std::size_t, double> used;
  for (const std::size_t a : set) {
    sum += static_cast<double>(workspace_->blocks()[a].size) * log_degrees_ + (*candidates_)[a].prior_cost;
    used[family_[a]] += 1.0;
  }
  for (const auto& [family, count] : used) sum += family_cost(family, count);
  return sum;
}

SetFit Scoring::fit(const Set& set) const {
  SetFit fit;
  for (const std::size_t a : set) {
    const Block& block = workspace_->blocks()[a];
    for (Eigen::Index i = 0; i < block.size; ++i) fit.columns.push_back(block.begin + i);
  }
  fit.left = workspace_->sum_of_squares();
  fit.solvable = true;
  if (fit.columns.empty()) return fit;
  const Eigen::LLT<Eigen::MatrixXd> factor(workspace_->gram()(fit.columns, fit.columns));
  fit.factor = factor.matrixL();
  fit.solvable = factor.info() == Eigen::Success && fit.factor.diagonal().minCoeff() > smallest_pivot;
  if (!fit.solvable) return fit;
  const Eigen::VectorXd moments = workspace_->moments()(fit.columns);
  fit.coefficients = factor.solve(moments);
  const double all = fit.left;
  fit.left = std::max(0.0, all - moments.dot(fit.coefficients));
  if (workspace_->uncorrected_moments().size() > 0) {
    // No values explain more than those of least squares.
    const Eigen::VectorXd plain = workspace_->uncorrected_moments()(fit.columns);
    fit.left = std::max(fit.left, all - plain.dot(factor.solve(plain)));
  }
  return fit;
}

double Scoring::dof(const SetFit& fit) const {
  const double taken = static_cast<double>(fit.columns.size()) + workspace_->dropped_degrees();
  return std::max(1.0, workspace_->degrees() - taken);
}

Eigen::VectorXd Scoring::values(const SetFit& fit, const Set& set, std::size_t candidate) const {
  Eigen::Index begin = 0;
  for (const std::size_t a : set) {
    if (a == candidate) break;
    begin += workspace_->blocks()[a].size;
  }
  const Block& block = workspace_->blocks()[candidate];
  return block.to_values * fit.coefficients.segment(begin, block.size);
}

Eigen::VectorXd Scoring::standard_errors(const SetFit& fit, const Set& set, std::size_t candidate) const {
  Eigen::Index begin = 0;
  for (const std::size_t a : set) {
    if (a == candidate) break;
    begin += workspace_->blocks()[a].size;
  }
  const Block& block = workspace_->blocks()[candidate];
  // Rows of to_values times the inverse of the Gram matrix' Cholesky factor: covariance = M M' sigma^2.
  Eigen::MatrixXd selector = Eigen::MatrixXd::Zero(std::ssize(fit.columns), block.to_values.rows());
  selector.middleRows(begin, block.size) = block.to_values.transpose();
  fit.factor.triangularView<Eigen::Lower>().solveInPlace(selector);
  return selector.colwise().norm().transpose() * std::sqrt(fit.left / dof(fit));
}

bool Scoring::within_limits(const SetFit& fit, const Set& set) const {
  constexpr double tolerated_errors = 2.0;
  for (const std::size_t a : set) {
    const EffectCandidate& candidate = (*candidates_)[a];
    if (candidate.lower.size() == 0) continue;
    const Eigen::VectorXd value = values(fit, set, a);
    const auto is_below = value.array() < candidate.lower.array();
    const auto is_above = value.array() > candidate.upper.array();
    if (!is_below.any() && !is_above.any()) continue;
    const Eigen::VectorXd tolerance = tolerated_errors * standard_errors(fit, set, a);
    if (((value + tolerance).array() < candidate.lower.array()).any()) return false;
    if (((value - tolerance).array() > candidate.upper.array()).any()) return false;
  }
  return true;
}

double Scoring::score(const Set& set) const {
  for (std::size_t i = 0; i < set.size(); ++i) {
    if (!usable(set[i])) return impossible;
    for (std::size_t k = 0; k < i; ++k) {
      if (family_[set[i]] == family_[set[k]] && (*candidates_)[set[i]].location == (*candidates_)[set[k]].location) {
        return impossible;
      }
    }
  }
  const SetFit fitted = fit(set);
  if (!fitted.solvable || !within_limits(fitted, set)) return impossible;
  return misfit(fitted.left, std::ssize(fitted.columns)) + cost(set);
}

std::vector<Scoring::Move> Scoring::additions(const Set& set, const std::vector<bool>& allowed) const {
  const SetFit base = fit(set);
  std::vector<Move> moves;
  if (!base.solvable) return moves;
  const Eigen::MatrixXd& gram = workspace_->gram();
  Eigen::VectorXd moments = workspace_->moments();
  Eigen::MatrixXd inside;
  if (!base.columns.empty()) {
    inside = gram(base.columns, Eigen::all);
    moments.noalias() -= inside.transpose() * base.coefficients;
    base.factor.triangularView<Eigen::Lower>().solveInPlace(inside);
  }
  const double own_cost = cost(set);
  std::vector<double> used(family_choices_.size(), 0.0);
  for (const std::size_t a : set) used[family_[a]] += 1.0;
  std::vector<double> one_more(used.size());
  for (std::size_t f = 0; f < used.size(); ++f) one_more[f] = family_cost(f, used[f] + 1.0) - family_cost(f, used[f]);
  for (std::size_t a = 0; a < candidates_->size(); ++a) {
    if (!allowed[a] || !usable(a) || contains(set, a)) continue;
    const Block& block = workspace_->blocks()[a];
    double gain = 0.0;
    if (block.size == 1) {
      double own = gram(block.begin, block.begin);
      if (!base.columns.empty()) own -= inside.col(block.begin).squaredNorm();
      if (!(own > smallest_pivot * smallest_pivot)) continue;
      gain = moments(block.begin) * moments(block.begin) / own;
    } else {
      Eigen::MatrixXd own = gram.block(block.begin, block.begin, block.size, block.size);
      if (!base.columns.empty()) {
        const auto part = inside.middleCols(block.begin, block.size);
        own.noalias() -= part.transpose() * part;
      }
      const Eigen::LLT<Eigen::Ref<Eigen::MatrixXd>> factor(own);
      if (factor.info() != Eigen::Success || own.diagonal().minCoeff() <= smallest_pivot) continue;
      gain = factor.matrixL().solve(moments.segment(block.begin, block.size)).squaredNorm();
    }
    const double taken = static_cast<double>(block.size) * log_degrees_ + (*candidates_)[a].prior_cost;
    moves.push_back({a, misfit(std::max(0.0, base.left - gain), std::ssize(base.columns) + block.size) + own_cost +
                            taken + one_more[family_[a]]});
  }
  std::ranges::sort(moves, [](const Move& a, const Move& b) {
    return a.score != b.score ? a.score < b.score : a.candidate < b.candidate;
  });
  return moves;
}

Eigen::VectorXd Scoring::remaining(const SetFit& fit) const {
  if (fit.columns.empty()) return workspace_->residuals();
  return workspace_->residuals() - workspace_->basis()(Eigen::all, fit.columns) * fit.coefficients;
}

Scoring::Deletion Scoring::deletion(const SetFit& fit) const {
  const Eigen::Index d = workspace_->components();
  const Eigen::VectorXd errors = remaining(fit);
  Eigen::MatrixXd used;
  if (!fit.columns.empty()) {
    used = workspace_->basis()(Eigen::all, fit.columns).transpose();
    fit.factor.triangularView<Eigen::Lower>().solveInPlace(used);
  }
  Deletion deletion{Eigen::VectorXd::Zero(errors.size()), Eigen::VectorXd::Zero(workspace_->samples())};
  for (Eigen::Index i = 0; i < workspace_->samples(); ++i) {
    if (std::ranges::find(workspace_->dropped(), static_cast<std::size_t>(i)) != workspace_->dropped().end()) continue;
    const auto rows = workspace_->baseline().middleRows(i * d, d);
    Eigen::MatrixXd own = Eigen::MatrixXd::Identity(d, d);
    own.noalias() -= rows * rows.transpose();
    if (used.size() != 0) own.noalias() -= used.middleCols(i * d, d).transpose() * used.middleCols(i * d, d);
    // A sample that almost alone determines a direction cannot be judged by the others: it counts as it is.
    constexpr double judged = 0.15;
    const Eigen::LLT<Eigen::MatrixXd> factor(own);
    if (factor.info() != Eigen::Success || factor.matrixLLT().diagonal().minCoeff() < judged) {
      deletion.errors.segment(i * d, d) = errors.segment(i * d, d);
      continue;
    }
    deletion.errors.segment(i * d, d) = factor.solve(errors.segment(i * d, d));
    deletion.gains(i) = errors.segment(i * d, d).dot(deletion.errors.segment(i * d, d));
  }
  return deletion;
}

std::set<std::string> families_of(const Scoring& scoring, const Set& set) {
  std::set<std::string> families;
  for (const std::size_t a : set) families.insert(scoring.candidates()[a].family);
  return families;
}

Set without_family(const Scoring& scoring, const Set& set, const std::string& family) {
  return filtered(set, [&](std::size_t a) { return scoring.candidates()[a].family != family; });
}

double share_of(const Scoring& scoring, const Set& set, const Set& rest) {
  const double total = scoring.workspace().sum_of_squares();
  const double left = scoring.fit(set).left;
  return total > left ? (scoring.fit(rest).left - left) / (total - left) : 0.0;
}

}  // namespace llmt::discovery
