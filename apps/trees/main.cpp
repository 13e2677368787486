#include "shared/cli.hpp"
#include "trees/commands.hpp"
#include "trees/fit_options.hpp"

int main(int argc, char** argv) {
  CLI::App app{"Local linear model trees: a table in, a model you can read out.", "llmt"};
  app.require_subcommand(1);
  app.set_help_all_flag("--help-all", "Help with all options, also those for experts");
  llmt::apps::add_fit(app);
  llmt::apps::add_predict(app);
  llmt::apps::add_simulate(app);
  llmt::apps::add_inspect(app);
  llmt::apps::add_explain(app);
  llmt::apps::add_check(app);
  llmt::apps::add_compare(app);
  llmt::apps::add_signals(app);
  llmt::apps::add_table(app);
  llmt::apps::add_discover(app);
  llmt::apps::add_export(app);
  return llmt::apps::run(app, argc, argv, llmt::apps::setting_names());
}
