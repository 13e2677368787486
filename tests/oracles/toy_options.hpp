/// \file
/// Options with one that a fit does not have: a member, and its entry. Nothing else is written for it.
#pragma once

#include <type_traits>

#include "llmt/option_fields.hpp"

namespace llmt {

struct ToyOptions {
  int folds = 5;
  double toy = 1.5;
};

template <class Options, class Visitor>
requires std::is_same_v<std::remove_const_t<Options>, ToyOptions>
void for_each_field(Options& options, Visitor&& visit) {
  auto& [folds, toy] = options;
  visit(OptionField{"folds", "--folds", "folds", "Folds", whole_number, false, Audience::everyone, true, Use::taken(),
                    Use::refused(), Use::refused()},
        folds);
  visit(OptionField{"toy", "--toy", "toy", "A toy", any_share, false, Audience::experts, false, Use::taken(),
                    Use::refused("play without"), Use::refused()},
        toy);
}

}  // namespace llmt
