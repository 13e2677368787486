#include "trees/fit_options.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <stdexcept>

#include "llmt/names.hpp"
#include "report/table/named_inputs.hpp"
#include "shared/help.hpp"

namespace llmt::apps {
namespace {

// An option of `llmt fit` that is no field of FitOptions, and the forms that take it beside one tree in memory.
struct OtherOption {
  std::string_view name;
  std::string_view forms;
};

constexpr OtherOption other_options[] = {{"help", "stream boost files"},
                                         {"help-all", "stream boost files"},
                                         {"data", "stream boost files"},
                                         {"target", "stream boost files"},
                                         {"inputs", "stream boost files"},
                                         {"ignore", "stream boost files"},
                                         {"weight", "stream boost files"},
                                         {"decimal-comma", "stream boost files"},
                                         {"thousands", "stream boost files"},
                                         {"output", "stream boost files"},
                                         {"json", "stream boost files"},
                                         {"stream", "stream"},
                                         {"boost", "boost"},
                                         {"categorical", "boost"},
                                         {"groups", "boost"},
                                         {"seeds", "boost"},
                                         {"max-rounds", "boost"},
                                         {"time-limit", "boost"},
                                         {"no-codes", "files"},
                                         {"more", "files"},
                                         {"memory", "files"},
                                         {"checkpoint", "files"},
                                         {"resume", "files"},
                                         {"patience", "files"},
                                         {"lags", ""},
                                         {"time", ""},
                                         {"for", ""},
                                         {"grid", ""},
                                         {"delay", ""},
                                         {"accept-unstable", ""},
                                         {"readable", ""},
                                         {"readable-rules", ""},
                                         {"teach", ""},
                                         {"plot", ""},
                                         {"report", ""}};

// Whether `flags`, "--a or --b", has an option of this name.
bool has_flag(std::string_view flags, std::string_view name) {
  for (std::size_t at = flags.find(name); at != std::string_view::npos; at = flags.find(name, at + 1)) {
    const std::size_t end = at + name.size();
    if (at >= 2 && flags.substr(at - 2, 2) == "--" && (end == flags.size() || flags[end] == ' ')) return true;
  }
  return false;
}

const OptionField* field_of(std::string_view name) {
  for (const OptionField& field : option_fields()) {
    if (has_flag(field.flag, name)) return &field;
  }
  return nullptr;
}

const OtherOption* other_option(std::string_view name) {
  const auto found = std::ranges::find(other_options, name, &OtherOption::name);
  return found == std::end(other_options) ? nullptr : &*found;
}

std::vector<std::string> named_columns(const NamedColumns& named, std::string_view option) {
  const auto found = named.find(option);
  return found == named.end() ? std::vector<std::string>() : found->second;
}

std::vector<Trend> trends_of(const NamedColumns& named, const std::vector<std::string>& inputs,
                             const std::vector<std::vector<std::string>>& levels) {
  const std::vector<int> monotone = report::signs_of("--monotone", named_columns(named, "--monotone"), inputs);
  const std::vector<int> slopes = report::signs_of("--slope-sign", named_columns(named, "--slope-sign"), inputs);
  if (monotone.empty() && slopes.empty()) return {};
  std::vector<Trend> trends(inputs.size(), Trend::any);
  for (std::size_t j = 0; j < inputs.size(); ++j) {
    const int of_prediction = monotone.empty() ? 0 : monotone[j];
    const int of_slopes = slopes.empty() ? 0 : slopes[j];
    if ((of_prediction != 0 || of_slopes != 0) && !levels[j].empty()) {
      throw std::invalid_argument(fmt::format("{} names \"{}\", which is categorical",
                                              of_prediction != 0 ? "--monotone" : "--slope-sign", inputs[j]));
    }
    if (of_prediction * of_slopes < 0) {
      throw std::invalid_argument(
          fmt::format("--monotone and --slope-sign name \"{}\" with opposite signs", inputs[j]));
    }
    if (of_slopes != 0) trends[j] = of_slopes > 0 ? Trend::rising_slopes : Trend::falling_slopes;
    if (of_prediction != 0) trends[j] = of_prediction > 0 ? Trend::rising : Trend::falling;
  }
  return trends;
}

// "Growth rule: rd (best split by F test), ...".
std::string rules_text() {
  std::string text;
  for (const Choice<GrowthRule>& choice : choices<GrowthRule>()) {
    text += fmt::format("{}{} ({})", text.empty() ? ": " : ", ", choice.name, summary_of(choice.value));
  }
  return text;
}

}  // namespace

std::string FieldOptions::help(const OptionField& field) {
  std::string text(field.help);
  if (field.name == "rule") text += rules_text();
  return text;
}

void FieldOptions::finish(const OptionField& field, CLI::Option* option) {
  // A long one is shown by --help-all alone.
  if (field.has_default_text) option->default_str(default_text(field.name.substr(field.name.find('.') + 1)));
  if (field.audience == Audience::experts) option->group(expert_options);
}

void FieldOptions::add_flag(const OptionField& field, const std::function<void()>& set) const {
  finish(field, command_.add_flag_callback(flag(field), set, help(field)));
}

void FieldOptions::add_columns(const OptionField& field, const std::string& name, const std::string& help) const {
  finish(field, add_names(command_, name, columns_[name], "COLUMN", help));
}

void FieldOptions::add_names_of_choice(const OptionField& field, const std::vector<std::string>& names,
                                       std::string_view by_default,
                                       const std::function<void(std::size_t)>& take) const {
  const auto read = [name = flag(field), names, take](const CLI::results_t& texts) {
    const auto found = std::ranges::find(names, texts.back());
    if (found == names.end()) {
      throw std::invalid_argument(fmt::format("{} is \"{}\"{}, it must be one of {}", name, texts.back(),
                                              did_you_mean(texts.back(), names), fmt::join(names, ", ")));
    }
    take(found - names.begin());
    return true;
  };
  const std::string type = fmt::format("{}", fmt::join(names, "|"));
  finish(field,
         add_text(command_, flag(field), type.c_str(), read, fmt::format("{} [{}]", help(field), by_default), {}));
}

void set_columns(const NamedColumns& named, const std::vector<std::string>& inputs,
                 const std::vector<std::vector<std::string>>& levels, FitOptions& options) {
  for_each_field(options, [&](const OptionField& field, auto& value) {
    using Value = std::remove_cvref_t<decltype(value)>;
    if constexpr (std::same_as<Value, std::vector<int>>) {
      value = report::positions_of(std::string(field.flag), named_columns(named, field.flag), inputs);
    } else if constexpr (std::same_as<Value, std::vector<Trend>>) {
      value = trends_of(named, inputs, levels);
    }
  });
}

void refuse_options(const CLI::App& command, const FormOfFit& form) {
  for (const CLI::Option* option : command.get_options()) {
    if (option->count() == 0) continue;
    const std::string name = option->get_single_name();
    const OptionField* field = field_of(name);
    const OtherOption* other = other_option(name);
    const bool is_refused = field != nullptr
                                ? form.use != nullptr && (field->*form.use).is_refused()
                                : other == nullptr || other->forms.find(form.name) == std::string_view::npos;
    if (is_refused) throw std::invalid_argument(fmt::format("--{} {}", name, form.sentence));
  }
}

std::vector<SettingName> setting_names() {
  std::vector<SettingName> names;
  for (const OptionField& field : option_fields()) {
    if (field.name == "intervals") continue;  // a word of messages, none of which means the option
    names.push_back({field.name, field.flag});
  }
  return names;
}

void require_forms(const CLI::App& command) {
  for (const CLI::Option* option : command.get_options()) {
    const std::string name = option->get_single_name();
    if (field_of(name) == nullptr && other_option(name) == nullptr) {
      throw std::logic_error(fmt::format("option --{} has no entry that says which forms of fit take it", name));
    }
  }
}

}  // namespace llmt::apps
