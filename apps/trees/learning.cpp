#include "trees/learning.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <map>
#include <numeric>
#include <stdexcept>
#include <string_view>
#include <utility>

#include "llmt/arrow.hpp"
#include "llmt/csv.hpp"
#include "shared/cli.hpp"
#include "shared/help.hpp"
#include "shared/options.hpp"
#include "shared/table_file.hpp"
#include "trees/accidental.hpp"
#include "trees/arrow_learning.hpp"

namespace llmt::apps {
namespace {

bool contains(const std::vector<std::string>& names, const std::string& name) {
  return std::ranges::find(names, name) != names.end();
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
void look_for_dominant_rows(const Csv& csv, const LearningArguments& arguments,
                            const report::LearningColumns& columns) {
  if (arguments.options.loss != Loss::squared) return;
  for (std::size_t o = 0; o < arguments.targets.size(); ++o) {
    const Eigen::VectorXd target = columns.targets.col(o);
    const DominantRows dominant = dominant_rows_of_target(target, columns.weights);
    if (dominant.rows.empty()) continue;
    const std::string& name = arguments.targets[o];
    if (dominant.hide_the_others) {
      throw std::runtime_error(fmt::format(
          "{}:{}: column \"{}\": {:.6g} is so large that the differences between all other values are below its "
          "rounding error; correct it, delete the line, or use --loss tukey",
          csv.name(), csv.line_of(dominant.rows.front()), name, target(dominant.rows.front())));
    }
    warn(fmt::format(
        "llmt: {} of {} rows {} {:.3g} % of the squares of \"{}\" about its median: {}. If they are mistakes, correct "
        "them or use --loss tukey",
        dominant.rows.size(), target.size(), dominant.rows.size() == 1 ? "carries" : "carry", 100.0 * dominant.share,
        name, places_of(csv, dominant.rows, target)));
  }
}

// Says where one row or a constant target leaves nothing to learn.
void look_for_nothing_to_learn(const Csv& csv, const LearningArguments& arguments,
                               const report::LearningColumns& columns) {
  if (csv.rows() == 1) {
    warn(fmt::format("llmt: {} has one row: the model is the target of that row everywhere", csv.name()));
    return;
  }
  for (std::size_t o = 0; o < arguments.targets.size(); ++o) {
    const auto target = columns.targets.col(static_cast<Eigen::Index>(o));
    if (target.minCoeff() < target.maxCoeff()) continue;
    warn(fmt::format("llmt: target \"{}\" is {} in every row: the model is that constant", arguments.targets[o],
                     target(0)));
  }
}

// Says which words are taken for missing values. NA may be a country.
void say_what_is_taken_as_missing(const std::vector<std::string>& names, const report::InputColumns& inputs) {
  for (const report::MarkedCells& cells : inputs.marked) {
    const bool is_alone = inputs.marked.size() == 1 && !inputs.has_other_marks;
    warn(fmt::format("llmt: {} cell{} {} of {} {} taken as missing{}; --categorical {} takes {} for a word",
                     cells.count, cells.count == 1 ? "" : "s", cells.text, names[cells.column],
                     cells.count == 1 ? "is" : "are", is_alone ? "; other columns have none" : "", names[cells.column],
                     cells.text));
  }
}

}  // namespace

DominantRows dominant_rows_of_target(const Eigen::Ref<const Eigen::VectorXd>& target, const Eigen::VectorXd& weights) {
  if (weights.size() == 0) return dominant_rows(target);
  return dominant_rows((weights.array() > 0.0).select(target, robust_scale(target).median));
}

void require_target(const LearningArguments& arguments) {
  if (!arguments.targets.empty()) return;
  const Csv csv = read_table(arguments.data, arguments.mark, arguments.thousands);
  throw std::invalid_argument(fmt::format("--target is required: what to predict; the columns of {} are {}", csv.name(),
                                          csv_row(csv.columns())));
}

std::vector<std::string> choose_inputs(const Csv& csv, const LearningArguments& arguments) {
  for (const std::vector<std::string>* names : {&arguments.targets, &arguments.inputs, &arguments.ignored}) {
    for (const std::string& name : *names) {
      csv.index_of(name);
      if (std::count(names->begin(), names->end(), name) > 1) {
        throw std::invalid_argument(fmt::format("column \"{}\" is named twice", name));
      }
    }
  }
  for (const std::string& target : arguments.targets) {
    if (contains(arguments.ignored, target)) {
      throw std::invalid_argument(fmt::format("column \"{}\" is a target and ignored", target));
    }
    if (target == arguments.weight) {
      throw std::invalid_argument(fmt::format("column \"{}\" is a target and the weight", target));
    }
    if (target == arguments.groups) {
      throw std::invalid_argument(fmt::format("column \"{}\" is a target and says the groups", target));
    }
  }
  if (!arguments.groups.empty()) csv.index_of(arguments.groups);
  const auto is_free = [&](const std::string& column) {
    return !contains(arguments.targets, column) && !contains(arguments.ignored, column) && column != arguments.weight &&
           column != arguments.groups;
  };
  std::vector<std::string> inputs;
  for (const std::string& column : arguments.inputs.empty() ? csv.columns() : arguments.inputs) {
    if (is_free(column)) {
      inputs.push_back(column);
    } else if (!arguments.inputs.empty()) {
      throw std::invalid_argument(
          fmt::format("--inputs has \"{}\", which is a target, the weight, the groups or ignored", column));
    }
  }
  if (inputs.empty()) throw std::invalid_argument("no column is left to learn from");
  return inputs;
}

std::vector<std::string> choose_inputs(const std::vector<std::string>& columns, const std::string& name,
                                       const LearningArguments& arguments) {
  std::string header;
  for (const std::string& column : columns) header += (header.empty() ? "" : ",") + csv_field(column);
  const Csv csv = Csv::parse(header + "\n", name);
  if (!arguments.weight.empty()) csv.index_of(arguments.weight);
  return choose_inputs(csv, arguments);
}

namespace {

// A number for each row, the same for equal words in the column.
std::vector<double> group_numbers(const Csv& csv, const std::string& column) {
  if (column.empty()) return {};
  const std::vector<std::string> words = csv.texts(column);
  std::map<std::string_view, double> seen;
  std::vector<double> numbers;
  for (std::size_t row = 0; row < words.size(); ++row) {
    if (words[row].empty()) {
      throw std::runtime_error(fmt::format("{}: line {}: column \"{}\" says the groups of --groups and is empty",
                                           csv.name(), csv.line_of(static_cast<Eigen::Index>(row)), column));
    }
    numbers.push_back(seen.try_emplace(words[row], static_cast<double>(seen.size())).first->second);
  }
  return numbers;
}

std::vector<Eigen::Index> lines_of_rows(const Csv& csv) {
  std::vector<Eigen::Index> rows(csv.rows());
  std::iota(rows.begin(), rows.end(), Eigen::Index{0});
  return csv.lines_of(rows);
}

}  // namespace

LearningTable read_learning_table(const LearningArguments& arguments) {
  if (is_arrow_file(arguments.data)) return read_arrow_learning_table(arguments);
  const Csv csv = read_table(arguments.data, arguments.mark, arguments.thousands);
  if (csv.rows() == 0) {
    throw std::runtime_error(fmt::format("{}: there is a header and no rows", csv.name()));
  }
  std::vector<std::string> inputs = choose_inputs(csv, arguments);
  const report::ColumnAdvice advice{
      .leave_out = arguments.inputs.empty() ? " (--ignore COLUMN leaves a column out)" : "",
      .as_categories = "--categorical"};
  const double largest_input = arguments.options.terms == LocalTerms::quadratic ? largest_factor : largest_magnitude;
  report::LearningColumns columns =
      report::read_learning_columns(csv, {inputs, arguments.categorical, arguments.targets, arguments.weight}, advice,
                                    largest_input, arguments.options.max_threads);
  look_for_dominant_rows(csv, arguments, columns);
  say_what_is_taken_as_missing(inputs, columns.inputs);
  leave_out_accidental(arguments, inputs, columns.inputs);
  for (const report::ManyWords& many : columns.inputs.beyond_limit) {
    csv.refuse(many.row, inputs[many.column],
               fmt::format("more than {} categories{}", most_categories, advice.leave_out));
  }
  look_for_nothing_to_learn(csv, arguments, columns);
  LearningTable table{nullptr, arguments.options, lines_of_rows(csv)};
  FitOptions& options = table.options;
  set_columns(arguments.columns, inputs, columns.inputs.levels, options);
  TrainingData data{.inputs = std::move(columns.inputs.values), .outputs = std::move(columns.targets)};
  data.weights = std::move(columns.weights);
  data.groups = group_numbers(csv, arguments.groups);
  data.levels = std::move(columns.inputs.levels);
  data.may_have_codes = arguments.may_have_codes;
  data.input_names = inputs;
  data.output_names = arguments.targets;
  table.data = std::make_shared<const TrainingData>(std::move(data));
  return table;
}

void add_learning_options(CLI::App& command, LearningArguments& arguments) {
  add_input_file(command, "data", arguments.data, "CSV file with a header row; - is standard input")->required();
  add_names(command, "-t,--target", arguments.targets, "COLUMN", "What to predict (required)");
  add_names(command, "--inputs", arguments.inputs, "COLUMN", "What to learn from [all but targets and ignored]");
  add_names(command, "--ignore", arguments.ignored, "COLUMN", "What to leave out");
  add_names(command, "--categorical", arguments.categorical, "COLUMN",
            "Inputs that are categories although they are written as numbers; columns of words are anyway. In a named "
            "column NA, null and the like are words, and only an empty cell is missing");
  command.add_option("--weight", arguments.weight, "The weights of the rows [1 for each]")->type_name("COLUMN");
  command
      .add_option("--groups", arguments.groups,
                  "What rows belong to, such as a machine or a day: rows of one group are held out together")
      ->type_name("COLUMN");
  add_decimal_comma(command, arguments.mark);
  add_thousands(command, arguments.thousands);
  command
      .add_flag_callback(
          "--no-codes", [&arguments] { arguments.may_have_codes = false; },
          "Do not take inputs of few whole numbers for categories where that lowers the held-out error")
      ->group(expert_options);
}

}  // namespace llmt::apps
