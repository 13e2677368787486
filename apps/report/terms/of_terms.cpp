#include "report/terms/of_terms.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cctype>

#include "report/document/figures.hpp"
#include "report/terms/term_text.hpp"
#include "report/text/text.hpp"

namespace llmt::report {
namespace {

using discovery::Missing;

// Bars with a role each, one below the other.
struct Bars {
  std::vector<std::string> names = {};
  Numbers values = {};
  std::vector<std::string> labels = {};
  std::vector<std::string> roles = {};

  void add(const std::string& name, double value, const char* role) {
    names.push_back(name);
    values.push_back(value);
    labels.push_back(number(value, 3));
    roles.emplace_back(role);
  }
  Chart chart(const std::string& title, const std::string& axis) const {
    Chart chart = ranking(title, axis, names, values, labels);
    chart.layers.front().roles = roles;
    return chart;
  }
};

Chart gap_chart(const Missing& missing) {
  Bars bars;
  for (const discovery::Gap& gap : missing.gaps) {
    bars.add(gap.output + ": simulation", gap.before, "before");
    bars.add("with what was found", gap.after, "after");
    bars.add("noise", gap.noise_floor, "floor");
  }
  Chart chart = bars.chart("The gap, before and after", "root mean square of measured - simulated");
  chart.caption =
      fmt::format("{} The noise {}.",
                  missing.held_out.empty() ? "No rows were set aside: this is not verified."
                                           : fmt::format("On {} rows that took no part.", missing.held_out.size()),
                  missing.floor_from_repeats ? "comes from rows of equal inputs" : "is what the terms leave over");
  return chart;
}

// The gap over one input, before and after.
Chart gap_over(const Simulated& of, Eigen::Index input, Eigen::Index output, const std::string& title) {
  constexpr Eigen::Index most_shown = 1500;
  const std::string& name = of.missing.gaps[output].output;
  Layer before{.name = "measured - simulated", .role = "before", .size = 8};
  Layer added{.name = "what was added", .role = "after", .size = 4};
  for (const Eigen::Index row : thinned(of.values.rows(), most_shown)) {
    before.x.push_back(of.inputs.values(row, input));
    before.y.push_back(of.values(row, output) - of.missing.before(row, output));
    added.x.push_back(of.inputs.values(row, input));
    added.y.push_back(of.missing.corrected(row, output) - of.missing.before(row, output));
  }
  return {.title = title,
          .caption = "What was added should run through the middle of the gap." +
                     thinning_note(of.values.rows(), "rows", most_shown),
          .x = {of.inputs.names[input]},
          .y = {fmt::format("{}: gap", name)},
          .layers = {before, added}};
}

// The evidence for each cause that was found and for what could stand in its place.
Json evidence_chart(const Missing& missing) {
  Bars bars;
  for (const discovery::Finding& finding : missing.verdict.findings) {
    if (finding.terms.empty()) continue;
    bars.add(missing.candidates[finding.terms.front().candidate], finding.score_gain,
             finding.generic ? "data" : "after");
    constexpr std::size_t most_rivals = 4;
    for (std::size_t k = 0; k < std::min(finding.rivals.size(), most_rivals); ++k) {
      std::vector<std::string> parts;
      for (const std::size_t candidate : finding.rivals[k].candidates) parts.push_back(missing.candidates[candidate]);
      bars.add(fmt::format("or {}", fmt::join(parts, " + ")), finding.score_gain - finding.rivals[k].score_difference,
               "muted");
    }
  }
  Chart chart = bars.chart("Evidence for each cause, and for its rivals", "evidence");
  chart.references = {{true, missing.verdict.threshold, "chance reaches this", "bad"}};
  chart.caption =
      "How much worse the rows are explained without the cause. Grey: what could stand in its place; bars of one "
      "length cannot be told apart.";
  chart.wide = true;
  return block(chart);
}

Json terms_table(const Missing& missing) {
  Grid grid{.title = "What to add to the simulation",
            .header = {"term", "formula", "values", "certain"},
            .rows = {},
            .words = {1, 2, 3},
            .wide = true};
  for (const discovery::FoundTerm& found : missing.found) {
    std::vector<std::string> values;
    for (const discovery::TermValue& value : found.values) values.push_back(value_text(value));
    grid.rows.push_back({title_of(found, missing.gaps.size() > 1), found.formula,
                         fmt::format("{}", fmt::join(values, ", ")),
                         found.generic     ? "a shape, not a cause"
                         : found.confirmed ? "yes"
                                           : "tentative"});
  }
  return block(grid);
}

}  // namespace

Document terms_report(const Simulated& of) {
  const Missing& missing = of.missing;
  std::string answer = headline_with_names(missing);
  answer.front() = static_cast<char>(std::toupper(static_cast<unsigned char>(answer.front())));
  Document document{.title = fmt::format("llmt discover {} {}", file_name(of.simulated), file_name(of.measured)),
                    .answer = answer + "."};
  const std::string sentence = gap_sentence(missing);
  document.lead = fmt::format("{}{}{} rows, inputs {}. {} candidates; evidence {}, where chance reaches {}.", sentence,
                              sentence.empty() ? "" : " ", of.values.rows(), fmt::join(of.inputs.names, ", "),
                              missing.candidates.size(), number(missing.verdict.score_gain, 3),
                              number(missing.verdict.threshold, 3));
  document.main = gap_chart(missing);
  Section shapes{"The shape of the gap"};
  const auto position = [&](const std::string& name) {
    return std::ranges::find(of.inputs.names, name) - of.inputs.names.begin();
  };
  std::vector<Eigen::Index> shown;
  for (const discovery::FoundTerm& found : missing.found) {
    if (found.inputs.empty()) continue;
    const Eigen::Index input = position(found.inputs.front());
    if (input == std::ssize(of.inputs.names) || std::ranges::find(shown, input) != shown.end()) continue;
    shown.push_back(input);
    const Json picture = block(gap_over(of, input, found.output_index, title_of(found, missing.gaps.size() > 1)));
    (document.beside_main.empty() ? document.beside_main : shapes.blocks).push_back(picture);
  }
  for (Eigen::Index input = 0; input < std::ssize(of.inputs.names) && shapes.blocks.size() < 8; ++input) {
    if (std::ranges::find(shown, input) == shown.end())
      shapes.blocks.push_back(block(gap_over(of, input, 0, fmt::format("Over {}", of.inputs.names[input]))));
  }
  Section why{"Why these"};
  if (!missing.found.empty()) why.blocks = {terms_table(missing)};
  if (!missing.verdict.findings.empty()) why.blocks.push_back(evidence_chart(missing));
  if (!missing.notes.empty()) why.blocks.push_back(text_block("Notes", missing.notes));
  document.sections = {why, shapes};
  if (!missing.not_testable.empty()) {
    Grid grid{
        .title = "What could not be tested", .header = {"term", "why not"}, .rows = {}, .words = {1}, .wide = true};
    for (const discovery::UntestableCause& entry : missing.not_testable) grid.rows.push_back({entry.what, entry.why});
    document.sections.push_back({"What this cannot say", "", {block(grid)}});
  }
  return document;
}

}  // namespace llmt::report
