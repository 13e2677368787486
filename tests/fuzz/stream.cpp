// Streams: rows one at a time and in blocks give the same model, which survives writing.
#include "llmt/stream.hpp"

#include <stdexcept>

#include "fuzz/table.hpp"

namespace fuzz_stream {
namespace {

llmt::StreamOptions options_of(fuzz::Bytes& bytes) {
  llmt::StreamOptions options;
  options.bins = 4 + bytes.below(13);
  options.max_leaves = bytes.below(6);
  options.min_leaf_samples = bytes.below(8);
  options.shrinkage = bytes.coin() ? 0.0 : 0.1;
  options.significance = bytes.coin() ? 0.05 : 0.9;
  options.reservoir_rows = bytes.coin() ? 0 : 40;
  return options;
}

std::string written(const llmt::Stream& stream) {
  const std::string json = llmt::to_json(stream.snapshot());
  fuzz::require(llmt::to_json(llmt::from_json(json)) == json, "a snapshot survives writing");
  return json;
}

}  // namespace

FUZZ_TARGET(stream) {
  fuzz::Bytes bytes(data, size);
  const llmt::StreamOptions options = options_of(bytes);
  const fuzz::Table table = fuzz::table_of(bytes, 200, 3, 1 + bytes.below(2), true);
  const Eigen::Index rows = table.inputs.rows();
  llmt::Stream whole(table.inputs.cols(), table.outputs.cols(), options);
  llmt::Stream single(table.inputs.cols(), table.outputs.cols(), options);
  const int passes = 1 + bytes.below(3);
  try {
    for (int pass = 0; pass < passes; ++pass) {
      whole.add(table.inputs, table.outputs);
      for (Eigen::Index i = 0; i < rows; ++i) single.add(table.inputs.row(i), table.outputs.row(i));
    }
  } catch (const std::invalid_argument& error) {
    fuzz::require(error.what()[0] != '\0', "a refusal says why");
    return 0;
  }
  fuzz::require(written(whole) == written(single), "one row at a time is as all rows at once");
  fuzz::require(whole.predict(table.inputs).allFinite(), "predictions are finite");
  fuzz::require(whole.counts().rows == passes * rows, "all rows are counted");
  return 0;
}

}  // namespace fuzz_stream
