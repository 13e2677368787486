#include "report/dynamic/system_document.hpp"

#include <fmt/format.h>

#include <cmath>
#include <sstream>

#include "llmt/run_band.hpp"
#include "report/document/figures.hpp"
#include "report/dynamic/local_words.hpp"
#include "report/dynamic/run_pictures.hpp"
#include "report/text/text.hpp"

namespace llmt::report {
namespace {

void add_charts(const std::vector<Chart>& charts, Section& section) {
  for (const Chart& chart : charts) section.blocks.push_back(block(chart));
}

std::vector<std::string> sentences_of(const std::string& text) {
  std::vector<std::string> lines;
  std::istringstream stream(text);
  for (std::string line; std::getline(stream, line);) lines.push_back(line);
  return lines;
}

// The band about runs that begin anew behind each row without one.
Bounds band_about(const DynamicModel& model, const Eigen::MatrixXd& outputs) {
  Bounds band{outputs, outputs};
  for (Eigen::Index begin = 0; begin < outputs.rows();) {
    if (!outputs.row(begin).allFinite()) {
      ++begin;
      continue;
    }
    Eigen::Index end = begin;
    while (end < outputs.rows() && outputs.row(end).allFinite()) ++end;
    const Bounds of_run = run_bounds(model, {.outputs = outputs.middleRows(begin, end - begin)}, band_level);
    band.lower.middleRows(begin, end - begin) = of_run.lower;
    band.upper.middleRows(begin, end - begin) = of_run.upper;
    begin = end;
  }
  return band;
}

void add_residuals(const DynamicModel& model, const Series& series, const Eigen::MatrixXd& outputs,
                   Document& document) {
  for (const ResidualTests& tests : residual_tests(model, series, outputs)) {
    Section section{"What is left of " + tests.output};
    add_charts(residual_charts(tests, model), section);
    document.sections.push_back(std::move(section));
  }
}

void add_leaves(const DrawnRun& run, Document& document) {
  Section section{"Where in the tree"};
  add_charts(leaf_charts(run), section);
  if (!section.blocks.empty()) document.sections.push_back(std::move(section));
}

}  // namespace

Document dynamic_document(const DynamicRun& run) {
  const DynamicModel& model = run.fit.model;
  const DynamicParts& parts = model.parts();
  const DynamicSummary& summary = run.fit.summary;
  Document document{.title = fmt::format("llmt fit {}", file_name(run.data)), .answer = ""};
  const bool has_band = !parts.band.outputs.empty();
  const DrawnRun drawn{model, run.series, run.fit.held_out, has_band ? band_about(model, run.fit.held_out) : Bounds{}};
  const std::string caption =
      "Each part of the record is run by a model that was learned from the other parts, from a few measured rows on." +
      std::string(has_band ? " Nine of ten held-out values lie in the band." : "");
  Section runs{"Runs"};
  for (Eigen::Index o = 0; o < model.num_outputs(); ++o) {
    const Chart chart = run_chart(drawn, o, caption);
    const std::string sentence =
        fmt::format("{}: the error of held-out runs is {} (fit {:.1f} %), that of a linear model {} ({:.1f} %).",
                    parts.outputs[o].name, number(summary.held_out.rmse(o)), summary.held_out.fit(o),
                    number(summary.linear.rmse(o)), summary.linear.fit(o));
    if (o == 0) {
      document.answer = sentence;
      document.lead =
          fmt::format("{} rows. The model is: {}.", summary.rows, summary.compared[summary.chosen].description);
      document.main = chart;
    } else {
      runs.text += (runs.text.empty() ? "" : " ") + sentence;
      runs.blocks.push_back(block(chart));
    }
    if (has_band) runs.blocks.push_back(block(band_chart(model, o)));
  }
  if (!runs.blocks.empty()) document.sections.push_back(std::move(runs));
  Section local{"Local models",
                "What the system does near a point: how it answers a step, and where it comes to rest."};
  add_charts(step_charts(model), local);
  add_charts(static_charts(model), local);
  if (has_sums(model)) {
    local.text += " An output adds up its changes, so it has no steady value for a steady input.";
  }
  if (!local.blocks.empty()) document.sections.push_back(std::move(local));
  add_leaves({model, run.series, run.fit.simulated}, document);
  add_residuals(model, run.series, run.fit.simulated, document);
  // A page goes to others, whom the place of the file does not concern.
  const DynamicRun named{file_name(run.data), "", run.series, run.fit, run.horizon};
  document.sections.push_back({"In words", "", {text_block("", sentences_of(dynamic_text(named, no_width_limit)))}});
  return document;
}

Document simulated_document(const SimulatedRecords& simulated) {
  const DynamicModel& model = simulated.model;
  Document document{.title = fmt::format("llmt simulate {}", file_name(simulated.data)), .answer = ""};
  Eigen::MatrixXd outputs = simulated.outputs;
  const std::vector<Stretch> records = records_of(simulated.series);
  for (std::size_t r = 0; r < records.size(); ++r) {
    outputs.middleRows(records[r].begin, simulated.runs[r].first).setConstant(std::nan(""));
  }
  const std::vector<std::string> words = sentences_of(simulated_text(simulated));
  document.answer = words.size() > 1 ? words[1] : words.front();
  const DrawnRun drawn{model, simulated.series, outputs, simulated.band};
  Section runs{"Runs"};
  for (Eigen::Index o = 0; o < model.num_outputs(); ++o) {
    const Chart chart = run_chart(drawn, o, "After the rows that it begins with a run uses nothing measured.");
    if (o == 0) {
      document.main = chart;
    } else {
      runs.blocks.push_back(block(chart));
    }
  }
  if (!runs.blocks.empty()) document.sections.push_back(std::move(runs));
  add_leaves(drawn, document);
  if (simulated.has_measured) add_residuals(model, simulated.series, outputs, document);
  document.sections.push_back({"In words", "", {text_block("", words)}});
  return document;
}

}  // namespace llmt::report
