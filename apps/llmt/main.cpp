#include <CLI/CLI.hpp>

#include "shared/exit_codes.hpp"

int main(int argc, char** argv) {
  CLI::App app{"Local linear model trees: a table in, a model you can read out", "llmt"};
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? static_cast<int>(llmt::apps::ExitCode::done)
                                : static_cast<int>(llmt::apps::ExitCode::usage);
  }
  return static_cast<int>(llmt::apps::ExitCode::done);
}
