#include "report/fit/boosted_summary.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "report/fit/mean_of_rows.hpp"
#include "report/fit/time_limit.hpp"

namespace llmt::report {
namespace {

// Says of which inputs the rarest levels have no features: "k: 45 of 300 categories, ...". Nothing of the others.
std::string rare_levels_text(const BoostedModel& model) {
  std::string text;
  for (int j = 0; j < static_cast<int>(model.num_inputs()); ++j) {
    const InputColumn& input = model.inputs()[j];
    const auto is_of_input = [&](const BoostedFeature& feature) { return feature.inputs.front() == j; };
    const auto with_feature = std::ranges::count_if(model.sums().front().features, is_of_input);
    const auto rare = std::ssize(input.levels) - with_feature;
    if (with_feature == 0 || rare <= 0) continue;
    text += fmt::format(
        "{}: the {} rarest of {} categories are not told from each other, only from the {} most frequent ones.\n",
        input.name, rare, input.levels.size(), with_feature);
  }
  return text;
}

bool is_blend(const BoostSummary& summary) { return summary.variant == "blend"; }

std::string blend_text(const std::string& target, const BoostSummary& summary) {
  std::string text = fmt::format("{} is a mean of several, held-out errors in brackets:", target);
  for (const BoostVariant& variant : summary.compared) {
    if (variant.share == 0.0) continue;
    text += fmt::format(" {:.0f} % {} ({}),", 100.0 * variant.share, variant.name, number(variant.rmse));
  }
  text.back() = '.';
  return text + "\n";
}

}  // namespace

Json boosted_json(const BoostedRun& run, const BoostResult& result) {
  Json json = {{"data", run.data}, {"rule", "boost"}, {"inputs", Json::array()}, {"sums", Json::array()}};
  for (const InputColumn& input : result.model.inputs()) json["inputs"].push_back(input.name);
  for (std::size_t o = 0; o < result.summaries.size(); ++o) {
    const BoostSummary& summary = result.summaries[o];
    Json compared = Json::array();
    for (const BoostVariant& variant : summary.compared) {
      compared.push_back({{"name", variant.name}, {"rmse", finite_or_null(variant.rmse)}, {"share", variant.share}});
    }
    json["sums"].push_back({{"target", result.model.outputs()[o].name},
                            {"rows", summary.rows},
                            {"held_out_rows", summary.held_out},
                            {"held_out_rmse", finite_or_null(summary.rmse)},
                            {"spread", finite_or_null(summary.spread)},
                            {"train_rmse", finite_or_null(summary.train_rmse)},
                            {"variant", summary.variant},
                            {"compared", std::move(compared)},
                            {"trees", summary.trees},
                            {"rate", result.model.sums()[o].rate}});
    if (summary.seeds > 1) json["sums"].back()["seeds"] = summary.seeds;
  }
  if (run.time) json["time_limit"] = time_limit_json(*run.time, LimitedSize::rounds);
  json["model"] = run.output.empty() ? Json(nullptr) : Json(run.output);
  return json;
}

std::string boosted_text(const BoostedRun& run, const BoostResult& result, std::size_t width) {
  std::string text = fmt::format("{}: {} rows, {} inputs; a sum of trees for each target\n", run.data,
                                 result.summaries.front().rows, result.model.num_inputs());
  Table table(
      {"target", "trees", "number", "rate", "RMSE held out", "spread of fifths", "RMSE in-sample", "rows held out"});
  for (std::size_t o = 0; o < result.summaries.size(); ++o) {
    const BoostSummary& summary = result.summaries[o];
    table.add({result.model.outputs()[o].name, summary.variant, fmt::format("{}", summary.trees),
               number(result.model.sums()[o].rate), number(summary.rmse),
               summary.held_out == summary.rows ? number(summary.spread, 2) : "-", number(summary.train_rmse),
               fmt::format("{}", summary.held_out)});
    if (o < run.rmse_of_mean.size()) {
      table.add({"  against", mean_of_rows, "", "", number(run.rmse_of_mean[o]), "-", "", ""});
    }
  }
  text += table.text(width);
  for (std::size_t o = 0; o < result.summaries.size(); ++o) {
    if (is_blend(result.summaries[o])) {
      text += wrapped(blend_text(result.model.outputs()[o].name, result.summaries[o]), width);
    }
  }
  text += wrapped(rare_levels_text(result.model), width);
  if (run.time) text += wrapped(time_limit_text(*run.time, LimitedSize::rounds) + ".\n", width);
  if (const int seeds = result.summaries.front().seeds; seeds > 1) {
    text += wrapped(
        fmt::format("Each sum is the mean of those of {} seeds; what was compared is of the first.\n", seeds), width);
  }
  const bool is_of_all = std::ranges::all_of(
      result.summaries, [](const BoostSummary& summary) { return summary.held_out == summary.rows; });
  return text + wrapped(is_of_all
                            ? "The held-out error is of all rows: the sum is fitted without a fifth of them in turn.\n"
                            : "The held-out error is of trees fitted without those rows; they also decided when "
                              "boosting stopped, and what is blended, so it is slightly too small.\n",
                        width);
}

}  // namespace llmt::report
