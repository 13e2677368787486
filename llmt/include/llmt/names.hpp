/// \file
/// The names of choices, as model files, the command line and messages have them; and what a misspelt name means.
///
///     const llmt::ValidityChoice choice = llmt::parse<llmt::ValidityChoice>("crisp");
///     const std::string_view name = llmt::name_of(choice);  // "crisp"
#pragma once

#include <span>
#include <stdexcept>
#include <string>
#include <string_view>

namespace llmt {

/// One value of an enumeration and its name.
template <class Enum>
struct Choice {
  Enum value;
  std::string_view name;
};

/// All values of an enumeration, in the order in which help lists them. They are defined for the enumerations of
/// options.hpp, for ValidityKind (model.hpp) and for distributed::Step.
template <class Enum>
std::span<const Choice<Enum>> choices();

/// The names: "linear, quadratic, auto".
template <class Enum>
std::string list_names(std::string_view separator = ", ") {
  std::string list;
  for (const Choice<Enum>& choice : choices<Enum>()) {
    list += list.empty() ? std::string() : std::string(separator);
    list += choice.name;
  }
  return list;
}

/// The name of a value: "retis". Throws std::invalid_argument for a number that is no value of the enumeration.
template <class Enum>
std::string_view name_of(Enum value) {
  for (const Choice<Enum>& choice : choices<Enum>()) {
    if (choice.value == value) return choice.name;
  }
  throw std::invalid_argument("llmt::name_of: " + std::to_string(static_cast<int>(value)) + " stands for none of " +
                              list_names<Enum>());
}

/// The value with this name. Throws std::invalid_argument that lists the names.
template <class Enum>
Enum parse(std::string_view name) {
  for (const Choice<Enum>& choice : choices<Enum>()) {
    if (choice.name == name) return choice.value;
  }
  throw std::invalid_argument("llmt::parse: \"" + std::string(name) + "\" is none of " + list_names<Enum>());
}

/// The name that a misspelt word most likely means: the one with the fewest letters put in, left out, replaced or
/// exchanged with their neighbour (Damerau 1964, optimal string alignment), if that is at most a third of the word's
/// letters; one is always allowed, but for a word of one letter. Upper and lower case are the same. Of names that are
/// equally near the first one is taken. Without such a name: the only one that begins with the word, of three letters
/// or more. Empty: there is none.
std::string_view closest_name(std::string_view word, std::span<const std::string> names);

/// " (did you mean "NAME"?)" of closest_name(), or nothing.
std::string did_you_mean(std::string_view word, std::span<const std::string> names);

}  // namespace llmt
