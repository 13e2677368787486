/// \file
/// What a teacher brought a tree, in words and as JSON.
#pragma once

#include "llmt/teach.hpp"
#include "report/document/document.hpp"

namespace llmt::report {

Json teaching_json(const TaughtResult& taught);

/// "One tree 5.00, taught tree 4.70, sum 4.01", and what it means.
Section teaching_words(const TaughtResult& taught);

}  // namespace llmt::report
