/// \file
/// The subcommands of the program `stream`: what llmt::Stream learns and what it costs. Each prints one table.
#pragma once

#include <CLI/CLI.hpp>

#include "llmt/stream.hpp"
#include "synthetic.hpp"

namespace bench {

/// Number of inputs of the synthetic function that the streams learn.
inline constexpr Eigen::Index stream_inputs = 10;

/// Feeds fresh rows of the synthetic function in blocks, so that the memory of the program is that of the stream.
/// Returns the CPU seconds of the stream.
double feed(llmt::Stream& stream, Eigen::Index rows, std::uint64_t seed);

void add_alarms(CLI::App& program);
void add_drift(CLI::App& program);
void add_merged(CLI::App& program);
void add_scaling(CLI::App& program);
void add_sets(CLI::App& program);
void add_spread(CLI::App& program);

}  // namespace bench
