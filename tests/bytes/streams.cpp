// Trees that learn row by row.
#include "bytes/cases.hpp"
#include "bytes/hash.hpp"
#include "bytes/samples.hpp"
#include "llmt/model.hpp"
#include "llmt/stream.hpp"

namespace bytes {
namespace {

struct StreamSet {
  std::string name;
  void (*apply)(llmt::StreamOptions& options);
  bool gaps = false;     // missing values and weights
  bool changes = false;  // the outputs turn round halfway
  int outputs = 1;
};

const std::vector<StreamSet>& stream_sets() {
  static const std::vector<StreamSet> sets = {
      {"default", [](llmt::StreamOptions&) {}},
      {"two_outputs", [](llmt::StreamOptions&) {}, false, false, 2},
      {"missing_weighted", [](llmt::StreamOptions&) {}, true},
      {"drift", [](llmt::StreamOptions&) {}, false, true},
      {"no_reservoir", [](llmt::StreamOptions& options) { options.reservoir_rows = 0; }},
      {"few_bins_and_leaves",
       [](llmt::StreamOptions& options) {
         options.bins = 6;
         options.max_leaves = 5;
         options.shrinkage = 0.0;
         options.significance = 0.2;
       }},
  };
  return sets;
}

std::string learn_and_hash(const StreamSet& set) {
  constexpr Eigen::Index learned_rows = 2400;
  Sample sample = make_sample(learned_rows, 4);
  if (set.outputs == 2) add_output(sample);
  if (set.changes) sample.outputs.bottomRows(learned_rows / 2) *= -2.0;
  if (set.gaps) remove_values(sample.inputs);
  const Eigen::VectorXd weights = set.gaps ? make_weights(learned_rows) : Eigen::VectorXd();
  llmt::StreamOptions options;
  set.apply(options);
  llmt::Stream stream(sample.inputs.cols(), sample.outputs.cols(), options);
  const Eigen::MatrixXd queries = make_queries();
  Hash predictions;
  // Blocks of different sizes.
  for (Eigen::Index begin = 0, size = 1; begin < learned_rows; begin += size, size = (size * 3) % 701 + 1) {
    const Eigen::Index count = std::min(size, learned_rows - begin);
    stream.add(sample.inputs.middleRows(begin, count), sample.outputs.middleRows(begin, count),
               set.gaps ? weights.segment(begin, count) : weights);
    predictions.add(stream.predict(queries));
  }
  const llmt::StreamCounts counts = stream.counts();
  Hash state;
  state.add(stream.prequential_rmse()).add(stream.recent_rmse()).add(counts.rows).add(counts.missing_values);
  state.add(counts.held_out).add(counts.leaves).add(counts.splits).add(counts.prunes).add(counts.drifts);
  state.add(counts.replacements);
  std::string text = "predictions:" + predictions.text() + " state:" + state.text();
  for (const auto validity :
       {llmt::ValidityChoice::automatic, llmt::ValidityChoice::crisp, llmt::ValidityChoice::blend}) {
    const llmt::Model model = stream.snapshot(validity);
    text += " snapshot:" + Hash().add(llmt::to_json(model)).add(model.predict(queries, 1)).text();
  }
  return text;
}

}  // namespace

void witness_streams(const std::string&, Results& results) {
  for (const StreamSet& set : stream_sets()) results["streams/" + set.name] = learn_and_hash(set);
}

}  // namespace bytes
