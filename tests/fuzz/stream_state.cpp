// The text of a stream: what is read survives writing and can go on. Inputs that begin with { are JSON as they stand;
// others change the text of a stream at some stage of its life.
#include <cmath>
#include <limits>
#include <stdexcept>

#include "fuzz/json_mutator.hpp"
#include "llmt/random.hpp"
#include "llmt/stream.hpp"

namespace fuzz_stream_state {
namespace {

const std::vector<std::string> words = {"",     "nan",    "inf",       "-inf", "llmt-stream",
                                        "left", "search", "alternate", "split"};

Eigen::MatrixXd inputs_of(llmt::Random& random, Eigen::Index rows, Eigen::Index columns) {
  Eigen::MatrixXd x(rows, columns);
  for (double& value : x.reshaped()) value = random.below(12) == 0 ? std::nan("") : random.uniform(-1.0, 1.0);
  return x;
}

Eigen::MatrixXd outputs_of(const Eigen::MatrixXd& x, double sign, Eigen::Index outputs) {
  const Eigen::VectorXd known = x.col(0).unaryExpr([](double value) { return std::isnan(value) ? 0.0 : value; });
  return (sign * known.cwiseAbs()).replicate(1, outputs);
}

// Before the trees, with rows in front of the bins, with bins, split, and with a branch that grows beside another.
const std::vector<std::string>& stages() {
  static const std::vector<std::string> texts = [] {
    std::vector<std::string> all;
    llmt::Random random(3);
    llmt::Stream stream(2, 2, {.max_leaves = 4, .bins = 4, .reservoir_rows = 12});
    for (const Eigen::Index rows : {0, 20, 40, 60, 900}) {
      const Eigen::MatrixXd x = inputs_of(random, rows, 2);
      stream.add(x, outputs_of(x, 1.0, 2));
      all.push_back(to_json(stream));
    }
    while (stream.counts().drifts == 0) {
      const Eigen::MatrixXd x = inputs_of(random, 1, 2);
      stream.add(x, outputs_of(x, -1.0, 2));
    }
    all.push_back(to_json(stream));
    return all;
  }();
  return texts;
}

void go_on(llmt::Stream& stream, Eigen::Index columns, Eigen::Index outputs) {
  llmt::Random random(5);
  const Eigen::MatrixXd x = inputs_of(random, 80, columns);
  try {
    stream.add(x, outputs_of(x, 1.0, outputs));
    stream.predict(x);
    stream.snapshot().predict(x, 1);
  } catch (const std::invalid_argument& error) {
    fuzz::require(error.what()[0] != '\0', "a refusal says why");
  }
}

}  // namespace

FUZZ_TARGET(stream_state) {
  std::string text = fuzz::text_of(data, size);
  if (!text.starts_with('{')) {
    fuzz::Bytes bytes(data, size);
    fuzz::Json json = fuzz::Json::parse(bytes.one_of(stages()));
    fuzz::mutate(json, bytes, words);
    text = json.dump(-1, ' ', false, fuzz::Json::error_handler_t::replace);
  }
  try {
    llmt::Stream stream = llmt::stream_from_json(text, "s");
    const std::string written = to_json(stream);
    fuzz::require(to_json(llmt::stream_from_json(written)) == written, "a stream survives writing");
    const fuzz::Json json = fuzz::Json::parse(written);
    go_on(stream, json["inputs"], json["outputs"]);
  } catch (const std::runtime_error& error) {
    fuzz::require(std::string(error.what()).starts_with("s: "), fmt::format("'{}' names the text", error.what()));
  }
  return 0;
}

}  // namespace fuzz_stream_state
