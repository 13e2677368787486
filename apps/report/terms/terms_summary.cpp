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
  for (std::size_t k = 0; k < missing.found.size(); ++k) {
    const FoundTerm& found = missing.found[k];
    text += fmt::format("\n{}. {}{}: without it the other terms would explain {:.0f} % less\n", k + 1,
                        title_of(found, missing.gaps.size() > 1),
                        found.generic     ? ""
                        : found.confirmed ? ", confirmed"
                                          : ", tentative",
                        100.0 * found.share);
    for (const discovery::Objection& objection : missing.objections) {
      const bool is_against_it = std::ranges::find(objection.terms, k) != objection.terms.end();
      if (is_against_it && objection.reason != discovery::Reason::shape) {
        text += fmt::format("   tentative because {}\n", discovery::to_string(objection.reason));
      }
    }
    if (found.generic) {
      text += "   no term that was tried has this shape; the corrected simulation follows it as measured\n";
      continue;
    }
    // Formulas of several coefficients name them.
    const std::string factor = found.coefficients.size() == 1 && !found.whole ? found.values.front().name + " * " : "";
    text += fmt::format("   add to {}: {}{}\n", found.output, factor, found.formula);
    for (const discovery::TermValue& value : found.values) text += "   " + value_text(value) + "\n";
    if (found.coefficients.size() == 2 && found.values.front().name == "C") {
      text += fmt::format("   amplitude sqrt(C^2 + S^2) = {} {}\n", number(found.coefficients.norm()), found.output);
    }
    for (const discovery::RivalTerms& rival : found.rivals) {
      text += fmt::format(
          "   or instead {}: {}\n", rival.what,
          rival.exact ? "beside the other terms it gives the same values at every row" : "explains as well");
    }
  }
  return text;
}

// The noise floor is without outliers; so are the errors beside it.
std::string outliers_aside(const Missing& missing) {
  std::string text;
  for (const discovery::Gap& gap : missing.gaps) {
    if (gap.outliers == 0) continue;
    text += fmt::format("Left out of these figures of {}: {} set aside, far from both simulation and correction.\n",
                        gap.output, gap.outliers == 1 ? "one row" : fmt::format("{} rows", gap.outliers));
  }
  return text;
}

std::string parameters_text(const TermsSummary& summary, std::size_t width) {
  const Missing& missing = summary.missing;
  if (missing.fitted_parameters.empty()) return "";
  // The column of a fit without the terms shows how much such a fit hides of them.
  const bool beside_terms = !missing.found.empty();
  std::vector<std::string> header = {"parameter", "nominal", "fitted", "change", "+-", "unit", "beyond chance"};
  if (beside_terms) header.emplace_back("without terms");
  Table table(header);
  for (const discovery::FittedParameter& fitted : missing.fitted_parameters) {
    const bool known = has_nominal(fitted, summary.without_nominal);
    const auto value = [&](double change) { return known ? number(fitted.nominal + change) : number(change); };
    std::vector<std::string> row = {fitted.name,
                                    known ? number(fitted.nominal) : "unknown",
                                    known ? value(fitted.change) : "unknown",
                                    number(fitted.change),
                                    number(fitted.standard_error, 2),
                                    fitted.unit,
                                    fitted.changed ? "yes" : "no"};
    if (beside_terms) row.push_back(value(fitted.alone));
    table.add(row);
  }
  return fmt::format("\nParameters of the simulation{}:\n{}", beside_terms ? ", fitted together with the terms" : "",
                     table.text(width));
}

std::string gaps_text(const Missing& missing, std::size_t width) {
  const std::string head =
      missing.held_out.empty()
          ? "\nNo rows were set aside: the gap cannot be verified.\n"
          : fmt::format("\nGap on the {} rows set aside, root mean square{}:\n", missing.held_out.size(),
                        missing.time.rows_per_sample > 1 ? " of the means" : "");
  const bool adjusted = !missing.fitted_parameters.empty();
  Table table(adjusted ? std::vector<std::string>{"output", "before", "parameters alone", "with terms", "noise floor"}
                       : std::vector<std::string>{"output", "before", "after", "noise floor"});
  for (const discovery::Gap& gap : missing.gaps) {
    if (adjusted) {
      table.add({gap.output, number(gap.nominal), number(gap.before), number(gap.after), number(gap.noise_floor)});
    } else {
      table.add({gap.output, number(gap.before), number(gap.after), number(gap.noise_floor)});
    }
  }
  return head + table.text(width) +
         (missing.floor_from_repeats
              ? "The noise floor comes from rows of equal inputs.\n"
              : "Too few rows have equal inputs to measure the noise: the noise floor is what is "
                "left on the rows searched.\n") +
         outliers_aside(missing);
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

// Where a term says what a state adds, a model that moves has the state itself.
std::string dynamic_model_text(const TermsSummary& summary) {
  std::vector<std::string> outputs;
  for (const discovery::Gap& gap : summary.missing.gaps) outputs.push_back(gap.output);
  return fmt::format(
      "\nNext: llmt fit {} --target {} --inputs {} --lags auto --time {}{} -o model.json\n"
      "It learns a model that has the state; its poles say how fast the state is.\n",
      summary.measured, fmt::join(outputs, ","), fmt::join(summary.inputs, ","), summary.time,
      summary.group.empty() ? "" : " --groups " + summary.group);
}

}  // namespace

std::string terms_text(const TermsSummary& summary, std::size_t width) {
  const Missing& missing = summary.missing;
  std::string text = fmt::format("VERDICT: {}\n", headline_with_names(missing));
  if (const std::string sentence = gap_sentence(missing); !sentence.empty()) text += sentence + "\n";
  text += fmt::format("\n{} against {}: {} rows, inputs {}\n", summary.simulated, summary.measured, summary.rows,
                      fmt::join(summary.inputs, ", "));
  text += fmt::format("{} rows set aside (seed {}), {} searched, {} candidate terms, {} {} of search\n",
                      missing.held_out.size(), summary.seed, missing.searched.size(), missing.candidates.size(),
                      missing.rounds, missing.rounds == 1 ? "round" : "rounds");
  if (missing.time.in_time) text += time_text(missing.time, summary.time);
  if (is_exact(missing)) {
    text += "The simulation gives the measured values exactly: there is no gap to explain.\n";
    return text;
  }
  const bool only_parameters = missing.answer == Answer::parameters_only;
  if (only_parameters) {
    text += fmt::format("Evidence: the parameters raise the score by {}, their number counted.\n",
                        number(missing.parameter_gain, 3));
  }
  text += fmt::format("{} raise the score by {}; in noise alone 997 of 1000 searches stay below {}.\n",
                      only_parameters         ? "Beside them the best terms"
                      : missing.found.empty() ? "Evidence: the best terms"
                                              : "Evidence: the terms",
                      number(missing.verdict.score_gain, 3), number(missing.verdict.threshold, 3));
  text += found_text(missing);
  for (const discovery::Structure& left : missing.structure) {
    text += fmt::format(
        "\nNot explained: rows of similar {} have similar errors of {}; {:.0f} % of what can be explained "
        "(in noise p = "
        "{:.1g}).\n",
        fmt::join(left.inputs, ", "), left.output, 100.0 * left.share, left.p_value);
  }
  for (const std::string& note : missing.notes) text += fmt::format("\nNote: {}.\n", note);
  text += parameters_text(summary, width);
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
  if (missing.answer == Answer::nothing_missing || only_parameters) text += visible_text(missing, width);
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
  if (missing.answer == Answer::inner_state && !summary.time.empty()) text += dynamic_model_text(summary);
  return text;
}

}  // namespace llmt::report
