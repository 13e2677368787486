#include <array>

#include "llmt/option_fields.hpp"
#include "llmt/summary.hpp"

namespace llmt {
namespace {

// The names are those of the command line and of its JSON, and stay.
constexpr std::array<Choice<ValidityChoice>, 4> validity_choices = {{{ValidityChoice::automatic, "auto"},
                                                                     {ValidityChoice::crisp, "crisp"},
                                                                     {ValidityChoice::blend, "blend"},
                                                                     {ValidityChoice::gaussian, "gaussian"}}};
constexpr std::array<Choice<LocalTerms>, 3> terms = {
    {{LocalTerms::linear, "linear"}, {LocalTerms::quadratic, "quadratic"}, {LocalTerms::automatic, "auto"}}};
constexpr std::array<Choice<SparseChoice>, 3> sparse_choices = {
    {{SparseChoice::never, "never"}, {SparseChoice::automatic, "auto"}, {SparseChoice::always, "always"}}};
constexpr std::array<Choice<SplitSearch>, 3> searches = {
    {{SplitSearch::automatic, "auto"}, {SplitSearch::exact, "exact"}, {SplitSearch::binned, "binned"}}};
constexpr std::array<Choice<Estimation>, 3> estimations = {
    {{Estimation::as_grown, "as-grown"}, {Estimation::local, "local"}, {Estimation::joint, "joint"}}};
constexpr std::array<Choice<Loss>, 2> losses = {{{Loss::squared, "squared"}, {Loss::tukey, "tukey"}}};
constexpr std::array<Choice<Pruning>, 2> prunings = {
    {{Pruning::last_splits, "last-splits"}, {Pruning::weakest_link, "weakest-link"}}};
constexpr std::array<Choice<FoldKind>, 2> fold_kinds = {
    {{FoldKind::random, "random"}, {FoldKind::contiguous, "contiguous"}}};
constexpr std::array<Choice<Trend>, 5> trend_choices = {{{Trend::any, "any"},
                                                         {Trend::rising_slopes, "rising-slopes"},
                                                         {Trend::falling_slopes, "falling-slopes"},
                                                         {Trend::rising, "rising"},
                                                         {Trend::falling, "falling"}}};

}  // namespace

template <>
std::span<const Choice<ValidityChoice>> choices() {
  return validity_choices;
}

template <>
std::span<const Choice<LocalTerms>> choices() {
  return terms;
}

template <>
std::span<const Choice<SparseChoice>> choices() {
  return sparse_choices;
}

template <>
std::span<const Choice<SplitSearch>> choices() {
  return searches;
}

template <>
std::span<const Choice<Estimation>> choices() {
  return estimations;
}

template <>
std::span<const Choice<Loss>> choices() {
  return losses;
}

template <>
std::span<const Choice<Pruning>> choices() {
  return prunings;
}

template <>
std::span<const Choice<FoldKind>> choices() {
  return fold_kinds;
}

template <>
std::span<const Choice<Trend>> choices() {
  return trend_choices;
}

const std::vector<OptionField>& option_fields() {
  static const std::vector<OptionField> fields = [] {
    std::vector<OptionField> list;
    const FitOptions options;
    for_each_field(options, [&](const OptionField& field, const auto&) { list.push_back(field); });
    return list;
  }();
  return fields;
}

std::string describe(StopReason reason) {
  switch (reason) {
    case StopReason::max_leaves:
      return "the leaf limit";
    case StopReason::significance:
      return "the significance test";
    case StopReason::variance_gain:
      return "the variance gain";
    case StopReason::leaf_samples:
      return "the smallest leaf size";
    case StopReason::exact_fit:
      return "an exact fit";
    case StopReason::aicc:
      return "AICc";
    case StopReason::pruning:
      return "pruning";
    case StopReason::cross_validation:
      return "cross-validation";
  }
  return "";
}

}  // namespace llmt
