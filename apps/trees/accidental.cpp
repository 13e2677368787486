#include "trees/accidental.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <string_view>
#include <utility>

#include "llmt/options.hpp"
#include "report/table/named_inputs.hpp"
#include "shared/cli.hpp"

namespace llmt::apps {
namespace {

using report::AccidentalInput;

bool is_among(const std::vector<std::string>& names, const std::string& name) {
  return std::ranges::find(names, name) != names.end();
}

// Whether an option of a column names an input, --monotone for example, perhaps with a sign.
bool is_named(const LearningArguments& arguments, const std::string& name) {
  return std::ranges::any_of(arguments.columns, [&](const auto& option) {
    return is_among(option.second, name) || is_among(option.second, "-" + name);
  });
}

// The option that takes a column for categories all the same.
const char* asking_option(const LearningArguments& arguments) {
  return is_arrow_file(arguments.data) ? "--inputs" : "--categorical";
}

// `count`: "30", how many different words there are. `option`: asking_option().
void say_left_out(const std::string& name, bool dates, std::string_view count, Eigen::Index rows, const char* option) {
  warn(fmt::format(
      "llmt: column \"{}\" has {}, {} different ones in {} rows, and is left out; {}{} takes it for categories", name,
      dates ? "dates" : "words", count, rows, dates ? "give a number, as days; " : "", option));
}

void say_of_words(const AccidentalInput& found, const std::string& name, std::size_t words, Eigen::Index rows,
                  const char* option) {
  const bool dates = found.kind == AccidentalInput::Kind::dates;
  if (found.kind == AccidentalInput::Kind::unit) {
    warn(fmt::format(
        "llmt: column \"{}\": every cell is {}, and is taken for categories; write the numbers alone to have "
        "numbers, {} says that categories are meant",
        name, found.detail, option));
  } else if (found.is_left_out) {
    say_left_out(name, dates, fmt::format("{}", words), rows, option);
  } else {
    const std::string advice =
        dates ? fmt::format(
                    "it looks like a date: leave it out (--ignore {}) or give a number, as days; {} says that "
                    "categories are meant",
                    name, option)
              : fmt::format("--ignore leaves it out, {} says that it is meant", option);
    warn(fmt::format("llmt: column \"{}\" has words, {} different ones in {} rows, and is taken for categories; {}",
                     name, words, rows, advice));
  }
}

// Takes columns away, which are given in ascending order.
void leave_out(const std::vector<int>& columns, std::vector<std::string>& names, report::InputColumns& inputs) {
  if (columns.empty()) return;
  std::vector<int> kept;
  for (int column = 0; column < static_cast<int>(names.size()); ++column) {
    if (!std::ranges::binary_search(columns, column)) kept.push_back(column);
  }
  inputs.values = inputs.values(Eigen::all, kept).eval();
  std::erase_if(inputs.beyond_limit,
                [&](const report::ManyWords& many) { return std::ranges::binary_search(columns, many.column); });
  for (report::ManyWords& many : inputs.beyond_limit) {
    many.column = static_cast<int>(std::ranges::lower_bound(kept, many.column) - kept.begin());
  }
  for (std::size_t k = 0; k < kept.size(); ++k) {
    names[k] = names[static_cast<std::size_t>(kept[k])];
    inputs.levels[k] = inputs.levels[static_cast<std::size_t>(kept[k])];
  }
  names.resize(kept.size());
  inputs.levels.resize(kept.size());
  inputs.categorical.clear();
  for (std::size_t k = 0; k < kept.size(); ++k) {
    if (!inputs.levels[k].empty()) inputs.categorical.push_back(static_cast<int>(k));
  }
}

}  // namespace

void leave_out_accidental(const LearningArguments& arguments, std::vector<std::string>& names,
                          report::InputColumns& inputs) {
  if (!arguments.inputs.empty()) return;
  std::vector<AccidentalInput> accidental = report::accidental_inputs(inputs);
  std::vector<int> left_out;
  for (AccidentalInput& found : accidental) {
    const std::string& name = names[found.input];
    found.is_left_out = found.is_left_out && !is_named(arguments, name) && !is_among(arguments.categorical, name);
    if (found.is_left_out) left_out.push_back(found.input);
  }
  if (left_out.size() == names.size()) {
    left_out.clear();
    for (AccidentalInput& found : accidental) found.is_left_out = false;
  }
  const auto has_too_many = [&](int input) { return std::cmp_greater(inputs.levels[input].size(), most_categories); };
  const char* const option = asking_option(arguments);
  for (const AccidentalInput& found : accidental) {
    const std::string& name = names[found.input];
    if (found.kind == AccidentalInput::Kind::row_numbers) {
      warn(fmt::format("llmt: column \"{}\" numbers the rows and is an input; --ignore leaves it out", name));
    } else if (is_among(arguments.categorical, name) || (!found.is_left_out && has_too_many(found.input))) {
      continue;
    } else if (found.kind == AccidentalInput::Kind::far_value) {
      warn(fmt::format("llmt: column \"{}\": {}; if they stand for missing values, empty these cells", name,
                       found.detail));
    } else {
      say_of_words(found, name, inputs.levels[found.input].size(), inputs.values.rows(), option);
    }
  }
  std::ranges::sort(left_out);
  leave_out(left_out, names, inputs);
}

std::vector<std::string> without_accidental_words(const LearningArguments& arguments, std::vector<std::string> names,
                                                  const TableFiles& table, std::size_t most) {
  if (!arguments.inputs.empty()) return names;
  std::vector<std::string> kept;
  std::vector<std::pair<std::string, std::string>> left_out;  // names, and how many different words
  std::vector<bool> are_dates;
  for (const std::string& name : names) {
    kept.push_back(name);
    if (!table.has_text(name) || is_named(arguments, name)) continue;
    const TableFiles::DifferentWords found = table.different_words(name, most);
    const bool dates = report::are_dates(found.words);
    const auto rule = report::accidental_words(found.words, table.rows());
    if (found.are_all ? !rule || !rule->is_left_out : !dates) {
      if (found.are_all && rule) say_of_words(*rule, name, found.words.size(), table.rows(), asking_option(arguments));
      continue;
    }
    kept.pop_back();
    left_out.emplace_back(
        name, fmt::format("{}{}", found.are_all ? "" : "more than ", found.are_all ? found.words.size() : most));
    are_dates.push_back(dates);
  }
  if (kept.empty()) return names;
  for (std::size_t k = 0; k < left_out.size(); ++k) {
    say_left_out(left_out[k].first, are_dates[k], left_out[k].second, table.rows(), asking_option(arguments));
  }
  return kept;
}

}  // namespace llmt::apps
