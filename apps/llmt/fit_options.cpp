#include "llmt/fit_options.hpp"

#include <fmt/format.h>

#include <map>
#include <string>

namespace llmt::apps {
namespace {

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
  command
      .add_option("--significance", options.significance,
                  "rd, ra: of the F test, over all candidate splits; 1: no test")
      ->check(CLI::NonNegativeNumber)
      ->option_text(fmt::format("FLOAT [{}]", default_text("significance")));
  command
      .add_option("--min-improvement", options.expert.min_improvement,
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
  command
      .add_option(
          "--width", expert.widths,
          "Widths to choose from: of a transition by the smaller child's extent; k_sigma; of the gates of hilomot")
      ->delimiter(',')
      ->option_text(fmt::format("FLOAT,... [{}]", default_text("widths")));
  command
      .add_option("--jump", expert.jumps,
                  "Jumps to choose from: a split where the output jumps by this many "
                  "standard deviations has no transition")
      ->delimiter(',')
      ->option_text(fmt::format("FLOAT,... [{}]", default_text("jumps")));
  command.add_option("--ridge", expert.ridges, "Ridges to choose from: hold of the joint estimate at the local one")
      ->delimiter(',')
      ->option_text(fmt::format("FLOAT,... [{}]", default_text("ridges")));
  command
      .add_option("--shrinkage", expert.shrinkages, "Shrinkages to choose from: towards the parent's model, in rows")
      ->delimiter(',')
      ->option_text(fmt::format("FLOAT,... [{}]", default_text("shrinkages")));
}

}  // namespace

void add_fit_options(CLI::App& command, FitOptions& options) {
  add_growth(command, options);
  add_local_models(command, options);
  add_candidates(command, options.expert);
}

}  // namespace llmt::apps
