#include "llmt/learning.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <stdexcept>
#include <utility>

#include "llmt/csv.hpp"
#include "llmt/outliers.hpp"
#include "llmt/retired_options.hpp"
#include "shared/cli.hpp"
#include "shared/options.hpp"

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

constexpr std::size_t named_rows = 5;

// "lines 13 (5.3e+03), 57 (-4e+03)".
std::string places_of(const Csv& csv, const std::vector<Eigen::Index>& rows, const Eigen::VectorXd& target) {
  std::string text = rows.size() == 1 ? "line " : "lines ";
  for (std::size_t k = 0; k < std::min(rows.size(), named_rows); ++k) {
    text += fmt::format("{}{} ({:.4g})", k == 0 ? "" : ", ", csv.line_of(rows[k]), target(rows[k]));
  }
  return rows.size() > named_rows ? text + ", ..." : text;
}

// Says which few rows decide a fit by squares. Refuses a value beside which all others are rounding errors.
void look_for_heavy_rows(const Csv& csv, const LearningArguments& arguments, const LearningColumns& columns) {
  if (arguments.options.loss != Loss::squared) return;
  for (std::size_t o = 0; o < arguments.targets.size(); ++o) {
    Eigen::VectorXd target = columns.targets.col(o);
    if (columns.weights.size() > 0) {
      target = (columns.weights.array() > 0.0).select(target, bulk_of(target).centre);
    }
    const HeavyRows heavy = heavy_rows(target);
    if (heavy.rows.empty()) continue;
    const std::string& name = arguments.targets[o];
    if (heavy.hide_the_others) {
      throw std::runtime_error(fmt::format(
          "{}:{}: column \"{}\": {:.6g} is so large that the differences between all other values are below its "
          "rounding error; correct it, leave the row out, or use --loss tukey",
          arguments.data, csv.line_of(heavy.rows.front()), name, target(heavy.rows.front())));
    }
    warn(fmt::format(
        "llmt: {} of {} rows {} {:.3g} % of the squares of \"{}\" about its median: {}. If they are mistakes, correct "
        "them or use --loss tukey",
        heavy.rows.size(), target.size(), heavy.rows.size() == 1 ? "carries" : "carry", 100.0 * heavy.share, name,
        places_of(csv, heavy.rows, target)));
  }
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
  return inputs;
}

LearningTable read_learning_table(const LearningArguments& arguments) {
  const Csv csv = Csv::read(arguments.data);
  if (csv.rows() == 0) {
    throw std::runtime_error(fmt::format("{}: there is a header and no rows", arguments.data));
  }
  const std::vector<std::string> inputs = choose_inputs(csv, arguments);
  const std::string hint = arguments.inputs.empty() ? " (--ignore COLUMN leaves a column out)" : "";
  const double largest_input = arguments.options.terms == LocalTerms::quadratic ? largest_factor : largest_magnitude;
  LearningColumns columns =
      read_learning_columns(csv, {inputs, arguments.categorical, arguments.targets, arguments.weight}, hint,
                            largest_input, arguments.options.max_threads);
  look_for_heavy_rows(csv, arguments, columns);
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
  add_input_file(command, "data", arguments.data, "CSV file with a header row")->required();
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
  command.add_flag_callback(
      "--all-inputs", [&options] { options.choose_inputs = false; },
      "Keep inputs that do not lower the held-out error");
  command.add_flag_callback(
      "--no-codes", [&options] { options.choose_codes = false; },
      "Do not take inputs of few whole numbers for categories where that lowers the held-out error");
  command
      .add_option("--monotone", arguments.monotone,
                  "Inputs with which the prediction never falls, or with a leading minus never rises (--monotone=-x)")
      ->delimiter(',');
  command
      .add_option("--slope-sign", arguments.slope_signs,
                  "Inputs with slopes >= 0, or with a leading minus <= 0, in every local model; not across leaves")
      ->delimiter(',');
  add_count(command, "--max-leaves", options.max_leaves, Eigen::Index{0}, "Most leaves of a tree; 0: the default")
      ->option_text(fmt::format("COUNT [{}]", default_text("max_leaves")));
  add_count(command, "--min-leaf", options.min_leaf_samples, Eigen::Index{0}, "Fewest rows in a leaf; 0: the default")
      ->option_text(fmt::format("COUNT [{}]", default_text("min_leaf_samples")));
  command.add_flag_callback(
      "--prune", [&options] { options.pruning = Pruning::weakest_link; },
      "Undo the splits of the weakest branches first, not the last ones, where fewer leaves predict better");
  add_count(command, "--cv", options.folds.count, 0,
            "Folds of the held-out error by which everything is chosen, 0: keep the tree as grown")
      ->capture_default_str();
  command.add_flag("--contiguous", arguments.contiguous,
                   "Folds are blocks of consecutive rows (measured paths, grids, time series)");
  add_seed(command, options.folds.seed, "Of the random folds");
  add_threads(command, options.max_threads);
  refuse_retired_options(command);
}

}  // namespace llmt::apps
