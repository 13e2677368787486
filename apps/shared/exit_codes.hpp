#pragma once

namespace llmt::apps {

/// Exit codes of the programs: done; the data or the outcome does not allow it; wrong usage.
enum class ExitCode { done = 0, refused = 1, usage = 2 };

}  // namespace llmt::apps
