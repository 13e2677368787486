// The members of the family on the same rows: test error, leaves and CPU seconds.
//
// Without --leaves every member chooses its size, and what else it leaves open, by cross-validation, as a user gets it.
// With --leaves M every tree has M leaves (M / 2 where local models are quadratic). Errors are RMSE on test rows, as a
// ratio to that of a crisp tree by RD, whose RMSE is printed in the unit of the output.
#include <fmt/format.h>

#include <algorithm>
#include <memory>
#include <optional>

#include "methods.hpp"
#include "resources.hpp"
#include "study/study.hpp"

namespace bench {
namespace {

using llmt::FitOptions;
using llmt::GrowthRule;

struct Member {
  std::string name;
  FitOptions options;
};

// With a given number of leaves nothing is chosen, and a transition is as wide as its box.
FitOptions blend(Eigen::Index leaves, FitOptions options) {
  options.validity = llmt::ValidityChoice::blend;
  if (leaves > 0) {
    options.expert.widths = {1.0};
    options.expert.ridges = {1e-4};
  }
  return options;
}

// Half the leaves, because a quadratic local model stands for several linear ones.
FitOptions quadratic(Eigen::Index leaves, FitOptions options) {
  options.terms = llmt::LocalTerms::quadratic;
  options.max_leaves = (leaves + 1) / 2;
  return options;
}

// LOLIMOT or HILOMOT. The time of the joint estimate grows with the square of the number of leaves, because Gaussians
// and sigmoids reach everywhere; hence at most 50.
FitOptions soft(GrowthRule rule, bool joint, Eigen::Index leaves, FitOptions options) {
  options.rule = rule;
  options.max_leaves = leaves > 0 ? leaves : 50;
  if (!joint) options.expert.estimation = llmt::Estimation::as_grown;
  if (joint && leaves > 0) options.expert.ridges = {1e-4};
  return options;
}

FitOptions pruned(FitOptions options) {
  options.pruning = llmt::Pruning::weakest_link;
  return options;
}

FitOptions sparse(FitOptions options) {
  options.sparse = llmt::SparseChoice::automatic;
  return options;
}

FitOptions m5(FitOptions options) {
  options.folds.count = 0;
  return with_rule(GrowthRule::m5, options);
}

// `leaves` of every tree; 0: each member chooses, and those that must choose take part.
std::vector<Member> members(Eigen::Index leaves) {
  FitOptions base = leaves > 0 ? with_leaves(leaves) : FitOptions{};
  base.intervals = false;
  const bool choose = leaves == 0;
  std::vector<Member> result;
  const auto add = [&](const char* name, const FitOptions& options) { result.push_back({name, options}); };
  add("least squares", least_squares(base));
  add("crisp RD", crisp(base));
  add("crisp RA", crisp(with_rule(GrowthRule::ra, base)));
  add("crisp RD pruned", crisp(pruned(base)));
  if (choose) add("crisp RD sparse", crisp(sparse(base)));
  if (choose) add("M5'", m5(base));
  add("crisp RD quadratic", crisp(quadratic(leaves, base)));
  add("blend", blend(leaves, base));
  if (choose) add("default", base);
  add("blend quadratic", blend(leaves, quadratic(leaves, base)));
  add("LOLIMOT local", soft(GrowthRule::lolimot, false, leaves, base));
  add("LOLIMOT joint", soft(GrowthRule::lolimot, true, leaves, base));
  add("HILOMOT local", soft(GrowthRule::hilomot, false, leaves, base));
  add("HILOMOT joint", soft(GrowthRule::hilomot, true, leaves, base));
  return result;
}

// Means over the trials.
struct Result {
  double rmse = 0.0;
  double nmse = 0.0;  // mean squared error / variance of the test output
  double leaves = 0.0;
  double seconds = 0.0;  // CPU, per fit
};

Result run(const Member& member, const Task& task) {
  Result result;
  for (int t = 0; t < task.trials; ++t) {
    const Trial trial = task.trial(t);
    FitOptions options = member.options;
    options.max_leaves = std::min<Eigen::Index>(options.max_leaves, trial.train_inputs.rows());
    std::optional<llmt::FitResult> fit;
    const Cost cost = measure([&] { fit = llmt::fit(trial.train_inputs, trial.train_output, options); });
    result.seconds += cost.cpu / task.trials;
    const double rmse = llmt::rmse(fit->model.predict(trial.test_inputs), trial.test_output)(0);
    const double variance = (trial.test_output.array() - trial.test_output.mean()).square().mean();
    result.rmse += rmse / task.trials;
    result.nmse += rmse * rmse / variance / task.trials;
    result.leaves += static_cast<double>(fit->summary.partitions[0].leaves) / task.trials;
  }
  return result;
}

struct Arguments {
  TaskChoice tasks;
  Eigen::Index leaves = 0;
  std::vector<std::string> names;  // of members; empty: all
};

void study_task(const Task& task, const std::vector<Member>& all, const std::vector<std::string>& names) {
  const Member& reference = *std::ranges::find(all, "crisp RD", &Member::name);
  const Result crisp = run(reference, task);
  fmt::print("\n{}: crisp RD {:.5g}, {} trials\n{:24} {:>8} {:>12} {:>10} {:>8} {:>9}\n", task.name, crisp.rmse,
             task.trials, "member", "ratio", "RMSE", "nMSE", "leaves", "CPU s");
  for (const Member& member : all) {
    if (!names.empty() && std::ranges::find(names, member.name) == names.end()) continue;
    try {
      const Result result = &member == &reference ? crisp : run(member, task);
      fmt::print("{:24} {:8.3f} {:12.5g} {:10.4g} {:8.1f} {:9.3f}\n", member.name, result.rmse / crisp.rmse,
                 result.rmse, result.nmse, result.leaves, result.seconds);
    } catch (const std::invalid_argument& refusal) {
      fmt::print("{:24} {}\n", member.name, refusal.what());
    }
    std::fflush(stdout);
  }
}

}  // namespace

void add_members(CLI::App& study) {
  const auto arguments = std::make_shared<Arguments>();
  CLI::App* command = study.add_subcommand("members", "The members of the family on the same rows");
  add_task_options(*command, arguments->tasks);
  command->add_option("--leaves", arguments->leaves, "number of leaves of every tree; 0: each member chooses")
      ->check(CLI::NonNegativeNumber);
  command->add_option("--members", arguments->names, "comma-separated; default: all")->delimiter(',');
  command->callback([arguments] {
    const std::vector<Member> all = members(arguments->leaves);
    for (const Task& task : chosen_tasks(arguments->tasks)) study_task(task, all, arguments->names);
  });
}

}  // namespace bench
