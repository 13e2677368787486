#include <CLI/CLI.hpp>

#include "shared/exit_codes.hpp"

int main(int argc, char** argv) {
  CLI::App app{"Calibrate a robot, find what its model misses, and remove what is left", "llmt-robot"};
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? static_cast<int>(llmt::apps::ExitCode::done)
                                : static_cast<int>(llmt::apps::ExitCode::usage);
  }
  return static_cast<int>(llmt::apps::ExitCode::done);
}
