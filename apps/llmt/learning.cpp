#include "llmt/learning.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <stdexcept>
#include <utility>

#include "llmt/csv.hpp"
#include "llmt/retired_options.hpp"

namespace llmt::apps {
namespace {

bool contains(const std::vector<std::string>& names, const std::string& name) {
  return std::ranges::find(names, name) != names.end();
}

std::vector<int> positions(const char* option, const std::vector<std::string>& names,
                           const std::vector<std::string>& inputs) {
  std::vector<int> result;
  for (const std::string& name : names) {
    const auto found = std::ranges::find(inputs, name);
    if (found == inputs.end()) {
      throw std::invalid_argument(
          fmt::format("{} has \"{}\", which is not among the inputs {}", option, name, fmt::join(inputs, ", ")));
    }
    result.push_back(static_cast<int>(found - inputs.begin()));
  }
  return result;
}

// Of each input 1, or -1 where its name has a leading minus; 0 where it is not named. Empty if none is.
std::vector<int> signs_of(const char* option, const std::vector<std::string>& names,
                          const std::vector<std::string>& inputs) {
  if (names.empty()) return {};
  std::vector<int> result(inputs.size(), 0);
  for (const std::string& name : names) {
    const bool falls = !contains(inputs, name) && name.starts_with('-');
    const int position = positions(option, {falls ? name.substr(1) : name}, inputs).front();
    int& sign = result[position];
    if (sign == (falls ? 1 : -1)) {
      throw std::invalid_argument(fmt::format("{} names \"{}\" with both signs", option, inputs[position]));
    }
    sign = falls ? -1 : 1;
  }
  return result;
}

}  // namespace

std::vector<std::string> choose_inputs(const Csv& csv, const LearningArguments& arguments) {
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
    if (!contains(arguments.targets, column) && !contains(arguments.ignored, column) && column != arguments.weight) {
      inputs.push_back(column);
    } else if (!arguments.inputs.empty()) {
      throw std::invalid_argument(fmt::format("--inputs has \"{}\", which is a target, the weight or ignored", column));
    }
  }
  if (inputs.empty()) throw std::invalid_argument("no column is left to learn from");
  for (const std::vector<std::string>* names : {&arguments.targets, &std::as_const(inputs)}) {
    for (const std::string& name : *names) {
      if (!is_utf8(name)) {
        throw std::runtime_error(
            fmt::format("{}: header: the name of column {} is not valid UTF-8; write the table as UTF-8", csv.name(),
                        csv.index_of(name) + 1));
      }
    }
  }
  return inputs;
}

LearningTable read_learning_table(const LearningArguments& arguments) {
  const Csv csv = Csv::read(arguments.data);
  if (csv.rows() == 0) {
    throw std::runtime_error(fmt::format("{}: there is a header and no rows", arguments.data));
  }
  const std::vector<std::string> inputs = choose_inputs(csv, arguments);
  const std::string hint = arguments.inputs.empty() ? " (--ignore COLUMN leaves a column out)" : "";
  LearningColumns columns = read_learning_columns(
      csv, {inputs, arguments.categorical, arguments.targets, arguments.weight}, hint, arguments.options.max_threads);
  LearningTable table{inputs, std::move(columns.inputs), std::move(columns.targets), arguments.options};
  FitOptions& options = table.options;
  options.split_inputs = positions("--split-inputs", arguments.split_inputs, table.names);
  options.regression_inputs = positions("--regression-inputs", arguments.regression_inputs, table.names);
  options.monotone = signs_of("--monotone", arguments.monotone, table.names);
  options.slope_signs = signs_of("--slope-sign", arguments.slope_signs, table.names);
  options.categorical_inputs = table.inputs.categorical;
  for (std::size_t j = 0; j < table.names.size(); ++j) {
    const int monotone = options.monotone.empty() ? 0 : options.monotone[j];
    const int sign = options.slope_signs.empty() ? 0 : options.slope_signs[j];
    const std::vector<int>& categorical = table.inputs.categorical;
    if ((monotone != 0 || sign != 0) && std::ranges::find(categorical, static_cast<int>(j)) != categorical.end()) {
      throw std::invalid_argument(fmt::format("{} names \"{}\", which is categorical",
                                              monotone != 0 ? "--monotone" : "--slope-sign", table.names[j]));
    }
    if (monotone * sign < 0) {
      throw std::invalid_argument(
          fmt::format("--monotone and --slope-sign name \"{}\" with opposite signs", table.names[j]));
    }
  }
  options.weights = std::move(columns.weights);
  options.folds.kind = arguments.contiguous ? FoldKind::contiguous : FoldKind::random;
  return table;
}

void add_learning_options(CLI::App& command, LearningArguments& arguments) {
  FitOptions& options = arguments.options;
  command.add_option("data", arguments.data, "CSV file with a header row")->required();
  command.add_option("-t,--target", arguments.targets, "Column to predict; repeat for several")
      ->required()
      ->delimiter(',');
  command.add_option("--inputs", arguments.inputs, "Columns to learn from (default: all but targets and ignored)")
      ->delimiter(',');
  command.add_option("--ignore", arguments.ignored, "Columns to leave out")->delimiter(',');
  command
      .add_option("--categorical", arguments.categorical,
                  "Inputs that are categories although they are written as numbers; columns of words are anyway")
      ->delimiter(',');
  command.add_option("--weight", arguments.weight, "Column with the weights of the rows");
  command.add_option("--split-inputs", arguments.split_inputs, "Inputs that may be split (default: all)")
      ->delimiter(',');
  command.add_option("--regression-inputs", arguments.regression_inputs, "Inputs of the local models (default: all)")
      ->delimiter(',');
  command
      .add_option("--monotone", arguments.monotone,
                  "Inputs with which the prediction never falls, or with a leading minus never rises (--monotone=-x)")
      ->delimiter(',');
  command
      .add_option("--slope-sign", arguments.slope_signs,
                  "Inputs with slopes >= 0, or with a leading minus <= 0, in every local model; not across leaves")
      ->delimiter(',');
  command.add_option("--max-leaves", options.max_leaves, "Most leaves of a tree; 0: the default")
      ->option_text(fmt::format("INT [{}]", default_text("max_leaves")));
  command.add_option("--min-leaf", options.min_leaf_samples, "Fewest rows in a leaf; 0: the default")
      ->option_text(fmt::format("INT [{}]", default_text("min_leaf_samples")));
  command.add_flag_callback(
      "--prune", [&options] { options.pruning = Pruning::weakest_link; },
      "Undo the splits of the weakest branches first, not the last ones, where fewer leaves predict better");
  command
      .add_option("--cv", options.folds.count,
                  "Folds of the held-out error by which everything is chosen, 0: keep the tree as grown")
      ->capture_default_str();
  command.add_flag("--contiguous", arguments.contiguous,
                   "Folds are blocks of consecutive rows (measured paths, grids, time series)");
  command.add_option("--seed", options.folds.seed, "Of the random folds")->capture_default_str();
  command.add_option("--threads", options.max_threads, "0: all; the result does not depend on it")
      ->capture_default_str();
  refuse_retired_options(command);
}

}  // namespace llmt::apps
