#include "shared/cli.hpp"

int main(int argc, char** argv) {
  CLI::App app{"Calibrate a robot, learn what its model misses, and remove it.", "llmt-robot"};
  app.require_subcommand(1);
  return llmt::apps::run(app, argc, argv);
}
