/// \file
/// What `llmt fit --readable` says of the readable tree.
#pragma once

#include "llmt/fit.hpp"
#include "llmt/readable.hpp"
#include "shared/cli.hpp"

namespace llmt::apps {

Json readable_json(const ReadableResult& readable);

/// What the model, the readable tree and least squares cost, in size and in held-out error.
void print_readable(const FitResult& fitted, const ReadableResult& readable, double loss);

}  // namespace llmt::apps
