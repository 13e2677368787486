#include "llmt/retired_options.hpp"

#include <fmt/format.h>

#include <array>
#include <stdexcept>
#include <string>
#include <vector>

namespace llmt::apps {
namespace {

struct RetiredOption {
  const char* name;
  const char* advice;  // why it was retired, and what to use
};

constexpr std::array<RetiredOption, 3> retired_options = {{
    {"--merge",
     "leaves that shared a local model predicted at most 3 % better; --prune makes trees smaller, and files with "
     "shared local models can still be read"},
    {"--smoothness", "blends have one continuous derivative; files of blends with two can still be read"},
    {"--stream-rule",
     "residual analysis in streams left an error of 0.84 where residual differences leave 0.39; streams always take "
     "the latter"},
}};

}  // namespace

void refuse_retired_options(CLI::App& command) {
  for (const RetiredOption& option : retired_options) {
    const auto refuse = [option](const std::vector<std::string>&) {
      throw std::invalid_argument(fmt::format("{} was retired in this version: {}", option.name, option.advice));
    };
    command.add_option_function<std::vector<std::string>>(option.name, refuse)->expected(0, 1)->group("");
  }
}

}  // namespace llmt::apps
