#include "llmt/commands.hpp"
#include "shared/cli.hpp"

int main(int argc, char** argv) {
  CLI::App app{"Local linear model trees: a table in, a model you can read out.", "llmt"};
  app.require_subcommand(1);
  app.set_help_all_flag("--help-all", "Help of all commands");
  llmt::apps::add_fit(app);
  llmt::apps::add_predict(app);
  llmt::apps::add_inspect(app);
  llmt::apps::add_explain(app);
  llmt::apps::add_compare(app);
  llmt::apps::add_discover(app);
  return llmt::apps::run(app, argc, argv);
}
