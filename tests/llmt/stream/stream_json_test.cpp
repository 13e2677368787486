// The text of a stream: a stream that was saved and loaded goes on as one that was not, whatever was under way.
#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "llmt/limits.hpp"
#include "llmt/stream.hpp"
#include "oracles/oracles.hpp"
#include "oracles/stream_data.hpp"
#include "oracles/thrown.hpp"

namespace {

using llmt::Stream;
using Json = nlohmann::ordered_json;

struct Rows {
  Eigen::MatrixXd inputs;
  Eigen::MatrixXd outputs;
  Eigen::VectorXd weights;
};

// Two kinks that change their signs after 5000 of 8000 rows, with empty cells, weights and rows that come again.
const Rows& rows_that_change() {
  static const Rows made = [] {
    constexpr Eigen::Index count = 8000;
    Rows rows{oracle::uniform(count, 2, 1), Eigen::MatrixXd(count, 2), Eigen::VectorXd(count)};
    rows.outputs.col(0) = stream_data::kink(rows.inputs) + 0.1 * stream_data::noise(count, 2);
    rows.outputs.col(1) = stream_data::affine(rows.inputs) + 0.1 * stream_data::noise(count, 3);
    for (Eigen::Index i = 0; i < count; ++i) {
      if (i >= 5000) rows.outputs(i, 0) *= -1.0;
      if (i % 11 == 3) rows.inputs(i, i % 2) = std::nan("");
      rows.weights(i) = i % 17 == 5 ? 0.0 : 1.0 + static_cast<double>(i % 3);
      if (i % 7 == 6) {
        rows.inputs.row(i) = rows.inputs.row(i - 1);
        rows.outputs.row(i) = rows.outputs.row(i - 1);
        rows.weights(i) = rows.weights(i - 1);
      }
    }
    return rows;
  }();
  return made;
}

void add(Stream& stream, Eigen::Index begin, Eigen::Index end) {
  const Rows& rows = rows_that_change();
  stream.add(rows.inputs.middleRows(begin, end - begin), rows.outputs.middleRows(begin, end - begin),
             rows.weights.segment(begin, end - begin));
}

Stream started() { return Stream(2, 2, {.reservoir_rows = 500}); }

Stream after(Eigen::Index rows) {
  Stream stream = started();
  add(stream, 0, rows);
  return stream;
}

// Rows after which something is under way, with what the text then says of it.
struct Stage {
  Eigen::Index rows;
  std::vector<std::string> says;
};

// The row before which the first branch restarts.
Eigen::Index first_alarm() {
  Stream stream = started();
  Eigen::Index rows = 0;
  for (; stream.counts().drifts == 0; ++rows) add(stream, rows, rows + 1);
  return rows;
}

TEST(StreamJson, AStreamThatWasLoadedGoesOnToTheSameBytes) {
  const Eigen::Index alarm = first_alarm();
  ASSERT_GT(alarm, 5000);
  ASSERT_LT(alarm, 7000);
  const std::string end = to_json(after(8000));
  for (const auto& [rows, says] : std::vector<Stage>{{0, {R"("first_rows":[])", R"("trees":[])"}},
                                                     {30, {R"("first_rows":[0.)", R"("trees":[])", R"("nan")"}},
                                                     {60, {R"("laid_out":0)"}},
                                                     {500, {R"("laid_out":1)", R"("times":2)"}},
                                                     {4000, {R"("split":)"}},
                                                     {alarm, {R"("alternate":)"}},
                                                     {alarm + 100, {R"("alternate":)"}},
                                                     {8000, {R"("replacements":1)"}}}) {
    const Stream saved = after(rows);
    const std::string text = to_json(saved);
    for (const std::string& part : says) EXPECT_NE(text.find(part), std::string::npos) << rows << " " << part;
    Stream loaded = llmt::stream_from_json(text);
    EXPECT_EQ(to_json(loaded), text) << rows;
    add(loaded, rows, 8000);
    EXPECT_EQ(to_json(loaded), end) << rows;
    EXPECT_EQ(llmt::to_json(loaded.snapshot()), llmt::to_json(after(8000).snapshot())) << rows;
  }
}

TEST(StreamJson, NothingIsLostOfWhatAStreamSays) {
  const Stream saved = after(3000);
  const Stream loaded = llmt::stream_from_json(to_json(saved));
  EXPECT_EQ(loaded.prequential_rmse(), saved.prequential_rmse());
  EXPECT_EQ(loaded.recent_rmse(), saved.recent_rmse());
  EXPECT_EQ(loaded.counts().leaves, saved.counts().leaves);
  EXPECT_EQ(loaded.counts().missing_values, saved.counts().missing_values);
  EXPECT_EQ(loaded.predict(rows_that_change().inputs), saved.predict(rows_that_change().inputs));
}

std::string refusal_of_state(const std::string& text) {
  return oracle::thrown<std::runtime_error>([&] { llmt::stream_from_json(text, "s.json"); });
}

TEST(StreamJson, ATextThatIsCutOffIsRefusedWithThePlace) {
  const std::string text = to_json(after(800));
  const std::size_t tree = text.find("\"nodes\"");
  EXPECT_EQ(refusal_of_state(text.substr(0, tree)).find("s.json: not JSON, or cut off: "), 0U);
  EXPECT_NE(refusal_of_state(text.substr(0, tree + 200)).find(", in /trees/0/nodes/0/"), std::string::npos);
  EXPECT_NE(refusal_of_state(text.substr(0, text.find("\"reservoir\"") + 40)).find(", in /reservoir/0"),
            std::string::npos);
  EXPECT_EQ(refusal_of_state("").find("s.json: not JSON, or cut off: "), 0U);
}

std::string refusal_with(const std::string& text, const std::function<void(Json&)>& change) {
  Json json = Json::parse(text);
  change(json);
  return refusal_of_state(json.dump());
}

TEST(StreamJson, ATextThatContradictsItselfIsRefusedWithThePlace) {
  const std::string text = to_json(after(4000));
  const auto node = [](Json& json) -> Json& { return json["trees"][0]["nodes"][0]; };
  EXPECT_EQ(refusal_with(text, [&](Json& json) { node(json)["low"].erase(0); }),
            "s.json: /trees/0/nodes/0/low: 2 elements are needed, there are 1");
  EXPECT_EQ(refusal_with(text, [&](Json& json) { node(json)["split"]["input"] = 2; }),
            "s.json: /trees/0/nodes/0/split/input: 2 is not within 0 ... 1");
  EXPECT_EQ(refusal_with(text, [&](Json& json) { node(json)["split"]["left"] = 2; }),
            "s.json: /trees/0/nodes: node 0 leads to 2, which is not a later node, or has been led to before");
  EXPECT_EQ(refusal_with(text, [&](Json& json) { node(json).erase("split"); }),
            "s.json: /trees/0/nodes: no node leads to node 1");
  EXPECT_EQ(refusal_with(text, [&](Json& json) { node(json)["sums"]["gram"][1] = "many"; }),
            "s.json: /trees/0/nodes/0/sums/gram/1: a number, \"nan\", \"inf\" or \"-inf\" is needed, not \"many\"");
  EXPECT_EQ(refusal_with(text, [&](Json& json) { json["trees"].erase(1); }),
            "s.json: /trees: 2 elements are needed, there are 1");
  EXPECT_EQ(refusal_with(text, [&](Json& json) { json["trees"][1]["scale"][0] = 0.0; }),
            "s.json: /trees/1: a scale is not positive");
  EXPECT_EQ(refusal_with(text, [&](Json& json) { json["reservoir"][1] = json["reservoir"][0]; }),
            "s.json: /reservoir/1: the row stands there twice");
  EXPECT_EQ(refusal_with(text, [&](Json& json) { json["reservoir"][3]["values"][2] = "inf"; }),
            "s.json: /reservoir/3: a value or the weight is not one that a stream takes");
  EXPECT_EQ(refusal_with(text, [&](Json& json) { json["options"]["reservoir_rows"] = 10; }),
            "s.json: /reservoir: it has more rows than reservoir_rows says");
  EXPECT_EQ(refusal_with(text, [&](Json& json) { json["options"]["significance"] = -1.0; }),
            "s.json: /options: llmt::Stream: StreamOptions::significance is -1, it must be positive");
  EXPECT_EQ(refusal_with(text, [&](Json& json) { json["rows"] = 7; }), "s.json: /first_rows: 7 rows are needed");
  EXPECT_EQ(refusal_with(text, [&](Json& json) { json["version"] = 2; }), "s.json: /version: 2 is not within 1 ... 1");
  EXPECT_EQ(refusal_of_state(llmt::to_json(after(100).snapshot())),
            "s.json: not a stream: \"format\" is not \"llmt-stream\"");
}

// A chain of splits: the left child is split again.
TEST(StreamJson, AStreamIsNoDeeperThanAModel) {
  const Json whole = Json::parse(to_json(after(4000)));
  Json inner;
  Json leaf;
  for (const Json& node : whole["trees"][0]["nodes"]) (node.contains("split") ? inner : leaf) = node;
  ASSERT_TRUE(inner.contains("split") && leaf.contains("sums"));
  inner.erase("alternate");
  for (const char* part : {"alternate", "search"}) leaf.erase(part);
  const auto chain = [&](int splits) {
    Json nodes = Json::array();
    for (int k = 0; k < splits; ++k) {
      inner["split"]["left"] = 2 * k + 1;
      inner["split"]["right"] = 2 * k + 2;
      nodes.push_back(inner);
      if (k > 0) nodes.push_back(leaf);
    }
    nodes.push_back(leaf);
    nodes.push_back(leaf);
    Json json = whole;
    json["trees"][0]["nodes"] = nodes;
    return json.dump();
  };
  const auto most = static_cast<int>(llmt::most(llmt::Limit::model_splits_above_leaf));
  EXPECT_EQ(refusal_of_state(chain(most)), "nothing was thrown");
  EXPECT_EQ(refusal_of_state(chain(most + 1)), "s.json: /trees/0/nodes: the tree is deeper than 2000 splits");
}

TEST(StreamJson, RowsBeforeTheTreesAreCheckedAsRowsThatAreAdded) {
  const std::string text = to_json(after(30));
  EXPECT_EQ(refusal_with(text, [](Json& json) { json["first_rows"][2] = "nan"; }),
            "s.json: /first_rows: row 0 is not one that a stream takes");
  EXPECT_EQ(refusal_with(text, [](Json& json) { json["first_rows"].erase(json["first_rows"].size() - 1); }),
            "s.json: /first_rows: 27 rows are needed");
}

}  // namespace
