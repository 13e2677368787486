#include "trees/fit_options.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <limits>
#include <stdexcept>
#include <string>
#include <vector>

#include "llmt/names.hpp"
#include "shared/help.hpp"
#include "shared/options.hpp"

namespace llmt::apps {
namespace {

constexpr NumberRange threshold_or_inf = {0.0, std::numeric_limits<double>::infinity(),
                                          "a number of 0 or more, or inf"};

// One of the names of a choice, its default at the end of its help.
template <class Enum>
CLI::Option* add_choice(CLI::App& command, const std::string& name, Enum& value, const std::string& help) {
  const auto take = [name, &value](const CLI::results_t& texts) {
    std::vector<std::string> names;
    for (const Choice<Enum>& choice : choices<Enum>()) {
      names.emplace_back(choice.name);
      if (choice.name == texts.back()) value = choice.value;
    }
    if (std::ranges::find(names, texts.back()) != names.end()) return true;
    throw std::invalid_argument(fmt::format("{} is \"{}\"{}, it must be one of {}", name, texts.back(),
                                            did_you_mean(texts.back(), names), list_names<Enum>()));
  };
  const std::string type = list_names<Enum>("|");
  return add_text(command, name, type.c_str(), take, fmt::format("{} [{}]", help, name_of(value)), {});
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
  const auto expert = [](CLI::Option* option) { option->group(expert_options); };
  expert(add_choice(command, "--rule", options.rule, rules_text()));
  expert(add_number(
      command, "--significance", options.significance, any_share,
      fmt::format("rd, ra: of the F test, over all candidate splits; 1: no test [{}]", default_text("significance"))));
  expert(add_choice(command, "--search", options.expert.search,
                    "Search for splits: exact; by bins, exact in small nodes and where bins may hold a better split; "
                    "or bins for many rows"));
  expert(command.add_flag("--shared", options.shared_partition, "One tree for all targets instead of one each"));
}

void add_local_models(CLI::App& command, FitOptions& options) {
  add_choice(command, "--validity", options.validity,
             "How leaves meet: crisp at their borders, in blends over the splits, as Gaussians, or the better of the "
             "first two");
  add_choice(command, "--local-models", options.terms,
             "Local models linear, with products and squares of the inputs, or the better of the two");
  add_loss(command, options.loss);
  add_choice(command, "--sparse", options.sparse,
             "Local models keep only the slopes that forward selection takes: never, always, or where the held-out "
             "error says so")
      ->group(expert_options);
  add_choice(command, "--estimation", options.expert.estimation,
             "Local models as grown, weighted by validity, or all at once")
      ->group(expert_options);
}

// Lists, of which the held-out error chooses an entry.
void add_candidates(CLI::App& command, ExpertOptions& expert) {
  const auto add = [&](const char* name, std::vector<double>& values, const NumberRange& range, const char* help,
                       std::string_view defaults) {
    add_numbers(command, name, values, range, fmt::format("{} [{}]", help, default_text(defaults)))
        ->group(expert_options);
  };
  add("--width", expert.widths, above_zero,
      "Widths to choose from. Of a transition of a blend, as a share of the smaller child's extent; k_sigma of "
      "Gaussians; of the gates of hilomot",
      "widths");
  add("--jump", expert.jumps, threshold_or_inf,
      "Jumps to choose from: a split where the output jumps by this many standard deviations has no transition",
      "jumps");
  add("--ridge", expert.ridges, not_negative,
      "Ridges to choose from: how firmly local models that are estimated together are held near those that are "
      "estimated one by one",
      "ridges");
  add("--shrinkage", expert.shrinkages, not_negative,
      "Shrinkages to choose from: how firmly a local model is held near that of its parent, as a number of rows that "
      "would say the same",
      "shrinkages");
}

}  // namespace

void add_loss(CLI::App& command, Loss& loss) {
  add_choice(command, "--loss", loss,
             "What is made small: squares of the residuals, or squares with rows far from a preliminary tree left "
             "out (Tukey's biweight)");
}

void add_fit_options(CLI::App& command, FitOptions& options) {
  add_growth(command, options);
  add_local_models(command, options);
  add_candidates(command, options.expert);
}

}  // namespace llmt::apps
