#include "llmt/fit_options.hpp"

#include <fmt/format.h>

#include <limits>
#include <map>
#include <string>

#include "shared/options.hpp"

namespace llmt::apps {
namespace {

constexpr NumberRange below_one = {0.0, 1.0 - std::numeric_limits<double>::epsilon(), "a number from 0 to below 1"};
constexpr NumberRange threshold_or_inf = {0.0, std::numeric_limits<double>::infinity(),
                                          "a number of 0 or more, or inf"};

template <class Enum>
CLI::CheckedTransformer choice_of() {
  std::map<std::string, Enum> values;
  for (const Choice<Enum>& choice : choices<Enum>()) {
    values.emplace(choice.name, choice.value);
  }
  return CLI::CheckedTransformer(values);
}

// "linear|quadratic|auto [linear]", with the default in brackets.
template <class Enum>
std::string choices_text(Enum standard) {
  return fmt::format("{} [{}]", list_names<Enum>("|"), name_of(standard));
}

// "Growth rule: rd (best split by F test), ...".
std::string rules_text() {
  std::string text;
  for (const Choice<GrowthRule>& choice : choices<GrowthRule>()) {
    text += fmt::format("{}{} ({})", text.empty() ? "Growth rule: " : ", ", choice.name, summary_of(choice.value));
  }
  return text;
}

void add_growth(CLI::App& command, FitOptions& options) {
  command.add_option("--rule", options.rule, rules_text())
      ->transform(choice_of<GrowthRule>())
      ->option_text(choices_text(options.rule));
  add_number(command, "--significance", options.significance, any_share,
             "rd, ra: of the F test, over all candidate splits; 1: no test")
      ->option_text(fmt::format("NUMBER [{}]", default_text("significance")));
  add_number(command, "--min-improvement", options.expert.min_improvement, below_one,
             "Stop when further splits lower the training sum of squares by less than this fraction each")
      ->capture_default_str();
  command
      .add_option("--search", options.expert.search,
                  "Search for splits: exact; by bins, exact in small nodes and where bins may hold a better split; or "
                  "bins for many rows")
      ->transform(choice_of<SplitSearch>())
      ->option_text(choices_text(options.expert.search));
  command.add_flag("--shared", options.shared_partition, "One tree for all targets instead of one each");
}

void add_local_models(CLI::App& command, FitOptions& options) {
  command
      .add_option("--loss", options.loss,
                  "What is made small: squares of the residuals, or squares with rows far from a preliminary tree left "
                  "out (Tukey's biweight)")
      ->transform(choice_of<Loss>())
      ->option_text(choices_text(options.loss));
  command
      .add_option("--local-models", options.terms,
                  "Local models linear, with products and squares of the inputs, or the better of the two")
      ->transform(choice_of<LocalTerms>())
      ->option_text(choices_text(options.terms));
  command
      .add_option(
          "--sparse", options.sparse,
          "Local models keep only the slopes that forward selection takes: never, always, or where the held-out "
          "error says so")
      ->transform(choice_of<SparseChoice>())
      ->option_text(choices_text(options.sparse));
  command
      .add_option("--validity", options.validity,
                  "Crisp leaves, blends over the splits, Gaussians, or the best of the first two")
      ->transform(choice_of<ValidityChoice>())
      ->option_text(choices_text(options.validity));
  command
      .add_option("--estimation", options.expert.estimation,
                  "Local models as grown, weighted by validity, or all at once")
      ->transform(choice_of<Estimation>())
      ->option_text(choices_text(options.expert.estimation));
}

// Lists, of which the held-out error chooses an entry.
void add_candidates(CLI::App& command, ExpertOptions& expert) {
  const auto add = [&](const char* name, std::vector<double>& values, const NumberRange& range, const char* help,
                       std::string_view defaults) {
    add_numbers(command, name, values, range, help)
        ->option_text(fmt::format("NUMBER,... [{}]", default_text(defaults)));
  };
  add("--width", expert.widths, above_zero,
      "Widths to choose from: of a transition by the smaller child's extent; k_sigma; of the gates of hilomot",
      "widths");
  add("--jump", expert.jumps, threshold_or_inf,
      "Jumps to choose from: a split where the output jumps by this many standard deviations has no transition",
      "jumps");
  add("--ridge", expert.ridges, not_negative, "Ridges to choose from: hold of the joint estimate at the local one",
      "ridges");
  add("--shrinkage", expert.shrinkages, not_negative, "Shrinkages to choose from: towards the parent's model, in rows",
      "shrinkages");
}

}  // namespace

void add_fit_options(CLI::App& command, FitOptions& options) {
  add_growth(command, options);
  add_local_models(command, options);
  add_candidates(command, options.expert);
}

}  // namespace llmt::apps
