#include "shared/cli.hpp"
#include "trees/commands.hpp"

namespace {

// Of FitOptions, in the messages of llmt::fit() and llmt::compare().
constexpr llmt::apps::SettingName setting_names[] = {
    {"folds.count", "--cv"},
    {"folds.seed", "--seed"},
    {"max_leaves", "--max-leaves"},
    {"min_leaf_samples", "--min-leaf"},
    {"max_threads", "--threads"},
    {"split_inputs", "--split-inputs"},
    {"regression_inputs", "--regression-inputs"},
    {"trends", "--monotone or --slope-sign"},
    {"pruning", "--prune"},
    {"shared_partition", "--shared"},
    {"significance", "--significance"},
    {"terms", "--local-models"},
    {"sparse", "--sparse"},
    {"validity", "--validity"},
    {"rule", "--rule"},
    {"loss", "--loss"},
    {"expert.search", "--search"},
    {"expert.estimation", "--estimation"},
    {"expert.widths", "--width"},
    {"expert.jumps", "--jump"},
    {"expert.ridges", "--ridge"},
    {"expert.shrinkages", "--shrinkage"},
};

}  // namespace

int main(int argc, char** argv) {
  CLI::App app{"Local linear model trees: a table in, a model you can read out.", "llmt"};
  app.require_subcommand(1);
  app.set_help_all_flag("--help-all", "Help with all options, also those for experts");
  llmt::apps::add_fit(app);
  llmt::apps::add_predict(app);
  llmt::apps::add_inspect(app);
  llmt::apps::add_explain(app);
  llmt::apps::add_compare(app);
  llmt::apps::add_signals(app);
  llmt::apps::add_table(app);
  llmt::apps::add_discover(app);
  llmt::apps::add_export(app);
  return llmt::apps::run(app, argc, argv, setting_names);
}
