/// \file
/// The options of a fit as options of a command, made from the fields of FitOptions (llmt/option_fields.hpp).
#pragma once

#include <CLI/CLI.hpp>
#include <concepts>
#include <functional>
#include <map>
#include <string>
#include <string_view>
#include <type_traits>
#include <vector>

#include "llmt/fit.hpp"
#include "llmt/option_fields.hpp"
#include "shared/cli.hpp"
#include "shared/options.hpp"

namespace llmt::apps {

/// Columns that options name, by the option: "--split-inputs". Their positions are known when the table is read.
using NamedColumns = std::map<std::string, std::vector<std::string>, std::less<>>;

/// Adds one option for each field: a flag for what is on or off, a number, a choice by its name, or names of columns.
class FieldOptions {
 public:
  /// `columns` takes what the user names; it must live as long as the command.
  FieldOptions(CLI::App& command, NamedColumns& columns) : command_(command), columns_(columns) {}

  template <class Value>
  void operator()(const OptionField& field, Value& value) const {
    using Columns = std::vector<int>;
    if constexpr (std::same_as<Value, bool>) {
      add_flag(field, [&value, other = !value] { value = other; });
    } else if constexpr (std::is_enum_v<Value>) {
      add_choice(field, value);
    } else if constexpr (std::same_as<Value, std::uint64_t>) {
      finish(field, add_seed(command_, value, help(field)));
    } else if constexpr (std::integral<Value>) {
      CLI::Option* option =
          field.range.high < largest_number
              ? add_count(command_, flag(field), value, Value{0}, help(field), static_cast<Value>(field.range.high))
              : add_count(command_, flag(field), value, Value{0}, help(field));
      if (!field.has_default_text) option->capture_default_str();
      finish(field, option);
    } else if constexpr (std::same_as<Value, double>) {
      finish(field, add_number(command_, flag(field), value, field.range, help(field)));
    } else if constexpr (std::same_as<Value, std::vector<double>>) {
      finish(field, add_numbers(command_, flag(field), value, field.range, help(field)));
    } else if constexpr (std::same_as<Value, Columns>) {
      add_columns(field, flag(field), help(field));
    } else {
      static_assert(std::same_as<Value, std::vector<Trend>>, "there is no program option for a field of this type");
      add_columns(field, "--monotone", help(field));
      add_columns(field, "--slope-sign",
                  "Inputs with slopes >= 0, or with a leading minus <= 0, in every local model; not across leaves");
    }
  }

 private:
  static std::string flag(const OptionField& field) { return std::string(field.flag); }
  static std::string help(const OptionField& field);
  static void finish(const OptionField& field, CLI::Option* option);
  void add_flag(const OptionField& field, const std::function<void()>& set) const;
  void add_columns(const OptionField& field, const std::string& name, const std::string& help) const;
  /// `names`: of the choices; `take` is called with the position of the one that was given.
  void add_names_of_choice(const OptionField& field, const std::vector<std::string>& names, std::string_view by_default,
                           const std::function<void(std::size_t)>& take) const;

  // A flag's name does not name a choice: it stands for the one of two that is no default.
  template <class Enum>
  void add_choice(const OptionField& field, Enum& value) const {
    constexpr bool is_switch = std::same_as<Enum, Pruning> || std::same_as<Enum, FoldKind>;
    if constexpr (is_switch) {
      add_flag(field, [&value] { value = choices<Enum>().back().value; });
    } else {
      std::vector<std::string> names;
      for (const Choice<Enum>& choice : choices<Enum>()) names.emplace_back(choice.name);
      add_names_of_choice(field, names, name_of(value),
                          [&value](std::size_t at) { value = choices<Enum>()[at].value; });
    }
  }

  CLI::App& command_;
  NamedColumns& columns_;
};

/// Adds an option to `command` for every field of `options`, or for those that `llmt compare` takes. `options` and
/// `columns` must live as long as the command.
template <class Options>
void add_fit_options(CLI::App& command, Options& options, NamedColumns& columns, bool only_compared = false) {
  const FieldOptions add(command, columns);
  for_each_field(options, [&](const auto& field, auto& value) {
    if (field.compared || !only_compared) add(field, value);
  });
}

/// Fills in the fields that are columns or trends from what the user named. `levels`: of the inputs, none for numbers.
/// Throws std::invalid_argument that names option and column.
void set_columns(const NamedColumns& named, const std::vector<std::string>& inputs,
                 const std::vector<std::vector<std::string>>& levels, FitOptions& options);

/// Forms of `llmt fit` that do not take every option.
struct FormOfFit {
  Use OptionField::*use;      ///< null: the library refuses fields of FitOptions by their values
  std::string_view name;      ///< in the list of options that are none of FitOptions
  std::string_view sentence;  ///< "is not for --stream"
};

inline constexpr FormOfFit streaming = {&OptionField::in_stream, "stream", "is not for --stream"};
inline constexpr FormOfFit boosting = {&OptionField::in_sum, "boost", "is not for --boost; one tree takes it"};
inline constexpr FormOfFit of_files = {nullptr, "files",
                                       "is not for Arrow files or several files; give the table as one CSV file"};

/// Throws std::invalid_argument for an option that was given and that this form does not take.
void refuse_options(const CLI::App& command, const FormOfFit& form);

/// How messages of the library name the options of a fit, and how commands do.
std::vector<SettingName> setting_names();

/// Throws std::logic_error for an option of the command of which is not known what forms take it.
void require_forms(const CLI::App& command);

}  // namespace llmt::apps
