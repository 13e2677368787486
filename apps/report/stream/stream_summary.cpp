#include "report/stream/stream_summary.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

namespace llmt::report {

Json stream_json(const StreamRun& run) {
  const StreamCounts counts = run.stream.counts();
  Json json = {{"data", run.data},
               {"rows", counts.rows},
               {"missing_values", counts.missing_values},
               {"rule", "rd"},
               {"inputs", run.inputs},
               {"held_out", counts.held_out},
               {"grown_leaves", counts.leaves},
               {"splits", counts.splits},
               {"prunes", counts.prunes},
               {"drifts", counts.drifts},
               {"replacements", counts.replacements},
               {"bytes", counts.bytes},
               {"partitions", Json::array()}};
  const Eigen::VectorXd all = run.stream.prequential_rmse();
  const Eigen::VectorXd recent = run.stream.recent_rmse();
  for (const Partition& partition : run.model.partitions()) {
    const Eigen::Index output = partition.outputs.front();
    json["partitions"].push_back({{"targets", {run.targets[output]}},
                                  {"validity", partition.validity.kind == ValidityKind::crisp ? "crisp" : "blend"},
                                  {"width", partition.validity.width},
                                  {"leaves", partition.num_leaves()},
                                  {"prequential_rmse", finite_or_null(all(output))},
                                  {"recent_rmse", finite_or_null(recent(output))}});
  }
  json["model"] = run.output.empty() ? Json(nullptr) : Json(run.output);
  return json;
}

std::string stream_text(const StreamRun& run, std::size_t width) {
  const StreamCounts counts = run.stream.counts();
  std::string text =
      fmt::format("{}: {} rows, {} inputs: {}\n", run.data, counts.rows, run.inputs.size(), first_names(run.inputs));
  if (counts.missing_values > 0) text += fmt::format("Missing values in the inputs: {}\n", counts.missing_values);
  text += fmt::format("Learned row by row, rule rd: {} splits, {} taken back; {}, {} branches replaced; {} MiB\n\n",
                      counts.splits, counts.prunes,
                      counts.drifts == 0 ? "no change of the data was noticed"
                                         : fmt::format("changes of the data noticed: {}", counts.drifts),
                      counts.replacements, number(static_cast<double>(counts.bytes) / 1048576.0, 3));
  Table table({"target", "model", "leaves", "RMSE before learning", "of the last 1000"});
  const Eigen::VectorXd all = run.stream.prequential_rmse();
  const Eigen::VectorXd recent = run.stream.recent_rmse();
  for (const Partition& partition : run.model.partitions()) {
    const Eigen::Index output = partition.outputs.front();
    const std::string kind = partition.validity.kind == ValidityKind::crisp
                                 ? "crisp"
                                 : fmt::format("blend, width {}", number(partition.validity.width, 3));
    table.add({run.targets[output], kind, fmt::format("{}", partition.num_leaves()), number(all(output)),
               number(recent(output))});
  }
  return text + table.text(width);
}

}  // namespace llmt::report
