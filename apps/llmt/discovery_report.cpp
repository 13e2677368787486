#include "llmt/discovery_report.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <set>

#include "report/term_text.hpp"

namespace llmt::apps {
namespace {

using discovery::Answer;
using discovery::FoundTerm;
using discovery::Missing;

void print_found(const Missing& missing) {
  int place = 0;
  for (const FoundTerm& found : missing.found) {
    print(fmt::format("\n{}. {}: without it {:.0f} % of what is explained would be lost{}\n", ++place,
                      title_of(found, missing.gaps.size() > 1), 100.0 * found.share,
                      found.generic     ? ""
                      : found.confirmed ? ", confirmed"
                                        : ", tentative"));
    if (found.generic) {
      print("   no term that was tried has this shape; the corrected simulation follows it as measured\n");
      continue;
    }
    // Formulas of several coefficients name them.
    const std::string factor = found.coefficients.size() == 1 ? found.values.front().name + " * " : "";
    print(fmt::format("   add to {}: {}{}\n", found.output, factor, found.formula));
    for (const discovery::TermValue& value : found.values) print("   " + value_text(value) + "\n");
    if (found.coefficients.size() == 2) {
      print(fmt::format("   amplitude sqrt(C^2 + S^2) = {} {}\n", number(found.coefficients.norm()), found.output));
    }
    for (const discovery::RivalTerms& rival : found.rivals) {
      print(fmt::format("   or instead {}: {}\n", rival.what,
                        rival.exact ? "the same at every row, these rows cannot tell" : "explains as well"));
    }
  }
}

void print_gaps(const DiscoveryReport& report) {
  const Missing& missing = report.missing;
  if (missing.held_out.empty()) {
    print("\nNo rows were set aside: the gap cannot be verified.\n");
  } else {
    print(fmt::format("\nGap on the {} rows set aside, root mean square:\n", missing.held_out.size()));
  }
  Table table({"output", "before", "after", "noise floor"});
  for (const discovery::Gap& gap : missing.gaps) {
    table.add({gap.output, number(gap.before), number(gap.after), number(gap.noise_floor)});
  }
  print(table.text());
  print(
      missing.floor_from_repeats
          ? "The noise floor comes from rows of equal inputs.\n"
          : "Too few rows have equal inputs to measure the noise: the error left over was used as the noise floor.\n");
}

void print_regions(const DiscoveryReport& report) {
  print("\nWhere the gap is, before anything is added:\n");
  Table table({"output", "mean |gap|", "rows", "where"});
  for (const GapRegion& region : report.regions) {
    table.add({region.output, number(region.mean_gap, 3), fmt::format("{}", region.rows), region.conditions});
  }
  print(table.text());
}

void print_visible(const Missing& missing) {
  constexpr std::size_t shown = 12;
  print("\nSmallest terms that would have been found (9 times of 10):\n");
  Table table({"term", "coefficient", "rms on the output"});
  std::set<std::string> families;
  for (const discovery::VisibleTerm& term : missing.visible) {
    // The most visible of each family says enough.
    if (!families.insert(term.what.substr(0, term.what.find(' '))).second || families.size() > shown) continue;
    table.add({term.what, number(term.coefficient, 2), number(term.rms, 2)});
  }
  print(table.text());
}

bool is_exact(const Missing& missing) {
  return std::ranges::all_of(missing.gaps, [](const discovery::Gap& gap) { return gap.before == 0.0; }) &&
         missing.found.empty();
}

}  // namespace

void print_report(const DiscoveryReport& report) {
  const Missing& missing = report.missing;
  print(fmt::format("{} against {}: {} rows, inputs {}\n", report.simulated, report.measured, report.rows,
                    fmt::join(report.inputs, ", ")));
  print(fmt::format("{} rows set aside (seed {}), {} searched, {} candidate terms, {} {} of search\n",
                    missing.held_out.size(), report.seed, missing.searched.size(), missing.candidates.size(),
                    missing.rounds, missing.rounds == 1 ? "round" : "rounds"));
  print(fmt::format("\nVERDICT: {}\n", headline(missing)));
  if (is_exact(missing)) {
    print("The simulation gives the measured values exactly: there is no gap to explain.\n");
    return;
  }
  print(fmt::format("Evidence: {} raise the score by {}; in noise alone 997 of 1000 searches stay below {}.\n",
                    missing.found.empty() ? "the best terms" : "the terms", number(missing.verdict.score_gain, 3),
                    number(missing.verdict.threshold, 3)));
  print_found(missing);
  for (const discovery::Structure& left : missing.structure) {
    print(
        fmt::format("\nNot explained: rows of similar {} have similar errors of {}; {:.0f} % of what can be explained "
                    "(in noise p = "
                    "{:.1g}).\n",
                    fmt::join(left.inputs, ", "), left.output, 100.0 * left.share, left.p_value));
  }
  for (const std::string& note : missing.notes) print(fmt::format("\nNote: {}.\n", note));
  for (std::size_t k = 0; k < missing.parameters.size(); ++k) {
    const discovery::Parameter& parameter = missing.parameters[k];
    if (!parameter.free) continue;
    print(fmt::format("\n{} of the simulation adjusted to {} +- {}\n", parameter.name, number(parameter.value),
                      number(missing.standard_errors(k), 2)));
  }
  print_gaps(report);
  print_regions(report);
  if (!missing.outliers.empty()) {
    const std::vector<Eigen::Index>& lines = report.outlier_lines;
    print(fmt::format("\nOutliers, left out of the fit: {} {} of {}\n", lines.size() == 1 ? "line" : "lines",
                      fmt::join(lines, ", "), report.measured));
  }
  const discovery::LackOfFit& lack = missing.verdict.lack_of_fit;
  constexpr double surprising = 0.01;
  if (lack.dof > 0 && lack.p_value < surprising) {
    print(fmt::format("\nThe scatter that is left exceeds that of rows of equal inputs (p = {:.2g}).\n", lack.p_value));
  }
  if (missing.answer == Answer::nothing_missing) print_visible(missing);
  if (!missing.not_testable.empty()) {
    print("\nNot testable with these rows:\n");
    for (const discovery::UntestableCause& entry : missing.not_testable)
      print(fmt::format("  {}: {}\n", entry.what, entry.why));
  }
  if (!report.corrected.empty()) print(fmt::format("\nCorrected simulation written to {}\n", report.corrected));
}

}  // namespace llmt::apps
