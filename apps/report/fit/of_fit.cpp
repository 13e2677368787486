#include "report/fit/of_fit.hpp"

#include <fmt/format.h>

#include "llmt/explain.hpp"
#include "report/document/figures.hpp"
#include "report/fit/fit_accuracy.hpp"
#include "report/fit/fit_shape.hpp"
#include "report/fit/kinds.hpp"
#include "report/model/trees.hpp"
#include "report/text/text.hpp"

namespace llmt::report {
namespace {

std::string sentence(const HeldOutRows& rows, const PartitionSummary& partition, const std::string& name) {
  const std::string error = fmt::format("{} is predicted to within {} in nine of ten {}", name, number(rows.p90, 2),
                                        rows.held_out ? "rows it has not seen" : "rows (none was held out)");
  if (!rows.held_out || partition.best_of_kind.empty() || partition.leaves == 1) return error + ".";
  const double least_squares = partition.best_of_kind.front().rmse;
  const double gain = 100.0 * (1.0 - partition.chosen.rmse / least_squares);
  return gain < 1.0 ? error + ", no better than by one linear equation."
                    : fmt::format("{}; the error is {:.0f} % below that of one linear equation.", error, gain);
}

std::string lead(const Fitted& fitted, const HeldOutRows& rows, const PartitionSummary& partition, std::size_t p) {
  std::string text = fmt::format(
      "{} rows, {} inputs. RMSE {} {}, R2 {:.3f}; {}, {} equation{}.", fitted.result.summary.samples,
      fitted.result.model.num_inputs(), number(rows.rmse), rows.held_out ? "on rows held out" : "on the rows fitted",
      rows.r2, kind_of(partition.chosen.candidate), partition.leaves, partition.leaves == 1 ? "" : "s");
  if (fitted.left_out > 0) text += fmt::format(" The Tukey loss left out {} rows more.", fitted.left_out);
  if (fitted.readable) {
    const ReadablePartition& rules = fitted.readable->partitions[p];
    text += fmt::format(" A tree of {} short rule{} that can be read in full has an RMSE of {}.", rules.leaves,
                        rules.leaves == 1 ? "" : "s", number(rules.rmse));
  }
  return text;
}

void add_output(const Fitted& fitted, std::size_t p, std::size_t o, bool alone, Document& document) {
  const PartitionSummary& partition = fitted.result.summary.partitions[p];
  const int output = partition.outputs[o];
  const Model& model = fitted.result.model;
  const std::string& name = model.outputs()[output].name;
  const std::string of = alone ? "" : " of " + name;
  const HeldOutRows rows = held_out(fitted, output);
  const Chart main = predicted_against_observed(rows, name);
  const std::optional<PermutationImportance> found =
      held_out_importance(fitted.result, fitted.inputs, fitted.outputs, {}, fitted.options.max_threads);
  const Eigen::VectorXd weights =
      found ? found->increase.row(output).transpose().eval()
            : importance(model, fitted.inputs, fitted.options.max_threads).row(output).transpose().eval();
  const std::vector<int> order = by_importance(weights);
  const Chart what_matters = found ? increase_chart(model, *found, output) : importance_chart(model, weights, order);
  if (!document.main) {
    document.answer = sentence(rows, partition, name);
    document.lead = lead(fitted, rows, partition, p);
    document.main = main;
    if (found) document.importance = what_matters;
    document.beside_main = {block(what_matters)};
  } else {
    document.sections.push_back({fmt::format("{}: how well", name),
                                 sentence(rows, partition, name) + " " + lead(fitted, rows, partition, p),
                                 {block(main), block(what_matters)}});
  }
  if (o == 0) {
    if (fitted.readable) {
      document.sections.push_back(
          {"The model you can read" + of,
           "",
           {tree_block(
               fitted.readable->model, static_cast<Eigen::Index>(p), fitted.inputs, "Rules as a tree",
               "From top to bottom: a row goes the way whose condition it meets, and the equation at the end is its "
               "prediction. Bars: how far each input moves the prediction between its quartiles.")}});
    } else if (partition.leaves <= 16) {
      document.sections.push_back(
          {"The tree" + of,
           "",
           {tree_block(model, static_cast<Eigen::Index>(p), fitted.inputs, "Leaves with their equations",
                       "Bars: how far each input moves the prediction between its quartiles.")}});
    }
  }
  Section shape{
      "What it says" + of,
      "The mean prediction over the rows along one input, all others as they are. Thin: single rows. Dots at the "
      "bottom: where rows lie. All pictures have one axis."};
  std::vector<int> shown;
  std::vector<Chart> slices;
  for (const int j : order) {
    if (slices.size() == 6) break;
    if (!(model.inputs()[j].low < model.inputs()[j].high || model.inputs()[j].is_categorical())) continue;
    shown.push_back(j);
    slices.push_back(slice(fitted, output, j));
  }
  on_one_axis(fitted, shown, slices);
  for (const Chart& chart : slices) shape.blocks.push_back(block(chart));
  for (Json& picture : plane_blocks(model, output, fitted.inputs, fitted.outputs.col(output)))
    shape.blocks.push_back(std::move(picture));
  if (!order.empty()) shape.blocks.push_back(block(waterfall(fitted, output)));
  document.sections.push_back(std::move(shape));
  Section trust{"How far to trust it" + of};
  trust.blocks.push_back(block(residuals(rows, name)));
  trust.blocks.push_back(block(error_histogram(rows)));
  if (partition.cv_folds > 0 && o == 0) {
    trust.blocks.push_back(block(error_over_leaves(partition)));
  }
  document.sections.push_back(std::move(trust));
}

}  // namespace

Document fit_report(const Fitted& fitted, const Document& words) {
  Document document{.title = fmt::format("llmt fit {}", file_name(fitted.data)), .answer = ""};
  const std::vector<PartitionSummary>& partitions = fitted.result.summary.partitions;
  const bool alone = fitted.result.model.num_outputs() == 1;
  for (std::size_t p = 0; p < partitions.size(); ++p) {
    for (std::size_t o = 0; o < partitions[p].outputs.size(); ++o) add_output(fitted, p, o, alone, document);
  }
  document.sections.push_back({"How it was made", "", {text_block("", words.notes)}});
  document.sections.insert(document.sections.end(), words.sections.begin(), words.sections.end());
  return document;
}

}  // namespace llmt::report
