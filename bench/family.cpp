// The members of the family on the same rows: test error, leaves and CPU seconds.
//
// family [--leaves M] [--sets FOLDER] [--trials N] [--members NAME,...] [--tasks NAME,...]
//
// Without --leaves every member chooses its size and what else it leaves open by cross-validation, as a user gets it.
// With --leaves all have M leaves (M / 2 where local models are quadratic). Errors are RMSE on rows that took no part,
// without noise where the truth is known, as a ratio to that of a crisp tree by RD, which is printed in the unit of the
// output. Known truths unless --sets names a folder with NAME.csv and NAME.splits.csv.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "family_tasks.hpp"
#include "llmt/fit.hpp"
#include "resources.hpp"

namespace {

struct Member {
  std::string name;
  llmt::FitOptions options;
};

std::vector<Member> members(std::ptrdiff_t leaves) {
  llmt::FitOptions base;
  base.intervals = false;
  base.growth.max_leaves = leaves;
  if (leaves > 0) {
    base.selection.folds.count = 0;
    base.growth.significance = 1.0;
    base.growth.min_variance_gain = -1.0;
  }
  std::vector<Member> result;
  const auto add = [&](const std::string& name, const auto& change) {
    result.push_back({name, base});
    change(result.back().options);
  };
  using Options = llmt::FitOptions;
  const auto crisp = [](Options& options) { options.blend.validity = llmt::ValidityChoice::crisp; };
  // What a hand-over of whole boxes is where nothing is chosen.
  const auto blend = [&](Options& options) {
    options.blend.validity = llmt::ValidityChoice::blend;
    if (leaves > 0) {
      options.blend.widths = {1.0};
      options.blend.ridges = {1e-4};
    }
  };
  // Gaussians and sigmoids reach everywhere: their joint estimates cost the square of the number of leaves.
  const auto few_leaves = [&](Options& options) { options.growth.max_leaves = leaves > 0 ? leaves : 50; };
  add("least squares", [](Options& options) {
    options.growth.max_leaves = 1;
    options.selection.folds.count = 0;
  });
  add("crisp RD", crisp);
  add("crisp RA", [&](Options& options) {
    crisp(options);
    options.growth.rule = llmt::GrowthRule::ra;
  });
  add("crisp RD pruned", [&](Options& options) {
    crisp(options);
    options.growth.pruning = llmt::Pruning::weakest_link;
  });
  if (leaves == 0) {
    add("crisp RD sparse", [&](Options& options) {
      crisp(options);
      options.local_models.sparse = llmt::SparseChoice::automatic;
    });
    add("M5'", [&](Options& options) {
      options.growth.rule = llmt::GrowthRule::m5;
      options.selection.folds.count = 0;
    });
  }
  // Fewer, for a quadratic one stands for several linear ones.
  const auto quadratic = [&](Options& options) {
    options.local_models.terms = llmt::LocalTerms::quadratic;
    options.growth.max_leaves = (leaves + 1) / 2;
  };
  add("crisp RD quadratic", [&](Options& options) {
    crisp(options);
    quadratic(options);
  });
  add("blend", blend);
  if (leaves == 0) {
    add("default", [](Options&) {});
  }
  add("blend quadratic", [&](Options& options) {
    blend(options);
    quadratic(options);
  });
  add("LOLIMOT local", [&](Options& options) {
    options.growth.rule = llmt::GrowthRule::lolimot;
    options.blend.estimation = llmt::Estimation::as_grown;
    few_leaves(options);
  });
  add("LOLIMOT joint", [&](Options& options) {
    options.growth.rule = llmt::GrowthRule::lolimot;
    options.blend.ridges = leaves > 0 ? std::vector<double>{1e-4} : std::vector<double>{};
    few_leaves(options);
  });
  add("HILOMOT local", [&](Options& options) {
    options.growth.rule = llmt::GrowthRule::hilomot;
    options.blend.estimation = llmt::Estimation::as_grown;
    few_leaves(options);
  });
  add("HILOMOT joint", [&](Options& options) {
    options.growth.rule = llmt::GrowthRule::hilomot;
    options.blend.ridges = leaves > 0 ? std::vector<double>{1e-4} : std::vector<double>{};
    few_leaves(options);
  });
  return result;
}

struct Result {
  double rmse = 0.0;
  double nmse = 0.0;  // mean squared error / variance of the test output
  double leaves = 0.0;
  double seconds = 0.0;  // CPU, of a fit
};

Result measure(const Member& member, const bench::Task& task, int trials) {
  Result result;
  for (int t = 0; t < trials; ++t) {
    const bench::Trial trial = task.trial(t);
    llmt::FitOptions options = member.options;
    options.growth.max_leaves = std::min<std::ptrdiff_t>(options.growth.max_leaves, trial.train_inputs.rows());
    std::vector<llmt::FitResult> fitted;
    result.seconds +=
        bench::measure([&] { fitted.push_back(llmt::fit(trial.train_inputs, trial.train_output, options)); }).cpu /
        trials;
    const double rmse = llmt::rmse(fitted.front().model.predict(trial.test_inputs), trial.test_output)(0);
    const double variance = (trial.test_output.array() - trial.test_output.mean()).square().mean();
    result.rmse += rmse / trials;
    result.nmse += rmse * rmse / variance / trials;
    result.leaves += static_cast<double>(fitted.front().summary.partitions[0].leaves) / trials;
  }
  return result;
}

bool is_asked(const std::vector<std::string>& names, const std::string& name) {
  return names.empty() || std::find(names.begin(), names.end(), name) != names.end();
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app("The members of the family on the same rows");
  std::ptrdiff_t leaves = 0;
  std::string folder;
  int most_trials = 5;
  std::vector<std::string> member_names;
  std::vector<std::string> task_names;
  app.add_option("--leaves", leaves, "Leaves of all; 0: each chooses")->check(CLI::NonNegativeNumber);
  app.add_option("--sets", folder, "Folder of data sets with given splits")->check(CLI::ExistingDirectory);
  app.add_option("--trials", most_trials, "At most so many seeds or splits")->check(CLI::PositiveNumber);
  app.add_option("--members", member_names)->delimiter(',');
  app.add_option("--tasks", task_names)->delimiter(',');
  CLI11_PARSE(app, argc, argv);
  try {
    const std::vector<Member> all = members(leaves);
    const auto reference =
        std::find_if(all.begin(), all.end(), [](const Member& member) { return member.name == "crisp RD"; });
    for (const bench::Task& task : folder.empty() ? bench::known_truths() : bench::given_sets(folder)) {
      if (!is_asked(task_names, task.name)) {
        continue;
      }
      const int trials = std::min(task.trials, most_trials);
      const Result crisp = measure(*reference, task, trials);
      fmt::print("\n{}: crisp RD {:.5g}, {} trials\n{:24} {:>8} {:>12} {:>10} {:>8} {:>9}\n", task.name, crisp.rmse,
                 trials, "member", "ratio", "RMSE", "nMSE", "leaves", "CPU s");
      for (const Member& member : all) {
        if (!is_asked(member_names, member.name)) {
          continue;
        }
        try {
          const Result result = member.name == reference->name ? crisp : measure(member, task, trials);
          fmt::print("{:24} {:8.3f} {:12.5g} {:10.4g} {:8.1f} {:9.3f}\n", member.name, result.rmse / crisp.rmse,
                     result.rmse, result.nmse, result.leaves, result.seconds);
        } catch (const std::invalid_argument& refusal) {
          fmt::print("{:24} {}\n", member.name, refusal.what());
        }
        std::fflush(stdout);
      }
    }
  } catch (const std::exception& error) {
    fmt::print(stderr, "family: {}\n", error.what());
    return 1;
  }
  return 0;
}
