#include "report/terms/terms_summary.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <set>

#include "report/terms/term_text.hpp"

namespace llmt::report {
namespace {

using discovery::Answer;
using discovery::FoundTerm;
using discovery::Missing;

std::string found_text(const Missing& missing) {
  std::string text;
  int place = 0;
  for (const FoundTerm& found : missing.found) {
    text += fmt::format("\n{}. {}: without it {:.0f} % of what is explained would be lost{}\n", ++place,
                        title_of(found, missing.gaps.size() > 1), 100.0 * found.share,
                        found.generic     ? ""
                        : found.confirmed ? ", confirmed"
                                          : ", tentative");
    if (found.generic) {
      text += "   no term that was tried has this shape; the corrected simulation follows it as measured\n";
      continue;
    }
    // Formulas of several coefficients name them.
    const std::string factor = found.coefficients.size() == 1 ? found.values.front().name + " * " : "";
    text += fmt::format("   add to {}: {}{}\n", found.output, factor, found.formula);
    for (const discovery::TermValue& value : found.values) text += "   " + value_text(value) + "\n";
    if (found.coefficients.size() == 2) {
      text += fmt::format("   amplitude sqrt(C^2 + S^2) = {} {}\n", number(found.coefficients.norm()), found.output);
    }
    if (!found.shrinks_gap) text += "   on the rows set aside it does not help\n";
    for (const discovery::RivalTerms& rival : found.rivals) {
      text += fmt::format("   or instead {}: {}\n", rival.what,
                          rival.exact ? "the same at every row, these rows cannot tell" : "explains as well");
    }
  }
  return text;
}

std::string gaps_text(const Missing& missing, std::size_t width) {
  const std::string head =
      missing.held_out.empty()
          ? "\nNo rows were set aside: the gap cannot be verified.\n"
          : fmt::format("\nGap on the {} rows set aside, root mean square{}:\n", missing.held_out.size(),
                        missing.time.rows_per_sample > 1 ? " of the means" : "");
  Table table({"output", "before", "after", "noise floor"});
  for (const discovery::Gap& gap : missing.gaps) {
    table.add({gap.output, number(gap.before), number(gap.after), number(gap.noise_floor)});
  }
  return head + table.text(width) +
         (missing.floor_from_repeats ? "The noise floor comes from rows of equal inputs.\n"
                                     : "Too few rows have equal inputs to measure the noise: the error left over was "
                                       "used as the noise floor.\n");
}

std::string regions_text(const std::vector<GapRegion>& regions, std::size_t width) {
  Table table({"output", "mean |gap|", "rows", "where"});
  for (const GapRegion& region : regions) {
    table.add({region.output, number(region.mean_gap, 3), fmt::format("{}", region.rows), region.conditions});
  }
  return "\nWhere the gap is, before anything is added:\n" + table.text(width);
}

std::string visible_text(const Missing& missing, std::size_t width) {
  constexpr std::size_t shown = 12;
  Table table({"term", "coefficient", "rms on the output"});
  std::set<std::string> families;
  for (const discovery::VisibleTerm& term : missing.visible) {
    // The most visible of each family says enough.
    if (!families.insert(term.what.substr(0, term.what.find(' '))).second || families.size() > shown) continue;
    table.add({term.what, number(term.coefficient, 2), number(term.rms, 2)});
  }
  return "\nSmallest terms that would have been found (9 times of 10):\n" + table.text(width);
}

bool is_exact(const Missing& missing) {
  return std::ranges::all_of(missing.gaps, [](const discovery::Gap& gap) { return gap.before == 0.0; }) &&
         missing.found.empty();
}

}  // namespace

std::string terms_text(const TermsSummary& summary, std::size_t width) {
  const Missing& missing = summary.missing;
  std::string text;
  text += fmt::format("{} against {}: {} rows, inputs {}\n", summary.simulated, summary.measured, summary.rows,
                      fmt::join(summary.inputs, ", "));
  text += fmt::format("{} rows set aside (seed {}), {} searched, {} candidate terms, {} {} of search\n",
                      missing.held_out.size(), summary.seed, missing.searched.size(), missing.candidates.size(),
                      missing.rounds, missing.rounds == 1 ? "round" : "rounds");
  if (missing.time.in_time) text += time_text(missing.time, summary.time.empty() ? "rows" : "of " + summary.time);
  text += fmt::format("\nVERDICT: {}\n", headline(missing));
  if (is_exact(missing)) {
    text += "The simulation gives the measured values exactly: there is no gap to explain.\n";
    return text;
  }
  text += fmt::format("Evidence: {} raise the score by {}; in noise alone 997 of 1000 searches stay below {}.\n",
                      missing.found.empty() ? "the best terms" : "the terms", number(missing.verdict.score_gain, 3),
                      number(missing.verdict.threshold, 3));
  text += found_text(missing);
  for (const discovery::Structure& left : missing.structure) {
    text += fmt::format(
        "\nNot explained: rows of similar {} have similar errors of {}; {:.0f} % of what can be explained "
        "(in noise p = "
        "{:.1g}).\n",
        fmt::join(left.inputs, ", "), left.output, 100.0 * left.share, left.p_value);
  }
  for (const std::string& note : missing.notes) text += fmt::format("\nNote: {}.\n", note);
  for (std::size_t k = 0; k < missing.parameters.size(); ++k) {
    const discovery::Parameter& parameter = missing.parameters[k];
    if (!parameter.free) continue;
    text += fmt::format("\n{} of the simulation adjusted to {} +- {}\n", parameter.name, number(parameter.value),
                        number(missing.standard_errors(k), 2));
  }
  text += gaps_text(missing, width);
  text += regions_text(summary.regions, width);
  if (!missing.outliers.empty()) {
    const std::vector<Eigen::Index>& lines = summary.outlier_lines;
    text += fmt::format("\nOutliers, left out of the fit: {}{} {} of {}\n", summary.counted,
                        lines.size() == 1 ? "" : "s", fmt::join(lines, ", "), summary.measured);
  }
  const discovery::LackOfFit& lack = missing.verdict.lack_of_fit;
  constexpr double surprising = 0.01;
  if (lack.dof > 0 && lack.p_value < surprising) {
    text +=
        fmt::format("\nThe scatter that is left exceeds that of rows of equal inputs (p = {:.2g}).\n", lack.p_value);
  }
  if (missing.answer == Answer::nothing_missing) text += visible_text(missing, width);
  if (!missing.not_testable.empty()) {
    text += "\nNot testable with these rows:\n";
    for (const discovery::UntestableCause& entry : missing.not_testable)
      text += fmt::format("  {}: {}\n", entry.what, entry.why);
  }
  if (!missing.failing_rows.empty()) {
    text += fmt::format("\nThe error on the rows set aside grows most at {} {} of {}.\n",
                        summary.failing_lines.size() == 1 ? summary.counted : summary.counted + "s",
                        fmt::join(summary.failing_lines, ", "), summary.measured);
    if (!summary.corrected.empty()) text += fmt::format("{} was not written: it would be worse.\n", summary.corrected);
    return text;
  }
  if (!summary.corrected.empty()) text += fmt::format("\nCorrected simulation written to {}\n", summary.corrected);
  return text;
}

}  // namespace llmt::report
