// States and sums whose checksum is right and whose parts do not go together.
#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <limits>
#include <stdexcept>
#include <string>
#include <vector>

#include "base/sums.hpp"
#include "distributed/block_sums.hpp"
#include "distributed/state.hpp"
#include "llmt/distributed.hpp"
#include "llmt/random.hpp"
#include "oracles/thrown.hpp"

namespace llmt::distributed {
namespace {

constexpr double no_number = std::numeric_limits<double>::quiet_NaN();
constexpr double infinite = std::numeric_limits<double>::infinity();

struct Checked {
  Eigen::MatrixXd inputs = Eigen::MatrixXd(1200, 3);
  Eigen::VectorXd output = Eigen::VectorXd(1200);

  // `passes`: 0 and the state is to describe, 1 and the root is open, 2 and it has two open children.
  State state(int passes) const {
    State result = start({"a", "b", "colour"}, "y",
                         {.branch_rows = 200,
                          .sample_rows = 200,
                          .block_rows = 200,
                          .levels = {{}, {}, {"blue", "red"}},
                          .fit = {.max_leaves = 4, .validity = ValidityChoice::crisp}});
    while (passes-- > 0) result = advance(result, sums({inputs, output, 0}, result, 1), {}, 1);
    return result;
  }
};

Checked table() {
  Random random(1);
  Checked rows;
  for (Eigen::Index i = 0; i < 1200; ++i) {
    rows.inputs.row(i) << random.uniform(-1.0, 1.0), random.uniform(-1.0, 1.0), static_cast<double>(i % 2);
    rows.output(i) = 3.0 * std::abs(rows.inputs(i, 0)) + rows.inputs(i, 2) + 0.1 * random.normal();
  }
  return rows;
}

std::string read(const StateData& data) {
  return oracle::thrown<std::runtime_error>([&] { State::from_bytes(sealed('s', to_bytes(data)), "f"); });
}

using Change = std::function<void(StateData&)>;

void expect_refused(const StateData& sound, const std::string& what, const std::vector<Change>& changes) {
  ASSERT_EQ(read(sound), "nothing was thrown");
  for (std::size_t k = 0; k < changes.size(); ++k) {
    StateData data = sound;
    changes[k](data);
    EXPECT_EQ(read(data), "f: " + what + " does not go with the rest") << k;
  }
}

TEST(StateChecks, OptionsAndColumns) {
  const StateData first = table().state(0).data();
  expect_refused(
      first, "an option",
      {[](StateData& data) { data.options.sample_rows = 0; },
       [](StateData& data) { data.options.branch_rows = data.options.sample_rows - 1; },
       [](StateData& data) { data.options.block_rows = 0; }, [](StateData& data) { data.options.weighted = 2; },
       [](StateData& data) { data.options.weighted = -1; }, [](StateData& data) { data.options.may_have_codes = 2; }});
  expect_refused(
      first, "the number of inputs",
      {[](StateData& data) { data.levels.pop_back(); }, [](StateData& data) { data.input_names.pop_back(); }});
  expect_refused(first, "the number of levels",
                 {[](StateData& data) { data.levels[2].resize(most_levels + 1, to_text("more")); }});
  expect_refused(first, "the next step",
                 {[](StateData& data) { data.step = static_cast<Step>(static_cast<int>(Step::finished) + 1); },
                  [](StateData& data) { data.step = static_cast<Step>(-1); }});
  expect_refused(first, "a node before the first pass",
                 {[](StateData& data) { data.rows = 1; }, [](StateData& data) { data.nodes.emplace_back(); }});
  const StateData second = table().state(1).data();
  expect_refused(
      second, "the number of rows",
      {[](StateData& data) { data.rows = 0; }, [](StateData& data) { data.blocks = 0; },
       [](StateData& data) { data.weight = 0.0; }, [](StateData& data) { data.weight = infinite; },
       [](StateData& data) { data.weight_scale = 0.0; }, [](StateData& data) { data.weight_scale = infinite; }});
  expect_refused(
      second, "what is known of the columns",
      {[](StateData& data) { data.range.pop_back(); }, [](StateData& data) { data.mean.conservativeResize(3); },
       [](StateData& data) { data.scale.conservativeResize(3); }, [](StateData& data) { data.edges.pop_back(); },
       [](StateData& data) { data.mean(1) = no_number; }, [](StateData& data) { data.scale(3) = infinite; },
       [](StateData& data) { data.scale(0) = 0.0; }});
  expect_refused(second, "the edges of bins",
                 {[](StateData& data) { data.edges[0][1] = data.edges[0][0]; },
                  [](StateData& data) {
                    data.edges[0].resize(256);
                    for (int k = 0; k < 256; ++k) data.edges[0][k] = k;
                  }});
}

TEST(StateChecks, Nodes) {
  const StateData sound = table().state(2).data();
  ASSERT_EQ(sound.nodes.size(), 3);
  ASSERT_EQ(sound.nodes[0].fate, Fate::inner);
  ASSERT_EQ(sound.step, Step::grow);
  expect_refused(sound, "what becomes of a node",
                 {[](StateData& data) { data.nodes[1].fate = static_cast<Fate>(-1); },
                  [](StateData& data) { data.nodes[1].fate = static_cast<Fate>(5); }});
  expect_refused(
      sound, "the number of rows of a node",
      {[](StateData& data) { data.nodes[1].rows = -1; }, [](StateData& data) { data.nodes[0].rows = 1201; }});
  expect_refused(
      sound, "the weight of a node",
      {[](StateData& data) { data.nodes[1].weight = -1.0; }, [](StateData& data) { data.nodes[1].weight = infinite; }});
  expect_refused(sound, "the model of a node",
                 {[](StateData& data) { data.nodes[1].base.conservativeResize(2); },
                  [](StateData& data) { data.nodes[1].base(2) = no_number; }});
  expect_refused(sound, "the sums of a node",
                 {[](StateData& data) { data.nodes[0].gram.pop_back(); },
                  [](StateData& data) { data.nodes[0].held_out.pop_back(); },
                  [](StateData& data) { data.nodes[0].low.conservativeResize(1); },
                  [](StateData& data) { data.nodes[0].high.conservativeResize(1); },
                  [](StateData& data) { data.nodes[0].low(1) = -infinite; },
                  [](StateData& data) { data.nodes[0].high(0) = infinite; },
                  [](StateData& data) { data.nodes[1].fate = Fate::leaf; }});
  expect_refused(sound, "a child of a node",
                 {[](StateData& data) { data.nodes[0].left = 0; }, [](StateData& data) { data.nodes[0].right = 3; },
                  [](StateData& data) {
                    data.nodes[0].left = 3;
                    data.nodes[0].right = 4;
                  },
                  [](StateData& data) {
                    data.nodes[0].left = 2;
                    data.nodes[0].right = 3;
                    data.nodes.resize(5, data.nodes[1]);
                  }});
  expect_refused(
      sound, "the split of a node",
      {[](StateData& data) { data.nodes[0].input = -1; }, [](StateData& data) { data.nodes[0].input = 3; },
       [](StateData& data) { data.nodes[0].threshold = no_number; },
       [](StateData& data) { data.nodes[0].level_side = {1}; }, [](StateData& data) { data.nodes[0].input = 2; }});
  expect_refused(sound, "the number of nodes",
                 {[](StateData& data) { data.nodes.pop_back(); }, [](StateData& data) { data.nodes.clear(); }});
  expect_refused(sound, "a node without a parent",
                 {[](StateData& data) { data.nodes.resize(5, data.nodes[1]); },
                  [](StateData& data) { data.nodes[0].fate = Fate::open; }});
  expect_refused(
      sound, "a node that is asked for",
      {[](StateData& data) { data.asked = {-1}; }, [](StateData& data) { data.asked = {3}; },
       [](StateData& data) {
         data.asked = {2, 1};
       },
       [](StateData& data) {
         data.asked = {1, 1};
       },
       [](StateData& data) { data.asked = {0}; }, [](StateData& data) { data.nodes[1].fate = Fate::branch; }});
  expect_refused(sound, "the list of nodes that are asked for", {[](StateData& data) { data.asked.clear(); }});
  ASSERT_EQ(sound.level_weight.size(), 3);
  expect_refused(
      sound, "the weights of the levels",
      {[](StateData& data) { data.level_weight.pop_back(); }, [](StateData& data) { data.level_weight[2].pop_back(); },
       [](StateData& data) { data.level_weight[2][0] = no_number; }});
}

// Sides of levels are -1, 0 and 1.
TEST(StateChecks, SidesOfLevels) {
  StateData data = table().state(2).data();
  data.nodes[0].input = 2;
  for (const Eigen::Index side : {-2, -1, 0, 1, 2}) {
    data.nodes[0].level_side = {1, side};
    EXPECT_EQ(read(data),
              std::abs(side) < 2 ? "nothing was thrown" : "f: the split of a node does not go with the rest")
        << side;
  }
}

TEST(StateChecks, Sums) {
  const Checked rows = table();
  const State state = rows.state(2);
  const std::string bytes = sums({rows.inputs, rows.output, 0}, state, 1).to_bytes();
  const auto refusal_of = [&](const std::function<void(SumsData&)>& change) {
    auto data = from_bytes<SumsData>(unsealed('+', bytes, "f"));
    change(data);
    return oracle::thrown<std::runtime_error>([&] { Sums::from_bytes(sealed('+', to_bytes(data)), "f"); });
  };
  const auto expect_refused_sums = [&](const std::string& what,
                                       const std::vector<std::function<void(SumsData&)>>& changes) {
    for (std::size_t k = 0; k < changes.size(); ++k) {
      EXPECT_EQ(refusal_of(changes[k]), "f: " + what + " does not go with the rest") << k;
    }
  };
  const auto sum_of = [](SumsData& data) -> BlockSum& {
    return std::get<0>(BlockSums<BlockSum>::fields(data.runs.front().sums)).front().sum;
  };
  EXPECT_EQ(refusal_of([](SumsData&) {}), "nothing was thrown");
  expect_refused_sums(
      "the number of inputs or bins",
      {[](SumsData& data) { data.inputs = -1; }, [](SumsData& data) { data.columns = 1 + (data.inputs = 1 << 20); },
       [](SumsData& data) { data.step = Step::finished; }, [](SumsData& data) { data.regressors = 4; },
       [](SumsData& data) { data.regressors = -1; }, [](SumsData& data) { data.columns = data.inputs; },
       [](SumsData& data) { data.columns = data.inputs + 3; }, [](SumsData& data) { data.bins = -1; },
       [](SumsData& data) { data.bins = 256 * 3 + 1; }, [](SumsData& data) { data.unknowns = -1; },
       [](SumsData& data) { data.unknowns = most_unknowns + 1; }});
  expect_refused_sums(
      "a block",
      {[](SumsData& data) { data.runs[0].first = -1; }, [](SumsData& data) { data.runs[0].first = 1; },
       [](SumsData& data) { data.runs[0].last = 0; }, [](SumsData& data) { data.runs[0].last += 1; },
       [](SumsData& data) { data.runs[0].last -= 1; }, [](SumsData& data) { data.runs.push_back(data.runs.front()); }});
  expect_refused_sums("the description of the columns",
                      {[&](SumsData& data) { sum_of(data).description.range.resize(1); },
                       [&](SumsData& data) { sum_of(data).description.total.resize(4); },
                       [&](SumsData& data) { sum_of(data).description.missing.resize(3); },
                       [&](SumsData& data) { sum_of(data).description.rows = -1; },
                       [&](SumsData& data) { sum_of(data).description.sample.values.resize(1); }});
  expect_refused_sums("a branch", {[&](SumsData& data) { sum_of(data).branches[1]; }});
  expect_refused_sums("the equations of a tree", {[&](SumsData& data) { sum_of(data).joint.gram.resize(1, 1); },
                                                  [&](SumsData& data) { sum_of(data).joint.leaf_rows.resize(1); },
                                                  [&](SumsData& data) {
                                                    sum_of(data).joint.leaf_rows.resize(1);
                                                    sum_of(data).joint.leaf_squares.resize(1);
                                                  }});
  expect_refused_sums("the sums of a node", {[&](SumsData& data) { sum_of(data).nodes.at(1).grams.pop_back(); },
                                             [&](SumsData& data) { sum_of(data).nodes.at(1).counts.pop_back(); },
                                             [&](SumsData& data) { sum_of(data).nodes.at(1).held_out.pop_back(); },
                                             [&](SumsData& data) { sum_of(data).nodes.at(1).range.pop_back(); },
                                             [&](SumsData& data) { sum_of(data).nodes.at(2).counts[0] = -1; }});
}

}  // namespace
}  // namespace llmt::distributed
