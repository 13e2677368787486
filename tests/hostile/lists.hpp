// The lists of inputs of unknown origin, one function each.
#pragma once

#include "hostile/run.hpp"

namespace hostile {

void ask_urdfs(List& list, const std::string& robot_program);
void ask_mechanisms(List& list, const std::string& robot_program);
void ask_models(List& list, const std::string& program);
void ask_arrow_files(List& list, const std::string& program);

/// States of fits beyond memory and of streams. `self` --stream FILE goes on from a stream's state.
void ask_states(List& list, const std::string& program, const std::string& self);
int go_on_from_stream(const std::string& file);

/// Files of what `llmt discover --json` found.
void ask_found_files(List& list, const std::string& program);

void ask_sums(List& list, const std::string& program);
void ask_names(List& list, const std::string& program);

/// Measures the largest inputs that are permitted, without limits.
void ask_largest(List& list, const std::string& program, const std::string& robot_program);

}  // namespace hostile
