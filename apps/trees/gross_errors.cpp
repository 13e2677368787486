#include "trees/gross_errors.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "llmt/outliers.hpp"
#include "report/fit/gross_errors.hpp"
#include "shared/cli.hpp"

namespace llmt::apps {
namespace {

constexpr std::size_t most_lines_named = 5;

}  // namespace

void warn_of_gross_errors(const LearningArguments& arguments, const LearningTable& table, const FitResult& result) {
  if (table.options.loss != Loss::squared) return;
  // The user has been told of these.
  const auto has_dominant_rows = [&](Eigen::Index o) {
    return !dominant_rows_of_target(table.data->outputs.col(o), table.data->weights).rows.empty();
  };
  for (Eigen::Index o = 0; o < table.data->outputs.cols(); ++o) {
    const report::GrossErrors gross = report::gross_errors(*table.data, result, o, table.options.max_threads);
    if (gross.rows.empty() || has_dominant_rows(o)) continue;
    const bool one = gross.rows.size() == 1;
    std::string places;
    for (std::size_t k = 0; k < std::min(gross.rows.size(), most_lines_named); ++k) {
      const Eigen::Index row = gross.rows[k];
      places += fmt::format("{}{} ({:.4g})", k == 0 ? "" : ", ", table.lines[row], table.data->outputs(row, o));
    }
    warn(fmt::format(
        "llmt: {} of {} held-out rows {} {:.0f} % of the held-out squared error of \"{}\": {} {}{}. If {}, correct {} "
        "or use --loss tukey, which leaves such rows out",
        gross.rows.size(), gross.held_out, one ? "carries" : "carry", 100.0 * gross.share,
        arguments.targets[static_cast<std::size_t>(o)], one ? "line" : "lines", places,
        gross.rows.size() > most_lines_named ? " and more" : "",
        one ? "this target is a mistake" : "these targets are mistakes", one ? "it" : "them"));
  }
}

}  // namespace llmt::apps
