/// \file
/// The options of a fit as a list of fields, for everything that reads, writes, keeps or refuses them: programs,
/// bindings, states of a distributed fit, streams and sums of trees. An option is added by a member of FitOptions and
/// its entry in for_each_field() below; without the entry, or with a part of it missing, nothing compiles.
///
///     const llmt::FitOptions defaults;
///     llmt::for_each_field(defaults, [](const llmt::OptionField& field, const auto&) {
///       std::printf("%s\n", field.name.data());  // "max_leaves"
///     });
#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <cstdint>
#include <limits>
#include <stdexcept>
#include <string>
#include <string_view>
#include <type_traits>
#include <vector>

#include "llmt/abi.hpp"
#include "llmt/options.hpp"

namespace llmt {

/// Numbers from `low` to `high`, both included. NaN is in no range.
struct NumberRange {
  double low;
  double high;
  const char* words;  ///< "a number from 0 to 1"
};

inline constexpr double largest_number = std::numeric_limits<double>::max();
inline constexpr double smallest_number = std::numeric_limits<double>::denorm_min();
inline constexpr NumberRange any_share = {0.0, 1.0, "a number from 0 to 1"};
inline constexpr NumberRange share_set_aside = {0.0, 0.9, "a number from 0 to 0.9"};
inline constexpr NumberRange not_negative = {0.0, largest_number, "a finite number, 0 or more"};
inline constexpr NumberRange above_zero = {smallest_number, largest_number, "a finite number above 0"};
inline constexpr NumberRange threshold_or_inf = {0.0, std::numeric_limits<double>::infinity(),
                                                 "a number of 0 or more, or inf"};
inline constexpr NumberRange no_number = {0.0, 0.0, ""};  ///< of options that are no numbers
inline constexpr NumberRange whole_number = {0.0, largest_number, "a whole number, 0 or more"};
inline constexpr NumberRange number_of_threads = {0.0, 4096.0, "a whole number from 0 to 4096"};

/// The treatment of an option by a way of fitting other than fit(). It has to be said for every option.
class Use {
 public:
  /// The option has the meaning that it has in fit().
  static constexpr Use taken() { return {Kind::taken, "", ""}; }
  /// Taken, but for one of its choices. `instead`: what to do.
  static constexpr Use taken_but(std::string_view choice, std::string_view instead) {
    return {Kind::taken, choice, instead};
  }
  /// The option may have any value: the result does not depend on it, and it is not kept.
  static constexpr Use without_effect() { return {Kind::without_effect, "", ""}; }
  /// Only the default is accepted. `instead`: what to do with another value; empty: nothing is said.
  static constexpr Use refused(std::string_view instead = "") { return {Kind::refused, "", instead}; }

  constexpr bool is_taken() const { return kind_ == Kind::taken; }
  constexpr bool is_refused() const { return kind_ == Kind::refused; }
  /// The choice that is refused although others are taken; empty: none.
  constexpr std::string_view refused_choice() const { return choice_; }
  constexpr std::string_view instead() const { return instead_; }

 private:
  enum class Kind { taken, without_effect, refused };
  constexpr Use(Kind kind, std::string_view choice, std::string_view instead)
      : kind_(kind), choice_(choice), instead_(instead) {}

  Kind kind_;
  std::string_view choice_;
  std::string_view instead_;
};

/// The part of the programs' help in which an option is listed: `--help`, or only `--help-all`.
enum class Audience { everyone, experts };

/// One option of a fit.
struct OptionField {
  std::string_view name;       ///< the member of FitOptions: "max_leaves", "folds.count"
  std::string_view flag;       ///< of the programs: "--max-leaves"; of two that mean one option "--a or --b"
  std::string_view parameter;  ///< of Python's estimator; empty: it has none
  std::string_view help;       ///< one phrase; the default is added to it
  NumberRange range;           ///< of the numbers that programs take
  bool has_default_text;       ///< default_text() says its default
  Audience audience;           ///< for whom the programs' help lists it
  bool compared;               ///< `llmt compare` takes it, for all its methods
  Use beyond_memory;           ///< distributed::start()
  Use in_stream;               ///< stream_options()
  Use in_sum;                  ///< of `llmt fit --boost`
};

/// Calls visit(field, member) for every option of a fit. `Options`: FitOptions or const FitOptions.
template <class Options, class Visitor>
requires std::is_same_v<std::remove_const_t<Options>, FitOptions>
void for_each_field(Options& options, Visitor&& visit) {
  // A member without a name here does not compile. That every name is visited is checked by a test, KeptOptions.
  auto& [rule, max_leaves, min_leaf_samples, significance, split_inputs, regression_inputs, choose_inputs,
         shared_partition, pruning, validity, terms, loss, sparse, folds, trends, intervals, max_threads, expert] =
      options;
  auto& [folds_count, folds_kind, folds_seed] = folds;
  auto& [search, estimation, widths, jumps, ridges, shrinkages] = expert;
  constexpr auto in_one_memory = Use::refused("fit a sample that fits into memory");
  constexpr auto leave_out_columns = Use::refused("leave columns out of the table");
  constexpr auto everyone = Audience::everyone;
  constexpr auto experts = Audience::experts;
  constexpr auto taken = Use::taken();
  constexpr auto no = Use::refused();

  visit(OptionField{"folds.count", "--cv", "cv",
                    "Folds of the held-out error by which everything is chosen, 0: keep the tree as grown",
                    whole_number, false, everyone, true, taken, no, no},
        folds_count);
  visit(OptionField{"folds.kind", "--contiguous", "contiguous",
                    "Folds are blocks of consecutive rows (measured paths, grids, time series)", no_number, false,
                    everyone, true, taken, no, no},
        folds_kind);
  visit(OptionField{"max_leaves", "--max-leaves", "max_leaves", "Most leaves of a tree; 0: the default", whole_number,
                    true, everyone, true, taken, taken, no},
        max_leaves);
  visit(OptionField{"max_threads", "--threads", "n_jobs", "0: all; the result does not depend on it", number_of_threads,
                    false, everyone, true, Use::without_effect(), Use::without_effect(), taken},
        max_threads);
  visit(OptionField{"split_inputs", "--split-inputs", "", "Inputs that may be split [all]", no_number, false, experts,
                    true, leave_out_columns, no, no},
        split_inputs);
  visit(OptionField{"regression_inputs", "--regression-inputs", "", "Inputs of the local models [all]", no_number,
                    false, experts, true, leave_out_columns, no, no},
        regression_inputs);
  visit(OptionField{"choose_inputs", "--all-inputs", "select_features",
                    "Keep inputs that do not lower the held-out error", no_number, false, experts, true, taken,
                    Use::without_effect(), no},
        choose_inputs);
  visit(OptionField{"trends", "--monotone or --slope-sign", "monotonic_cst",
                    "Inputs with which the prediction never falls, or with a leading minus never rises (--monotone=-x)",
                    no_number, false, experts, true, in_one_memory, no, no},
        trends);
  visit(OptionField{"min_leaf_samples", "--min-leaf", "min_samples_leaf", "Fewest rows in a leaf; 0: the default",
                    whole_number, true, experts, true, taken, taken, no},
        min_leaf_samples);
  visit(OptionField{"pruning", "--prune", "",
                    "Undo the splits of the weakest branches first, not the last ones, where fewer leaves predict "
                    "better",
                    no_number, false, experts, true, taken, no, no},
        pruning);
  visit(OptionField{"folds.seed", "--seed", "random_state",
                    "Of the random folds; with --boost, of the held-out rows and of the features looked at", no_number,
                    false, experts, true, taken, Use::without_effect(), taken},
        folds_seed);
  visit(OptionField{"loss", "--loss", "loss",
                    "What is made small: squares of the residuals, or squares with rows far from a preliminary tree "
                    "left out (Tukey's biweight)",
                    no_number, false, everyone, true, Use::refused("take squares; medians over all rows are no sums"),
                    no, no},
        loss);
  visit(OptionField{"rule", "--rule", "rule", "Growth rule", no_number, false, experts, false,
                    Use::refused("take rd, or fit a sample that fits into memory"), no, no},
        rule);
  visit(
      OptionField{"significance", "--significance", "", "rd, ra: of the F test, over all candidate splits; 1: no test",
                  any_share, true, experts, false, taken, taken, no},
      significance);
  visit(OptionField{"expert.search", "--search", "",
                    "Search for splits: exact; by bins, exact in small nodes and where bins may hold a better split; "
                    "or bins for many rows",
                    no_number, false, experts, false,
                    Use::taken_but("exact", "take auto or binned; the top of the tree is searched by bins"), no, no},
        search);
  visit(OptionField{"shared_partition", "--shared", "shared_tree", "One tree for all targets instead of one each",
                    no_number, false, experts, false, taken, no, no},
        shared_partition);
  visit(OptionField{"validity", "--validity", "validity",
                    "How leaves meet: crisp at their borders, in blends over the splits, as Gaussians, or the better "
                    "of the first two",
                    no_number, false, everyone, false, Use::taken_but("gaussian", "take crisp, blend or auto"),
                    Use::taken_but("gaussian", "take crisp, blend or auto"), no},
        validity);
  visit(OptionField{"terms", "--local-models", "local_models",
                    "Local models linear, with products and squares of the inputs, or the better of the two", no_number,
                    false, everyone, false, Use::refused("take linear ones, or products as columns"), no, no},
        terms);
  visit(OptionField{"sparse", "--sparse", "sparse",
                    "Local models keep only the slopes that forward selection takes: never, always, or where the "
                    "held-out error says so",
                    no_number, false, experts, false, taken, no, no},
        sparse);
  visit(OptionField{"expert.estimation", "--estimation", "",
                    "Local models as grown, weighted by validity, or all at once", no_number, false, experts, false,
                    taken, no, no},
        estimation);
  visit(OptionField{"expert.widths", "--width", "",
                    "Widths to choose from. Of a transition of a blend, as a share of the smaller child's extent; "
                    "k_sigma of Gaussians; of the gates of hilomot",
                    above_zero, true, experts, false, taken, no, no},
        widths);
  visit(OptionField{"expert.jumps", "--jump", "",
                    "Jumps to choose from: a split where the output jumps by this many standard deviations has no "
                    "transition",
                    threshold_or_inf, true, experts, false, taken, no, no},
        jumps);
  visit(OptionField{"expert.ridges", "--ridge", "",
                    "Ridges to choose from: how firmly local models that are estimated together are held near those "
                    "that are estimated one by one",
                    not_negative, true, experts, false, taken, no, no},
        ridges);
  visit(OptionField{"expert.shrinkages", "--shrinkage", "",
                    "Shrinkages to choose from: how firmly a local model is held near that of its parent, as a number "
                    "of rows that would say the same",
                    not_negative, true, experts, false, taken, taken, no},
        shrinkages);
  visit(OptionField{"intervals", "--no-intervals", "",
                    "Leave the folds' models out of the file; it is smaller and has no prediction intervals", no_number,
                    false, experts, false, taken, no, no},
        intervals);
}

/// The entries of FitOptions, in their order.
const std::vector<OptionField>& option_fields();

/// A way of fitting that does not take every option of fit(), and how a refusal is worded.
struct WayOfFitting {
  std::string_view function;  ///< that refuses: "llmt::distributed::start"
  Use OptionField::*use;      ///< the member that says what it does with an option
  std::string_view sentence;  ///< behind the option: "is not possible beyond one memory"
};

/// The fit of distributed::start().
inline constexpr WayOfFitting beyond_memory = {"llmt::distributed::start", &OptionField::beyond_memory,
                                               "is not possible beyond one memory"};
/// The fit of a stream.
inline constexpr WayOfFitting in_stream = {"llmt::stream_options", &OptionField::in_stream, "is not for streams"};

/// An option that a way of fitting refuses. The message has the option's name as FitOptions has it; programs and
/// bindings put their own in its place.
class OptionRefused : public std::invalid_argument {
 public:
  OptionRefused(const WayOfFitting& way, std::string_view option, const std::string& rest)
      : std::invalid_argument(std::string(way.function) + ": " + std::string(option) + rest),
        option_(option),
        rest_(rest) {}

  const std::string& option() const { return option_; }  ///< its name: "rule"
  const std::string& rest() const { return rest_; }      ///< behind it: " retis is not possible beyond one memory; ..."

 private:
  std::string option_;
  std::string rest_;
};

/// True if two values of an option mean the same. No trends mean the same as trends of which each is Trend::any.
template <class Value>
bool means_the_same(const Value& one, const Value& other) {
  if constexpr (std::is_same_v<Value, std::vector<Trend>>) {
    const auto is_any = [](const Value& trends) {
      return std::ranges::all_of(trends, [](Trend trend) { return trend == Trend::any; });
    };
    return one == other || (is_any(one) && is_any(other));
  } else {
    return one == other;
  }
}

/// Throws OptionRefused for the first option whose value `way` does not take. `Options`: as for_each_field() has them,
/// with defaults that are those of `Options{}`.
template <class Options>
void require_taken(const Options& options, const WayOfFitting& way) {
  const Options defaults{};
  for_each_field(options, [&](const auto& field, const auto& value) {
    const Use& use = field.*way.use;
    std::string choice;
    if constexpr (std::is_enum_v<std::remove_cvref_t<decltype(value)>>) choice = name_of(value);
    bool refused = !choice.empty() && choice == use.refused_choice();
    if (use.is_refused()) {
      for_each_field(defaults, [&](const auto& other, const auto& by_default) {
        if constexpr (std::is_same_v<decltype(by_default), decltype(value)>) {
          if (other.name == field.name) refused = !means_the_same(value, by_default);
        }
      });
    }
    if (!refused) return;
    const std::string instead = use.instead().empty() ? "" : "; " + std::string(use.instead());
    throw OptionRefused(way, field.name,
                        (choice.empty() ? "" : " " + choice) + " " + std::string(way.sentence) + instead);
  });
}

}  // namespace llmt
