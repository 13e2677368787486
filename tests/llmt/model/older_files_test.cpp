// Model files of version 2 that hold what fits make no longer.
#include <gtest/gtest.h>

#include <Eigen/Core>
#include <limits>
#include <stdexcept>
#include <string>

#include "llmt/model.hpp"
#include "oracles/predict_oracle.hpp"

namespace {

// Node 3 shares the local model of node 1: beyond the range of its rows the root's slopes take over, not those of its
// parent, node 2.
const std::string shared_leaves =
    R"(
{"format": "llmt-model", "version": 2, "inputs": [{"name": "a", "low": -0.998, "high": 0.992, "centre": -0.04149},
{"name": "b", "low": -0.979, "high": 0.998, "centre": 0.03794}], "outputs": [{"name": "y", "low": -1.499,
"high": 1.982}], "regressors": [{"column": 0, "centre": -0.04149}, {"column": 1, "centre": 0.03794}],
"partitions": [{"outputs": [0], "validity": {"kind": "crisp", "width": 0.0, "smoothness": 1},
"outer_slope": [[0.3675, 0.5466]], "residual_range": [[-0.8107, 1.546]], "nodes": [{"split": {"input": "a",
"column": 0, "threshold": 0.0135, "half_width": 0.0, "missing_left": 0.5583, "left": 1, "right": 2}, "samples": 120,
"rank": 3, "rss": [21.03], "value": [0.1422], "slope": [[1.15, 0.7372]], "mean": [2.313e-17, 8.327e-18],
"low": [-0.9515, -1.006], "high": [1.013, 0.9561]}, {"samples": 67, "rank": 3, "rss": [0.1585], "value": [-0.02483],
"slope": [[1.01, 0.498]], "mean": [-0.4312, 0.0363], "low": [-0.5, -0.6], "high": [0.6, 0.5]},
{"split": {"input": "b", "column": 1, "threshold": -0.0405, "half_width": 0.0, "missing_left": 0.566, "left": 3,
"right": 4}, "samples": 53, "rank": 3, "rss": [7.7], "value": [0.9648], "slope": [[-0.06668, 1.041]],
"mean": [0.5451, -0.04589], "low": [-0.1, -0.9], "high": [0.9, 0.9]}, {"samples": 30, "rank": 3, "rss": [0.07229],
"value": [-0.02483], "slope": [[1.01, 0.498]], "mean": [0.6046, -0.4697], "low": [-0.5, -0.6], "high": [0.6, 0.5],
"shared_with": 1}, {"samples": 23, "rank": 3, "rss": [0.02571], "value": [1.979], "slope": [[-0.9614, 0.08201]],
"mean": [0.4675, 0.5069], "low": [-0.1778, -0.2799], "high": [1.013, 0.9561]}]}]})";

void replace(std::string& text, const std::string& from, const std::string& to) {
  for (std::size_t at = text.find(from); at != std::string::npos; at = text.find(from, at + to.size())) {
    text.replace(at, from.size(), to);
  }
}

// The same as a blend with two continuous derivatives.
std::string two_derivatives() {
  std::string text = shared_leaves;
  replace(text, R"("kind": "crisp")", R"("kind": "blend")");
  replace(text, R"("width": 0.0)", R"("width": 1.0)");
  replace(text, R"("smoothness": 1)", R"("smoothness": 2)");
  replace(text, R"("half_width": 0.0)", R"("half_width": 0.3)");
  return text;
}

// Inside the ranges of the leaves, beyond those of node 3, beyond the training extent, and with a missing value.
Eigen::MatrixXd queries() {
  Eigen::MatrixXd x(8, 2);
  x << 0.5, -0.5, -0.5, 0.5, 0.9, -0.95, -0.9, -0.9, 0.1, 0.1, 5.0, -5.0, -4.0, 3.0,
      std::numeric_limits<double>::quiet_NaN(), 0.5;
  return x;
}

// What the version that wrote such files predicted; only the fifth query lies on a transition.
Eigen::VectorXd recorded(double on_the_transition) {
  Eigen::VectorXd y(8);
  y << 0.25418078, -0.25781921999999996, 0.3945501320000001, -1.469189868, on_the_transition, -0.2017532795000001,
      -0.5360547684999998, 0.56379699843702;
  return y;
}

// The predictions are the recorded ones, by the library, by the oracle, and after the file was written anew.
void expect_recorded(const std::string& file, const Eigen::VectorXd& expected) {
  const llmt::Model model = llmt::from_json(file);
  EXPECT_LT((model.predict(queries()).col(0) - expected).cwiseAbs().maxCoeff(), 1e-14);
  EXPECT_LT((oracle::predict_rows(model, queries()).col(0) - expected).cwiseAbs().maxCoeff(), 1e-12);
  const std::string rewritten = llmt::to_json(model);
  EXPECT_EQ(rewritten.find("shared_with"), std::string::npos);
  EXPECT_EQ(llmt::from_json(rewritten).predict(queries()), model.predict(queries()));
  EXPECT_EQ(model.leaves(0).size(), 3U);
}

TEST(OlderFiles, SharedLocalModelsPredictWhatTheyDid) { expect_recorded(shared_leaves, recorded(1.8480610546)); }

TEST(OlderFiles, BlendsWithTwoContinuousDerivativesPredictWhatTheyDid) {
  expect_recorded(two_derivatives(), recorded(1.27772862211107));
}

TEST(OlderFiles, AMistakeInSharedWithIsNamed) {
  const auto message = [](const std::string& shared_with) -> std::string {
    std::string text = shared_leaves;
    replace(text, R"("shared_with": 1)", R"("shared_with": )" + shared_with);
    try {
      llmt::from_json(text);
    } catch (const std::runtime_error& error) {
      return error.what();
    }
    return "";
  };
  const std::string wanted = "it must be an earlier leaf that does not share another's local model";
  for (const std::string wrong : {"0", "3", "4", "1000", "-7"}) {
    EXPECT_EQ(message(wrong), "model: /partitions/0: node 3: shared_with is " + wrong + ", " + wanted);
  }
  EXPECT_NE(message("1.5").find("/partitions/0/nodes/3/shared_with: a whole number is needed"), std::string::npos);
}

}  // namespace
