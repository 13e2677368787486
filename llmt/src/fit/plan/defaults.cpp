#include "fit/plan/defaults.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <map>
#include <stdexcept>

namespace llmt {
namespace {

// The facts that a default depends on. In the tables below the first row counts whose case holds.
struct Case {
  bool folds = false;        // something is chosen on held-out rows
  bool one_fold = false;     // many rows, held out once: the widest transitions and some ridges would take most time
  bool overlapping = false;  // leaves that overlap are candidates, and held-out rows decide
  bool ordered = false;      // inputs in which the prediction is monotone may be split: estimates are costly
  bool own_models = false;   // the rule's local models are not estimated anew
  bool weakest_link = false;
  ValidityKind kind = ValidityKind::crisp;  // of the leaves that overlap
};

struct Row {
  bool (*holds)(const Case&);
  const char* when;  // in words; empty: else
  std::vector<double> values;
};

using Rows = std::vector<Row>;

bool always(const Case&) { return true; }

bool is_ordered(const Case& each) { return each.ordered; }

const Rows& width_rows() {
  static const Rows rows = {
      // Transitions on monotone inputs that overlap share the room that the slopes leave them.
      {is_ordered, "if monotone inputs may be split", {0.25, 0.5, 1.0}},
      {[](const Case& each) { return each.kind == ValidityKind::gaussian; }, "for Gaussians", {1.0 / 3.0}},
      {[](const Case& each) { return each.kind == ValidityKind::logistic; },
       "for the gates of hilomot",
       {1.0, 2.0, 4.0}},
      {[](const Case& each) { return each.one_fold; }, "from 50000 rows on", {0.5, 1.0, 2.0}},
      {always, "", {0.5, 1.0, 2.0, 4.0}}};
  return rows;
}

const Rows& jump_rows() {
  static const Rows rows = {
      {[](const Case& each) { return !each.folds; }, "without folds", {no_jump}},
      {is_ordered, "if monotone inputs may be split", {no_jump, 1.0}},
      {[](const Case& each) { return each.kind != ValidityKind::blend; }, "for Gaussians and hilomot", {no_jump}},
      {always, "", {no_jump, 4.0, 2.0, 1.0, 0.5}}};
  return rows;
}

const Rows& ridge_rows() {
  static const Rows rows = {
      {is_ordered, "if monotone inputs may be split", {1e-6, 1e-3}},
      {[](const Case& each) { return each.one_fold; }, "from 50000 rows on", {1e-8, 1e-6, 1e-4, 1e-2}},
      {always, "", {1e-8, 1e-6, 1e-4, 1e-3, 1e-2, 1e-1}}};
  return rows;
}

const Rows& shrinkage_rows() {
  static const Rows rows = {
      {[](const Case& each) { return !each.folds || each.own_models; }, "without folds or with m5", {0.0}},
      {is_ordered, "if monotone inputs may be split", {0.1}},
      {always, "", {0.0, 0.1, 1.0}}};
  return rows;
}

const Rows& significance_rows() {
  static const Rows rows = {
      // The held-out error decides how many leaves stay, and a joint estimate bears many more than a crisp tree.
      {[](const Case& each) { return each.overlapping; }, "where blends or Gaussians are candidates", {1.0}},
      // A split may lower the error little before those below it lower it much.
      {[](const Case& each) { return each.folds && each.weakest_link; }, "with --prune and folds", {1.0}},
      {always, "", {0.05}}};
  return rows;
}

const std::vector<double>& values_of(const Rows& rows, const Case& each) {
  return std::ranges::find_if(rows, [&](const Row& row) { return row.holds(each); })->values;
}

// "1e-6,0.001".
std::string list_of(const std::vector<double>& values) {
  std::vector<std::string> texts;
  for (const double value : values) {
    std::string& text = texts.emplace_back(fmt::format("{:.3g}", value));
    if (const std::size_t zero = text.find("e-0"); zero != std::string::npos) text.erase(zero + 2, 1);
  }
  return fmt::format("{}", fmt::join(texts, ","));
}

// "1 in that case; else 0.05".
std::string text_of(const Rows& rows) {
  std::string text;
  for (const Row& row : rows) {
    const std::string values = list_of(row.values);
    text += row.when[0] != '\0' ? fmt::format("{} {}; ", values, row.when) : fmt::format("else {}", values);
  }
  return text;
}

// Coefficients that a tree whose leaves overlap may have: joint estimates cost the square of their number.
constexpr Eigen::Index most_coefficients = 1500;
constexpr Eigen::Index fewest_of_most_leaves = 20;
// But never more coefficients than this, or the matrix of a joint estimate takes more than 300 MB.
constexpr Eigen::Index most_joint_coefficients = 6000;
constexpr Eigen::Index most_overlapping_leaves = 400;

// Leaves on the two sides of splits on monotone inputs are compared in pairs.
constexpr Eigen::Index most_ordered_leaves = 30;

// A crisp tree that is grown without a test, to be pruned, has at most this many leaves; many rows would make it huge.
constexpr Eigen::Index most_pruned_leaves = 1000;

// Rows in a leaf that overlaps others: a joint estimate has those of its neighbours too.
constexpr Eigen::Index fewest_rows_of_overlapping = 5;

Eigen::Index default_max_leaves(const Case& each, const Rule& rule, Eigen::Index coefficients) {
  if (rule.most_leaves > 0 && !rule.most_leaves_without_folds) return rule.most_leaves;
  if (each.overlapping || each.ordered) {
    const Eigen::Index fewest =
        std::clamp<Eigen::Index>(most_joint_coefficients / coefficients, 2, fewest_of_most_leaves);
    return std::clamp<Eigen::Index>(most_coefficients / coefficients, fewest,
                                    each.ordered ? most_ordered_leaves : most_overlapping_leaves);
  }
  if (each.folds && each.weakest_link && rule.grows_larger_to_be_pruned) return most_pruned_leaves;
  return rule.most_leaves;
}

Eigen::Index default_min_leaf(const Case& each, const Rule& rule, Eigen::Index coefficients) {
  if (rule.fewest_rows > 0) return rule.fewest_rows;
  return each.overlapping ? std::max(fewest_rows_of_overlapping, coefficients - 1) : 2 * coefficients;
}

std::string max_leaves_text() {
  std::string text;
  for (const Rule& rule : rule_table()) {
    if (rule.most_leaves > 0 && !rule.most_leaves_without_folds) {
      text += fmt::format("{} with {}; ", rule.most_leaves, rule.name);
    }
  }
  text += fmt::format(
      "{} / coefficients of a local model, within {} ... {}, where blends or Gaussians are candidates, and no more "
      "than "
      "{} coefficients in all; the same within {} ... {} if monotone inputs may be split; {} with --prune and folds; ",
      most_coefficients, fewest_of_most_leaves, most_overlapping_leaves, most_joint_coefficients, fewest_of_most_leaves,
      most_ordered_leaves, most_pruned_leaves);
  for (const Rule& rule : rule_table()) {
    if (rule.most_leaves_without_folds) text += fmt::format("{} with {} without folds; ", rule.most_leaves, rule.name);
  }
  return text + "else no limit";
}

std::string min_leaf_text() {
  std::string text;
  for (const Rule& rule : rule_table()) {
    if (rule.fewest_rows > 0) text += fmt::format("{} with {}; ", rule.fewest_rows, rule.name);
  }
  return text + fmt::format(
                    "number of regressors, at least {}, where blends or Gaussians are candidates; "
                    "else twice the coefficients of a local model",
                    fewest_rows_of_overlapping);
}

// Whether an input in which the prediction is to be monotone may be split.
bool may_split_monotone(const Table& table) {
  return std::ranges::any_of(table.split_inputs,
                             [&](int input) { return !table.monotone.empty() && table.monotone[input] != 0; });
}

std::vector<double> given_or(const std::vector<double>& given, const Rows& rows, const Case& each) {
  return given.empty() ? values_of(rows, each) : given;
}

// The validity that is asked for, where the rule leaves a choice.
ValidityChoice choice_of(const FitOptions& options, const Rule& rule) {
  if (rule.overlapping == ValidityKind::gaussian) return ValidityChoice::gaussian;
  if (rule.overlapping == ValidityKind::crisp) return ValidityChoice::crisp;
  return options.validity;
}

// Shrinkages of one linear model, in parts of the number of rows: ridge regression, from hardly to mostly drawn to 0.
constexpr std::array linear_shrinkages = {0.003, 0.01, 0.03, 0.1, 0.3, 1.0, 3.0};

Candidates candidates_of(const FitOptions& options, const Case& each, ValidityChoice choice, bool crisp_only,
                         Eigen::Index rows) {
  const ExpertOptions& expert = options.expert;
  Candidates candidates;
  candidates.crisp = choice == ValidityChoice::automatic || choice == ValidityChoice::crisp;
  candidates.kind = each.kind;
  candidates.estimation = expert.estimation;
  candidates.shrinkages = given_or(expert.shrinkages, shrinkage_rows(), each);
  if (options.sparse == SparseChoice::always) candidates.sparse = {true};
  if (options.sparse == SparseChoice::automatic && each.folds) candidates.sparse = {false, true};
  if (each.folds && !each.own_models && !each.ordered && options.max_leaves != 1) {
    for (const double part : linear_shrinkages) {
      candidates.linear_shrinkages.push_back(part * static_cast<double>(rows));
    }
  }
  if (crisp_only) return candidates;
  candidates.widths = given_or(expert.widths, width_rows(), each);
  // hilomot makes a jump a steep gate by itself.
  const bool gates = each.kind == ValidityKind::logistic;
  candidates.jumps = gates ? values_of(jump_rows(), each) : given_or(expert.jumps, jump_rows(), each);
  if (expert.estimation == Estimation::joint) candidates.ridges = given_or(expert.ridges, ridge_rows(), each);
  return candidates;
}

}  // namespace

Plan with_defaults(const FitOptions& options, const TrainingRows& all, Eigen::Index folds) {
  const Rule& rule = rule_of(options.rule);
  const ValidityChoice choice = choice_of(options, rule);
  const bool logistic = rule.overlapping == ValidityKind::logistic;
  const bool crisp_only =
      choice == ValidityChoice::crisp || (choice == ValidityChoice::automatic && folds == 0 && !logistic);
  const Case each{.folds = folds > 0,
                  .one_fold = folds == 1 && all.table->inputs.rows() >= single_hold_out_rows,
                  .overlapping = !crisp_only && folds > 0,
                  .ordered = may_split_monotone(*all.table),
                  .own_models = rule.has_own_models,
                  .weakest_link = options.pruning == Pruning::weakest_link,
                  .kind = choice == ValidityChoice::gaussian ? ValidityKind::gaussian
                          : logistic                         ? ValidityKind::logistic
                                                             : ValidityKind::blend};
  const Eigen::Index coefficients = std::ssize(all.regressors) + 1;
  const auto or_default = [](Eigen::Index given, Eigen::Index standard) { return given > 0 ? given : standard; };
  return {
      .rule = &rule,
      .growth = {.significance =
                     options.significance >= 0.0 ? options.significance : values_of(significance_rows(), each).front(),
                 .min_leaf_samples = or_default(options.min_leaf_samples, default_min_leaf(each, rule, coefficients)),
                 .max_leaves = or_default(options.max_leaves, default_max_leaves(each, rule, coefficients)),
                 .split_inputs = all.split_inputs,
                 .search = options.expert.search},
      .candidates = candidates_of(options, each, choice, crisp_only, all.count()),
      .pruning = options.pruning,
      .leaves_given = options.max_leaves > 0};
}

std::string default_text(std::string_view option) {
  static const std::map<std::string, std::string, std::less<>> texts = {{"max_leaves", max_leaves_text()},
                                                                        {"min_leaf_samples", min_leaf_text()},
                                                                        {"significance", text_of(significance_rows())},
                                                                        {"widths", text_of(width_rows())},
                                                                        {"jumps", text_of(jump_rows())},
                                                                        {"ridges", text_of(ridge_rows())},
                                                                        {"shrinkages", text_of(shrinkage_rows())}};
  const auto found = texts.find(option);
  if (found == texts.end()) {
    throw std::invalid_argument(fmt::format("llmt::default_text: {} has no default that depends on the data", option));
  }
  return found->second;
}

}  // namespace llmt
