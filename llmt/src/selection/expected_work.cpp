#include "selection/expected_work.hpp"

#include <algorithm>
#include <cmath>

#include "selection/held_out_errors.hpp"
#include "selection/screening.hpp"

namespace llmt {
namespace {

// Held-out rows that are enough to tell good candidates from bad ones.
constexpr Eigen::Index screening_rows = 1000;

// Probability that screening goes on to a round of larger trees.
constexpr double goes_on = 0.6;

// Thresholds of jumps that leave different jumps: their usual number.
constexpr std::size_t usual_jumps = 2;

// Where candidates are costly, hardly more than one shape is left at last: others are clearly worse.
constexpr double costly_shapes = 1.2;

// Candidates of each leaf count of a shape that are compared on all folds.
constexpr Eigen::Index candidates_at_last = 2;

// Passes over all rows of an estimate on many rows that starts from a sample, and the sample's rows for an unknown.
constexpr double passes_from_sample = 3.0;
constexpr Eigen::Index rows_per_unknown = 50;

// Leaves that reach a row, on average. In one set it was twice this, in another half.
double leaves_at_row(Eigen::Index leaves, double width) {
  const auto all = static_cast<double>(leaves);
  return width > 0.0 ? std::min(all, 1.0 + 1.4 * width * std::pow(all, 0.6)) : 1.0;
}

}  // namespace

double operations_of_sums(Eigen::Index rows, Eigen::Index leaves, Eigen::Index coefficients, double width) {
  const double reached = leaves_at_row(leaves, width);
  const double products = 0.5 * static_cast<double>(coefficients * (coefficients + 1));
  return static_cast<double>(rows) * (800.0 + 95.0 * reached + 0.1 * products * reached * reached);
}

double operations_of_solutions(Eigen::Index leaves, Eigen::Index coefficients, Eigen::Index regularisations) {
  const auto size = static_cast<double>(coefficients);
  const double unknowns = static_cast<double>(leaves) * size;
  const double solution =
      0.021 * unknowns * unknowns * unknowns + 0.3 * unknowns * unknowns + 7.0 * unknowns * size * size;
  return 7.0 * unknowns * unknowns + static_cast<double>(regularisations) * solution;
}

double operations_of_pass(Eigen::Index rows, Eigen::Index leaves, double width) {
  return static_cast<double>(rows) * (30.0 + 16.0 * leaves_at_row(leaves, width));
}

double operations_of_estimate(Eigen::Index rows, const Candidate& candidate, Eigen::Index coefficients) {
  const double width = candidate.validity.kind == ValidityKind::crisp ? 0.0 : candidate.validity.width;
  const Eigen::Index enough = rows_per_unknown * candidate.leaves * coefficients;
  const bool samples = width > 0.0 && rows > 2 * enough;
  const double sums = operations_of_sums(samples ? enough : rows, candidate.leaves, coefficients, width);
  const double solution = width > 0.0 ? operations_of_solutions(candidate.leaves, coefficients, 1) : 0.0;
  // A row is also fetched for every pass.
  const double pass = operations_of_pass(rows, candidate.leaves, width) + 200.0 * static_cast<double>(rows);
  return sums + solution + (samples ? passes_from_sample * pass : 0.0);
}

ExpectedSteps::ExpectedSteps(const std::vector<FoldRows>& folds, Eigen::Index coefficients,
                             const Candidates& candidates, std::vector<Eigen::Index> leaf_counts, std::size_t jumps)
    : folds_(folds),
      coefficients_(coefficients),
      candidates_(candidates),
      counts_(std::move(leaf_counts)),
      jumps_(std::max<std::size_t>(1, jumps)),
      screening_(screening_folds(folds)) {}

double ExpectedSteps::in_all() const {
  if (counts_.empty() || candidates_.widths.empty()) return 0.0;
  std::size_t end = end_of_round(cheap_unknowns);
  if (end == 0) end = 1;
  const auto ridges = std::max<Eigen::Index>(1, std::ssize(candidates_.ridges));
  const std::size_t widths = candidates_.widths.size();
  const std::size_t with_jumps = 2 * (jumps_ - 1);
  double first = 0.0;
  for (const double width : candidates_.widths) {
    for (std::size_t fold = 0; fold < screening_; ++fold) first += of_shape(folds_[fold], width, 0, end, ridges);
  }
  first *= static_cast<double>(widths + with_jumps) / static_cast<double>(widths);
  return first + from_round(end, std::max(fewest_shapes, (widths + with_jumps) / 2), end - 1);
}

double ExpectedSteps::on_all_rows() const {
  if (folds_.size() > 1 || counts_.empty() || candidates_.widths.empty()) return 0.0;
  Candidate usual{.leaves = counts_[counts_.size() - std::min<std::size_t>(2, counts_.size())]};
  usual.validity = {candidates_.kind, middle_width()};
  return operations_of_estimate(folds_.front().training.count(), usual, coefficients_);
}

double ExpectedSteps::from_round(std::size_t begin, std::size_t shapes, std::size_t best) const {
  if (begin >= counts_.size() || shapes == 0) return from_refinement(best);
  std::size_t end = begin;
  for (Eigen::Index unknowns = cheap_unknowns; end <= begin; unknowns *= next_unknowns) end = end_of_round(unknowns);
  const double round = static_cast<double>(shapes) * on_folds(0, screening_, begin, end, 1);
  const double with_round = round + from_round(end, std::max(fewest_shapes, (shapes + 1) / 2), end - 1);
  return goes_on * with_round + (1.0 - goes_on) * from_refinement(best);
}

// The best two widths, each with a jump and with none; fewer where candidates are costly.
double ExpectedSteps::finalists(std::size_t best) const {
  if (counts_[best] * coefficients_ > next_unknowns * cheap_unknowns) return costly_shapes;
  const auto widths = static_cast<double>(std::min<std::size_t>(2, candidates_.widths.size()));
  return jumps_ > 1 ? 2.0 * widths : widths;
}

double ExpectedSteps::from_refinement(std::size_t best) const {
  const bool all_pairs = counts_[best] * coefficients_ <= next_unknowns * cheap_unknowns;
  const Eigen::Index ridges = std::ssize(candidates_.ridges);
  const Eigen::Index shrinkages = std::ssize(candidates_.shrinkages);
  // Mostly with the sums of the last round.
  const double pairs = on_folds(0, screening_, best, best + 1, all_pairs ? ridges * shrinkages : 3 + shrinkages, false);
  const double neighbours = all_pairs ? on_folds(0, screening_, best, best + 1, candidates_at_last, false) : 0.0;
  return finalists(best) * (pairs + neighbours) + on_other_folds(best);
}

double ExpectedSteps::on_other_folds(std::size_t best) const {
  const std::size_t begin = best > 0 ? best - 1 : 0;
  const std::size_t end = std::min(counts_.size(), best + 2);
  return finalists(best) * on_folds(screening_, folds_.size(), begin, end, candidates_at_last);
}

// Position after the last leaf count with at most `unknowns` unknowns; all if that is none but the last.
std::size_t ExpectedSteps::end_of_round(Eigen::Index unknowns) const {
  return std::ranges::upper_bound(counts_, unknowns / coefficients_) - counts_.begin();
}

double ExpectedSteps::of_shape(const FoldRows& fold, double width, std::size_t begin, std::size_t end,
                               Eigen::Index regularisations, bool sums) const {
  const Eigen::Index largest = counts_[end - 1];
  const Eigen::Index rows = std::min(fold.training.count(), enough_rows(largest, coefficients_));
  double sum = sums ? operations_of_sums(rows, largest, coefficients_, width) : 0.0;
  for (std::size_t count = begin; count < end; ++count) {
    sum += operations_of_solutions(counts_[count], coefficients_, regularisations);
    sum += static_cast<double>(regularisations) * operations_of_pass(fold.held_out.count(), counts_[count], width);
  }
  return sum;
}

// One shape of middle width.
double ExpectedSteps::on_folds(std::size_t first, std::size_t last, std::size_t begin, std::size_t end,
                               Eigen::Index regularisations, bool sums) const {
  double sum = 0.0;
  for (std::size_t fold = first; fold < last; ++fold) {
    sum += of_shape(folds_[fold], middle_width(), begin, end, regularisations, sums);
  }
  return sum;
}

std::vector<Eigen::Index> compared_leaf_counts(Eigen::Index largest) {
  std::vector<Eigen::Index> counts;
  for (Eigen::Index count = largest; count > 1; count = std::min(count - 1, (count * 2 + 1) / 3)) {
    counts.push_back(count);
  }
  std::ranges::reverse(counts);
  return counts;
}

std::size_t screening_folds(const std::vector<FoldRows>& folds) {
  std::size_t screening = 0;
  for (Eigen::Index rows = 0; screening < folds.size() && rows < screening_rows; ++screening) {
    rows += folds[screening].held_out.count();
  }
  return screening;
}

double operations_of_crisp(const std::vector<FoldRows>& folds, Eigen::Index coefficients, Eigen::Index leaves) {
  double sum = 0.0;
  for (const FoldRows& fold : folds) sum += operations_of_sums(fold.training.count(), leaves, coefficients, 0.0);
  return sum;
}

double operations_of_selection(const std::vector<FoldRows>& folds, Eigen::Index coefficients,
                               const Candidates& candidates, Eigen::Index leaves) {
  if (folds.empty()) return 0.0;
  const ExpectedSteps steps(folds, coefficients, candidates, compared_leaf_counts(leaves),
                            std::min(usual_jumps, candidates.jumps.size()));
  return operations_of_crisp(folds, coefficients, leaves) + steps.in_all() + steps.on_all_rows();
}

}  // namespace llmt
