#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <memory>
#include <stdexcept>

#include "llmt/commands.hpp"
#include "llmt/csv.hpp"
#include "llmt/fit.hpp"
#include "shared/cli.hpp"

namespace llmt::apps {
namespace {

struct FitArguments {
  std::string data;
  std::vector<std::string> targets;
  std::vector<std::string> inputs;
  std::vector<std::string> ignored;
  std::vector<std::string> split_inputs;
  std::vector<std::string> regression_inputs;
  bool contiguous = false;
  std::string output;
  bool json = false;
  FitOptions options;
};

bool contains(const std::vector<std::string>& names, const std::string& name) {
  return std::find(names.begin(), names.end(), name) != names.end();
}

/// The columns to learn from: those asked for, or all but the targets and what is ignored.
std::vector<std::string> choose_inputs(const Csv& csv, const FitArguments& arguments) {
  for (const std::vector<std::string>* names : {&arguments.targets, &arguments.inputs, &arguments.ignored}) {
    for (const std::string& name : *names) {
      csv.index_of(name);
      if (std::count(names->begin(), names->end(), name) > 1) {
        throw std::invalid_argument(fmt::format("column \"{}\" is named twice", name));
      }
    }
  }
  std::vector<std::string> inputs;
  for (const std::string& column : arguments.inputs.empty() ? csv.columns() : arguments.inputs) {
    if (!contains(arguments.targets, column) && !contains(arguments.ignored, column)) {
      inputs.push_back(column);
    } else if (!arguments.inputs.empty()) {
      throw std::invalid_argument(fmt::format("--inputs has \"{}\", which is a target or ignored", column));
    }
  }
  if (inputs.empty()) {
    throw std::invalid_argument("no column is left to learn from");
  }
  return inputs;
}

std::vector<int> positions(const char* option, const std::vector<std::string>& names,
                           const std::vector<std::string>& inputs) {
  std::vector<int> result;
  for (const std::string& name : names) {
    const auto found = std::find(inputs.begin(), inputs.end(), name);
    if (found == inputs.end()) {
      throw std::invalid_argument(
          fmt::format("{} has \"{}\", which is not among the inputs {}", option, name, fmt::join(inputs, ", ")));
    }
    result.push_back(static_cast<int>(found - inputs.begin()));
  }
  return result;
}

Eigen::MatrixXd read_inputs(const Csv& csv, const std::vector<std::string>& columns, bool chosen_by_user) {
  try {
    return csv.numbers(columns);
  } catch (const std::runtime_error& error) {
    throw std::runtime_error(chosen_by_user ? error.what()
                                            : fmt::format("{} (--ignore COLUMN leaves a column out)", error.what()));
  }
}

double held_out(const PartitionSummary& partition, std::ptrdiff_t leaves) {
  return partition.cv_rmse.size() == 0
             ? std::numeric_limits<double>::quiet_NaN()
             : partition.cv_rmse(std::min<std::ptrdiff_t>(leaves, partition.cv_rmse.size()) - 1);
}

Json summary_json(const FitArguments& arguments, const FitResult& result) {
  Json json;
  json["data"] = arguments.data;
  json["rows"] = result.summary.samples;
  json["rule"] = arguments.options.growth.rule == GrowthRule::rd ? "rd" : "retis";
  json["min_leaf_samples"] = result.summary.min_leaf_samples;
  json["inputs"] = Json::array();
  for (const InputColumn& input : result.model.inputs()) {
    json["inputs"].push_back(input.name);
  }
  json["partitions"] = Json::array();
  for (const PartitionSummary& partition : result.summary.partitions) {
    Json entry;
    for (std::size_t o = 0; o < partition.outputs.size(); ++o) {
      entry["targets"].push_back(result.model.outputs()[static_cast<std::size_t>(partition.outputs[o])].name);
      entry["train_rmse"].push_back(partition.train_rmse(static_cast<std::ptrdiff_t>(o)));
    }
    entry["leaves"] = partition.leaves;
    entry["grown_leaves"] = partition.grown_leaves;
    entry["rank_deficient_leaves"] = partition.rank_deficient_leaves;
    entry["growth_ended_by"] = describe(partition.stop);
    entry["cv_folds"] = partition.cv_folds;
    entry["cv_rmse"] = partition.cv_folds > 0 ? Json(held_out(partition, partition.leaves)) : Json(nullptr);
    entry["cv_rmse_least_squares"] = partition.cv_folds > 0 ? Json(held_out(partition, 1)) : Json(nullptr);
    entry["cv_rmse_by_leaves"] = std::vector<double>(partition.cv_rmse.begin(), partition.cv_rmse.end());
    json["partitions"].push_back(std::move(entry));
  }
  json["model"] = arguments.output.empty() ? Json(nullptr) : Json(arguments.output);
  return json;
}

void print_summary(const FitArguments& arguments, const FitResult& result) {
  std::vector<std::string> inputs;
  std::vector<std::string> constant;
  for (const InputColumn& input : result.model.inputs()) {
    inputs.push_back(input.name);
    if (input.low == input.high) {
      constant.push_back(input.name);
    }
  }
  print(fmt::format("{}: {} rows, {} inputs: {}\n", arguments.data, result.summary.samples, inputs.size(),
                    fmt::join(inputs, ", ")));
  if (!constant.empty()) {
    print(fmt::format("Constant, so without influence: {}\n", fmt::join(constant, ", ")));
  }
  const std::ptrdiff_t folds = result.summary.partitions.front().cv_folds;
  print(fmt::format("Rule {}, at least {} rows in a leaf; {}\n\n",
                    arguments.options.growth.rule == GrowthRule::rd ? "rd" : "retis", result.summary.min_leaf_samples,
                    folds > 0
                        ? fmt::format("leaf count by {}-fold cross-validation{}, the tree grown anew in every fold",
                                      folds, arguments.contiguous ? " over contiguous blocks of rows" : "")
                        : "leaf count as grown"));
  Table table(
      {"target", "leaves", "grown", "growth ended by", "RMSE held-out", "least squares held-out", "RMSE in-sample"});
  for (const PartitionSummary& partition : result.summary.partitions) {
    for (std::size_t o = 0; o < partition.outputs.size(); ++o) {
      table.add({result.model.outputs()[static_cast<std::size_t>(partition.outputs[o])].name,
                 fmt::format("{}", partition.leaves), fmt::format("{}", partition.grown_leaves),
                 describe(partition.stop), number(held_out(partition, partition.leaves)),
                 number(held_out(partition, 1)), number(partition.train_rmse(static_cast<std::ptrdiff_t>(o)))});
    }
  }
  print(table.text());
  if (result.summary.partitions.front().outputs.size() > 1) {
    print("Held-out errors of the shared tree are over all targets, each divided by its standard deviation.\n");
  }
  for (const PartitionSummary& partition : result.summary.partitions) {
    if (partition.rank_deficient_leaves > 0) {
      print(fmt::format(
          "Leaves whose rows do not determine all slopes (constant or collinear inputs, few rows) and keep their "
          "parent's there: {}.\n",
          partition.rank_deficient_leaves));
    }
  }
  if (!arguments.output.empty()) {
    print(fmt::format("Model written to {}\n", arguments.output));
  }
}

void fit_command(FitArguments arguments) {
  const Csv csv = Csv::read(arguments.data);
  if (csv.rows() == 0) {
    throw std::runtime_error(fmt::format("{}: there is a header and no rows", arguments.data));
  }
  const std::vector<std::string> input_names = choose_inputs(csv, arguments);
  const Eigen::MatrixXd outputs = csv.numbers(arguments.targets);
  const Eigen::MatrixXd inputs = read_inputs(csv, input_names, !arguments.inputs.empty());
  arguments.options.growth.split_inputs = positions("--split-inputs", arguments.split_inputs, input_names);
  arguments.options.growth.regression_inputs =
      positions("--regression-inputs", arguments.regression_inputs, input_names);
  arguments.options.folds.kind = arguments.contiguous ? FoldKind::contiguous : FoldKind::random;

  Progress progress("growing trees");
  arguments.options.progress = [&](std::ptrdiff_t done, std::ptrdiff_t total) { progress.show(done, total); };
  FitResult result = fit(inputs, outputs, arguments.options);
  progress.clear();
  result.model = result.model.named(input_names, arguments.targets);
  if (!arguments.output.empty()) {
    save(result.model, arguments.output);
  }
  if (arguments.json) {
    print_json(summary_json(arguments, result));
  } else {
    print_summary(arguments, result);
  }
}

}  // namespace

void add_fit(CLI::App& app) {
  CLI::App* command = app.add_subcommand("fit", "Learn a model from a table");
  command->footer("Example: llmt fit concrete.csv --target strength -o concrete.json");
  const auto arguments = std::make_shared<FitArguments>();
  GrowthOptions& growth = arguments->options.growth;
  command->add_option("data", arguments->data, "CSV file with a header row")->required();
  command->add_option("-t,--target", arguments->targets, "Column to predict; repeat for several")
      ->required()
      ->delimiter(',');
  command->add_option("--inputs", arguments->inputs, "Columns to learn from (default: all but targets and ignored)")
      ->delimiter(',');
  command->add_option("--ignore", arguments->ignored, "Columns to leave out")->delimiter(',');
  command->add_option("--split-inputs", arguments->split_inputs, "Inputs that may be split (default: all)")
      ->delimiter(',');
  command->add_option("--regression-inputs", arguments->regression_inputs, "Inputs of the local models (default: all)")
      ->delimiter(',');
  command->add_option("--rule", growth.rule, "Growth rule: rd (F test) or retis (m-estimate pruning)")
      ->transform(CLI::CheckedTransformer(
          std::map<std::string, GrowthRule>{{"rd", GrowthRule::rd}, {"retis", GrowthRule::retis}}))
      ->option_text("rd|retis [rd]");
  command->add_option("--max-leaves", growth.max_leaves, "Most leaves of a tree, 0: no limit")->capture_default_str();
  command
      ->add_option("--min-leaf", growth.min_leaf_samples,
                   "Fewest rows in a leaf, 0: twice the coefficients of a local model")
      ->capture_default_str();
  command->add_option("--significance", growth.significance, "rd: of the F test, over all candidate splits; 1: no test")
      ->check(CLI::NonNegativeNumber)
      ->capture_default_str();
  command
      ->add_option("--min-improvement", growth.min_improvement,
                   "Stop when further splits lower the training sum of squares by less than this fraction each")
      ->capture_default_str();
  command->add_flag("--shared", growth.shared_partition, "One tree for all targets instead of one each");
  command
      ->add_option("--cv", arguments->options.folds.count,
                   "Folds to choose the leaf count by, 0: keep the tree as grown")
      ->capture_default_str();
  command->add_flag("--contiguous", arguments->contiguous,
                    "Folds are blocks of consecutive rows (measured paths, grids, time series)");
  command->add_option("--seed", arguments->options.folds.seed, "Of the random folds")->capture_default_str();
  command->add_option("--threads", arguments->options.max_threads, "0: all; the result does not depend on it")
      ->capture_default_str();
  command->add_option("-o,--output", arguments->output, "Model file to write");
  command->add_flag("--json", arguments->json, "Print the summary as JSON");
  command->callback([arguments] { fit_command(*arguments); });
}

}  // namespace llmt::apps
