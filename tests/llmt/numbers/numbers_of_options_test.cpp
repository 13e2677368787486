// Every number among the options of every way of fitting, set to what nobody means: a finite model, or a refusal. An
// option that is added is walked without a line here, but for those of teaching, which have no visitor.
#include <fmt/format.h>

#include <optional>
#include <string_view>
#include <type_traits>

#include "hostile_numbers.hpp"
#include "llmt/boosted.hpp"
#include "llmt/compare.hpp"
#include "llmt/distributed.hpp"
#include "llmt/fit.hpp"
#include "llmt/option_fields.hpp"
#include "llmt/readable.hpp"
#include "llmt/stream.hpp"
#include "llmt/teach.hpp"

namespace {

using namespace hostile;

// The values that a member is set to; none: it is no number.
template <class Member>
std::vector<Member> values_for() {
  if constexpr (std::is_same_v<Member, double>) {
    return numbers;
  } else if constexpr (std::is_same_v<Member, bool> || std::is_enum_v<Member>) {
    return {};
  } else if constexpr (std::is_integral_v<Member>) {
    return wholes<Member>();
  } else if constexpr (requires { typename Member::value_type; }) {
    std::vector<Member> lists;
    for (const auto& value : values_for<typename Member::value_type>()) lists.push_back({value});
    return lists;
  } else {
    return {};
  }
}

template <class Value>
std::string text_of(const Value& value) {
  if constexpr (requires { value.size(); }) {
    return "{" + text_of(value.front()) + "}";
  } else if constexpr (std::is_arithmetic_v<Value>) {
    return fmt::format("{}", value);
  } else {
    return "?";
  }
}

std::string_view name_of_field(const llmt::OptionField& field) { return field.name; }
std::string_view name_of_field(const char* name) { return name; }

// Calls use(what, options) with the k-th number of the options set to each of the values, for all k.
template <class Options, class Use>
int walk(const Options& defaults, const Use& use) {
  int members = 0;
  Options options = defaults;
  for_each_field(options, [&](const auto& field, auto& member) {
    const auto kept = member;
    const auto values = values_for<std::remove_cvref_t<decltype(member)>>();
    members += values.empty() ? 0 : 1;
    for (const auto& value : values) {
      member = value;
      use(fmt::format("{} = {}", name_of_field(field), text_of(value)), options);
    }
    member = kept;
  });
  return members;
}

bool distributed_model_is_finite(const llmt::distributed::Options& options, const llmt::TrainingData& data) {
  namespace distributed = llmt::distributed;
  distributed::State state = distributed::start({"a", "b"}, "y", options);
  const Eigen::VectorXd output = data.outputs.col(0);
  while (!state.finished()) {
    distributed::Rows rows{data.inputs, output, 0, data.weights};
    state = distributed::advance(state, distributed::sums(rows, state));
  }
  return is_finite(state.model(), data.inputs);
}

TEST(NumbersOfOptions, OfAFit) {
  const llmt::TrainingData data = small_table();
  const int members = walk(llmt::FitOptions{}, [&](const std::string& what, const llmt::FitOptions& options) {
    expect_finite_or_refused("fit " + what, [&] { return is_finite(llmt::fit(data, options).model, data.inputs); });
    expect_finite_or_refused("beyond memory " + what,
                             [&] { return distributed_model_is_finite({.fit = options}, data); });
    expect_finite_or_refused("stream " + what, [&] {
      llmt::Stream stream(2, 1, llmt::stream_options(options));
      stream.add(data.inputs, data.outputs);
      return is_finite(stream.snapshot(), data.inputs);
    });
  });
  EXPECT_GE(members, 12);
}

// Lists of the rules and validities that take them.
TEST(NumbersOfOptions, OfBlendsGaussiansAndGates) {
  const llmt::TrainingData data = small_table(40);
  llmt::FitOptions blend;
  blend.validity = llmt::ValidityChoice::blend;
  blend.max_leaves = 4;
  llmt::FitOptions gaussian = blend;
  gaussian.validity = llmt::ValidityChoice::gaussian;
  llmt::FitOptions gates = blend;
  gates.rule = llmt::GrowthRule::hilomot;
  gates.validity = llmt::ValidityChoice::automatic;
  for (const llmt::FitOptions& kind : {blend, gaussian, gates}) {
    walk(kind, [&](const std::string& what, const llmt::FitOptions& options) {
      if (what.find("expert.") == std::string::npos) return;
      expect_finite_or_refused(what, [&] { return is_finite(llmt::fit(data, options).model, data.inputs); });
    });
  }
}

TEST(NumbersOfOptions, OfASumOfTrees) {
  const llmt::TrainingData data = small_table();
  const llmt::BoostOptions few{.max_rounds = 20};
  const int members = walk(few, [&](const std::string& what, const llmt::BoostOptions& options) {
    if (options.max_rounds > few.max_rounds && options.max_rounds <= 100000) return;  // long, and no other numbers
    expect_finite_or_refused("boost " + what,
                             [&] { return is_finite(llmt::fit_boosted(data, options).model, data.inputs); });
  });
  EXPECT_EQ(members, 5);
}

TEST(NumbersOfOptions, OfAStream) {
  const llmt::TrainingData data = small_table(400);
  const int members = walk(llmt::StreamOptions{}, [&](const std::string& what, const llmt::StreamOptions& options) {
    expect_finite_or_refused("stream " + what, [&] {
      llmt::Stream stream(2, 1, options);
      stream.add(data.inputs, data.outputs);
      return is_finite(stream.snapshot(), data.inputs) && stream.predict(data.inputs).allFinite() &&
             is_finite(llmt::stream_from_json(llmt::to_json(stream)).snapshot(), data.inputs);
    });
  });
  EXPECT_EQ(members, 7);
}

TEST(NumbersOfOptions, OfTeaching) {
  const llmt::TrainingData data = small_table(60);
  const llmt::TeachOptions usual{.teacher = [](const llmt::TrainingData&, const llmt::Progress&) -> llmt::Answers {
                                   return [](const Eigen::Ref<const Eigen::MatrixXd>& inputs) -> Eigen::MatrixXd {
                                     return inputs.col(0);
                                   };
                                 },
                                 .most_made_rows = 50};
  const auto teach = [&](const std::string& what, const auto& change) {
    llmt::TeachOptions options = usual;
    change(options);
    expect_finite_or_refused("teach " + what,
                             [&] { return is_finite(llmt::fit_taught(data, {}, options).fit.model, data.inputs); });
  };
  for (const double value : numbers) {
    teach(fmt::format("swapped {}", value), [&](auto& options) { options.swapped = value; });
  }
  for (const int value : wholes<int>()) {
    teach(fmt::format("made_rows {}", value), [&](auto& options) { options.made_rows = value; });
    teach(fmt::format("neighbours {}", value), [&](auto& options) { options.neighbours = value; });
  }
  for (const Eigen::Index value : wholes<Eigen::Index>()) {
    if (value > 1000) continue;  // as many as made_rows makes
    teach(fmt::format("most_made_rows {}", value), [&](auto& options) { options.most_made_rows = value; });
  }
  for (const std::uint64_t value : wholes<std::uint64_t>()) {
    teach(fmt::format("seed {}", value), [&](auto& options) { options.seed = value; });
  }
}

TEST(NumbersOfOptions, OfFitsBeyondMemoryOfReadableTreesAndOfComparisons) {
  const llmt::TrainingData data = small_table(150);
  for (const Eigen::Index value : wholes<Eigen::Index>()) {
    const auto fit = [&](const char* what, const llmt::distributed::Options& options) {
      expect_finite_or_refused(fmt::format("{} = {}", what, value),
                               [&] { return distributed_model_is_finite(options, data); });
    };
    fit("branch_rows", {.branch_rows = value});
    fit("sample_rows", {.sample_rows = value});
    if (value != 1 && value != 3) fit("block_rows", {.block_rows = value});  // one block is given below
  }
  const llmt::PreparedFit prepared(small_table());
  const llmt::FitResult fitted = llmt::fit(prepared);
  for (const double value : numbers) {
    expect_finite_or_refused(fmt::format("readable loss {}", value), [&] {
      return is_finite(llmt::fit_readable(prepared, fitted.summary, {.loss = value}).model, prepared.data().inputs);
    });
  }
  const std::vector<llmt::Method> method = {{.name = "tree", .options = {}}};
  for (const int value : wholes<int>()) {
    expect_finite_or_refused(fmt::format("folds of a comparison {}", value), [&] {
      return std::isfinite(llmt::compare(small_table(), method, {.folds = {.count = value}}).methods[0].cv_rmse);
    });
  }
}

}  // namespace
