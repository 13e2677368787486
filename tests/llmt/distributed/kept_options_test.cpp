// Every option of a fit is kept by a distributed fit, or refused by its name. An option that is added is so without a
// line here.
#include "distributed/kept_options.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <string>
#include <type_traits>
#include <vector>

#include "llmt/distributed.hpp"
#include "llmt/fit.hpp"
#include "llmt/intervals.hpp"
#include "llmt/stream.hpp"
#include "oracles/changed_options.hpp"
#include "oracles/thrown.hpp"
#include "oracles/toy_options.hpp"

namespace llmt {

namespace {

using distributed::from_kept;
using distributed::kept;

TEST(KeptOptions, AToyOptionIsKeptOrRefused) {
  const ToyOptions back = from_kept<ToyOptions>(kept(ToyOptions{.folds = 7, .toy = 0.25}));
  EXPECT_EQ(back.folds, 7);
  EXPECT_EQ(back.toy, 0.25);
  EXPECT_EQ(oracle::thrown([] { require_taken(ToyOptions{.toy = 0.25}, in_stream); }),
            "llmt::stream_options: toy is not for streams; play without");
  EXPECT_NO_THROW(require_taken(ToyOptions{}, in_stream));
}

// The members that are visited lie one behind the other, with no more between them than their alignment asks for.
TEST(KeptOptions, EveryMemberOfFitOptionsIsVisited) {
  struct Place {
    std::size_t begin, end, alignment;
  };
  std::vector<Place> places;
  FitOptions options;
  for_each_field(options, [&](const OptionField&, auto& value) {
    const auto begin = static_cast<std::size_t>(reinterpret_cast<char*>(&value) - reinterpret_cast<char*>(&options));
    places.push_back({begin, begin + sizeof value, alignof(std::remove_reference_t<decltype(value)>)});
  });
  std::ranges::sort(places, {}, &Place::begin);
  constexpr std::size_t widest = alignof(FitOptions);  // a struct among the members begins at such a place
  std::size_t end = 0;
  for (const Place& place : places) {
    EXPECT_LT(place.begin - end, widest) << "a member before byte " << place.begin;
    end = place.end;
  }
  EXPECT_LT(sizeof(FitOptions) - end, widest);
}

TEST(KeptOptions, EveryOptionHasAnEntryOfItsOwn) {
  std::vector<std::string_view> names;
  std::vector<std::string_view> flags;
  for (const OptionField& field : option_fields()) {
    names.push_back(field.name);
    flags.push_back(field.flag);
    EXPECT_TRUE(field.flag.starts_with("--")) << field.name;
    EXPECT_FALSE(field.help.empty()) << field.name;
  }
  for (std::vector<std::string_view>* list : {&names, &flags}) {
    std::ranges::sort(*list);
    EXPECT_EQ(std::ranges::adjacent_find(*list), list->end());
  }
}

TEST(KeptOptions, EveryOptionIsKeptOrRefusedByItsName) {
  for (const auto& [field, options] : oracle::each_changed<FitOptions>()) {
    const Use& use = field.beyond_memory;
    try {
      const std::string bytes = kept(options);
      EXPECT_FALSE(use.is_refused()) << field.name;
      EXPECT_EQ(bytes != kept(FitOptions{}), use.is_taken()) << field.name;
      EXPECT_EQ(kept(from_kept<FitOptions>(bytes)), bytes) << field.name;
    } catch (const OptionRefused& refused) {
      EXPECT_EQ(refused.option(), field.name);
      EXPECT_TRUE(use.is_refused() || !use.refused_choice().empty()) << field.name;
    }
  }
}

TEST(KeptOptions, BytesThatAreNoOptionsAreRefused) {
  const std::string bytes = kept(FitOptions{});
  EXPECT_THROW(from_kept<FitOptions>(bytes.substr(0, bytes.size() - 1)), std::runtime_error);
  EXPECT_THROW(from_kept<FitOptions>(bytes + '\0'), std::runtime_error);
  std::string gaussian;
  const FitOptions options;
  for_each_field(options, [&](const OptionField& field, const auto& value) {
    if (!field.beyond_memory.is_taken()) return;
    if (field.name == "validity") {
      distributed::write_option(ValidityChoice::gaussian, gaussian);
    } else {
      distributed::write_option(value, gaussian);
    }
  });
  EXPECT_THROW(from_kept<FitOptions>(gaussian), std::runtime_error);
}

TEST(KeptOptions, StreamsTakeOrRefuseEveryOption) {
  for (const auto& [field, options] : oracle::each_changed<FitOptions>()) {
    try {
      const bool differs = stream_options(options) != StreamOptions{};
      EXPECT_FALSE(field.in_stream.is_refused()) << field.name;
      EXPECT_EQ(differs, field.in_stream.is_taken() && field.name != "validity") << field.name;  // of snapshot()
    } catch (const OptionRefused& refused) {
      EXPECT_EQ(refused.option(), field.name);
      EXPECT_TRUE(field.in_stream.is_refused()) << field.name;
    }
  }
}

// A table that one branch holds becomes the model of fit(), whatever the option that is kept.
TEST(KeptOptions, AKeptOptionDoesWhatItDoesInFit) {
  constexpr Eigen::Index rows = 240;
  constexpr Eigen::Index block_rows = 120;
  TrainingData data{.inputs = Eigen::MatrixXd(rows, 3), .outputs = Eigen::MatrixXd(rows, 1)};
  for (Eigen::Index i = 0; i < rows; ++i) {
    const auto t = static_cast<double>(i);
    data.inputs.row(i) << std::fmod(0.618 * t, 1.0), std::fmod(0.414 * t, 1.0), std::floor(std::fmod(0.732 * t, 4.0));
    data.outputs(i, 0) = std::abs(data.inputs(i, 0) - 0.4) + 0.3 * std::sin(9.0 * data.inputs(i, 1)) +
                         0.02 * std::fmod(17.3 * t, 1.0) + (data.inputs(i, 2) == 1.0 ? 1.0 : 0.0);
  }
  data.input_names = {"a", "b", "c"};
  data.output_names = {"y"};
  const auto expect_equal = [&](const std::string& name, const FitOptions& options, bool may_have_codes) {
    distributed::State state = distributed::start(
        data.input_names, "y", {.block_rows = block_rows, .fit = options, .may_have_codes = may_have_codes});
    while (!state.finished()) {
      distributed::Sums all = distributed::sums({data.inputs, data.outputs.col(0), 0}, state, 1);
      state = distributed::advance(state, std::move(all), {}, 1);
    }
    TrainingData same = data;
    same.may_have_codes = may_have_codes;
    const FitResult expected = fit(same, options);
    EXPECT_EQ(state.model_json(), to_json(expected.model, expected.intervals)) << name;
    return state.model_json();
  };
  const std::string by_default = expect_equal("defaults", {}, true);
  EXPECT_NE(expect_equal("may_have_codes", {}, false), by_default);
  for (auto& [field, options] : oracle::each_changed<FitOptions>()) {
    if (!field.beyond_memory.is_taken()) continue;
    if (field.name == "expert.search") options.expert.search = SplitSearch::binned;  // exact is refused
    if (options.max_leaves == 0) options.max_leaves = 6;
    expect_equal(std::string(field.name), options, true);
  }
}

}  // namespace
}  // namespace llmt
