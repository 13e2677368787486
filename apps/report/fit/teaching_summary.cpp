#include "report/fit/teaching_summary.hpp"

#include <fmt/format.h>

#include "report/text/text.hpp"

namespace llmt::report {
namespace {

// What is left of the sum's advantage.
std::string kept_text(const TaughtPartition& errors) {
  if (!(errors.teacher < errors.alone)) return "the sum predicts no better than one tree here";
  const double kept = 100.0 * (errors.alone - errors.taught) / (errors.alone - errors.teacher);
  if (kept <= 0.0) return "teaching keeps nothing of what the sum is better by";
  return fmt::format("the taught tree keeps {:.0f} % of what the sum is better by", kept);
}

}  // namespace

Json teaching_json(const TaughtResult& taught) {
  Json json = {{"taken", taught.is_taken}, {"made_rows", taught.made_rows}, {"partitions", Json::array()}};
  for (const TaughtPartition& errors : taught.partitions) {
    Json entry;
    for (const int output : errors.outputs) entry["targets"].push_back(taught.fit.model.outputs()[output].name);
    entry["cv_rmse_alone"] = errors.alone;
    entry["cv_rmse_taught"] = errors.taught;
    entry["cv_rmse_sum"] = errors.teacher;
    json["partitions"].push_back(std::move(entry));
  }
  return json;
}

Section teaching_words(const TaughtResult& taught) {
  std::vector<std::string> lines;
  for (const TaughtPartition& errors : taught.partitions) {
    const std::string of = taught.partitions.size() > 1
                               ? fmt::format(" of {}", taught.fit.model.outputs()[errors.outputs.front()].name)
                               : "";
    lines.push_back(fmt::format("RMSE held-out{}: one tree {}, taught tree {}, sum {}: {}.", of, number(errors.alone),
                                number(errors.taught), number(errors.teacher), kept_text(errors)));
  }
  lines.push_back(taught.is_taken
                      ? fmt::format("The model is the taught tree. A sum of trees answered for its rows and for {} "
                                    "that were made of them; none of them had a part in the held-out errors.",
                                    taught.made_rows)
                      : "The model is the tree fitted to the data, because the taught tree is no better.");
  return {"What a teacher brought", "", {text_block("", lines)}};
}

}  // namespace llmt::report
