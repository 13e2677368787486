// Model files that no program of ours wrote: what they say is refused with the place, whatever it is.
#include <gtest/gtest.h>

#include <Eigen/Core>
#include <filesystem>
#include <limits>
#include <stdexcept>
#include <string>

#include "llmt/files.hpp"
#include "llmt/fit.hpp"
#include "llmt/intervals.hpp"
#include "model_files/json_parser.hpp"
#include "oracles/oracles.hpp"
#include "oracles/thrown.hpp"

namespace {

constexpr int many = 200'000;

std::string brackets(int depth) { return std::string(depth, '[') + std::string(depth, ']'); }

std::string objects(int depth) {
  std::string text;
  for (int i = 0; i < depth; ++i) text += "{\"a\":";
  return text + "0" + std::string(depth, '}');
}

std::string refusal_of(const std::string& json) {
  return oracle::thrown<std::runtime_error>([&] { llmt::from_json(json, "m.json"); });
}

// Two inputs, the second with levels, two outputs.
llmt::FitResult fitted_with_levels(Eigen::Index outputs = 2) {
  const Eigen::Index rows = 120;
  Eigen::MatrixXd x = oracle::uniform(rows, 2, 5);
  for (Eigen::Index i = 0; i < rows; ++i) x(i, 1) = static_cast<double>(i % 3);
  Eigen::MatrixXd y(rows, outputs);
  for (Eigen::Index o = 0; o < outputs; ++o) {
    y.col(o) = (x.col(0).array() * (o == 0 ? 1.0 : 2.0)).abs() + x.col(1).array();
  }
  llmt::FitResult result = llmt::fit({.inputs = x, .outputs = y, .categorical_inputs = {1}},
                                     {.max_leaves = 4, .validity = llmt::ValidityChoice::blend});
  result.model = result.model.named({"a", "kind"},
                                    outputs == 2 ? std::vector<std::string>{"u", "v"} : std::vector<std::string>{"u"},
                                    {{}, {"red", "green", "blue"}});
  return result;
}

const std::string& file() {
  static const std::string text = llmt::to_json(fitted_with_levels().model);
  return text;
}

// The file with the value of the first `key` behind `after` replaced.
std::string with(const std::string& after, const std::string& key, const std::string& value) {
  std::string text = file();
  std::size_t at = text.find("\"" + after + "\"");
  at = text.find("\"" + key + "\": ", at) + key.size() + 4;
  std::size_t end = at;
  for (int open = 0; open > 0 || (text[end] != ',' && text[end] != '\n'); ++end) {
    open += text[end] == '[' ? 1 : text[end] == ']' ? -1 : 0;
  }
  return text.replace(at, end - at, value);
}

struct Nonsense {
  const char* after;
  const char* key;
  const char* value;
  const char* message;
};

TEST(HostileFiles, ANumberThatNoFitWritesIsRefusedWithItsPlace) {
  for (const Nonsense& each : {
           Nonsense{"inputs", "centre", "1e12", "m.json: /inputs/0: centre 1000000000000 lies outside of the training"},
           Nonsense{"regressors", "centre", "1e12", "m.json: /regressors/0: centre 1000000000000 lies outside"},
           Nonsense{"level", "centre", "1.5",
                    "m.json: /regressors/1: centre 1.5 lies outside of the training extent 0"},
           Nonsense{"nodes", "low", "[-1e9, -1, -1]", "m.json: /partitions/0/nodes/0: low of regressor 0 is"},
           Nonsense{"nodes", "high", "[1e9, 1, 1]", "m.json: /partitions/0/nodes/0: high of regressor 0 is"},
           Nonsense{"nodes", "mean", "[1e-9, 50, 0]", "m.json: /partitions/0/nodes/0: mean of regressor 1 is 50"},
           Nonsense{"partitions", "residual_range", "[[1e9, 2e9]]", "m.json: /partitions/0: residual_range"},
           Nonsense{"nodes", "samples", "1000000000000000000", "m.json: /partitions/0/nodes/0: samples"},
           Nonsense{"slope", "samples", "121",
                    "m.json: /partitions/0/nodes/1: samples 121 is above that of its parent"},
           Nonsense{"nodes", "rank", "2147483647", "m.json: /partitions/0/nodes/0: rank 2147483647 is above"},
           Nonsense{"regressors", "level", "18446744073709551615",
                    "m.json: /regressors/1/level: 18446744073709551615 is out of range"},
           Nonsense{"validity", "width", "1e400",
                    "m.json: /partitions/0/validity/width: 1e400 is beyond the range of a"},
           Nonsense{"validity", "width", "1, \"width\": 1", "m.json: /partitions/0/validity/width: the member stands"},
       }) {
    const std::string error = refusal_of(with(each.after, each.key, each.value));
    const std::string expected = each.message;
    EXPECT_EQ(error.substr(0, expected.size()), expected) << error;
  }
}

TEST(HostileFiles, GaussiansNeedAWidth) {
  std::string text = with("validity", "kind", "\"gaussian\"");
  const std::size_t at = text.find("\"width\": ") + 9;
  for (const std::string width : {"0.0", "1e-308"}) {
    const std::string wrong = text.substr(0, at) + width + text.substr(text.find(',', at));
    EXPECT_EQ(refusal_of(wrong).find("m.json: /partitions/0: the width "), 0U) << refusal_of(wrong);
  }
}

TEST(HostileFiles, AFileThatContradictsItselfIsRefused) {
  for (const Nonsense& each : {
           Nonsense{"split", "input", "\"kind\"",
                    "m.json: /partitions/0/nodes/0/split/input: column 0 has the name \"a\""},
           Nonsense{"split", "half_width", "1e300",
                    "m.json: /partitions/0/nodes/0: half_width is 1e+300, with the width"},
           Nonsense{"validity", "kind", "\"crisp\"", "m.json: /partitions/0/nodes/0: half_width is "},
           Nonsense{"inverse_gram", "inverse_gram", "[0, 0, 0, 0, 0, 0, 0, 0, 0, 0]", "inverse_gram is no inverse"},
           Nonsense{"inverse_gram", "inverse_gram", "[-1, -1, -1, -1, -1, -1, -1, -1, -1, -1]",
                    "inverse_gram is no inverse"},
           Nonsense{"inverse_gram", "inverse_gram", "[1, 1.1, 1, 0, 0, 1, 0, 0, 0, 1]", "inverse_gram is no inverse"},
       }) {
    const std::string error = refusal_of(with(each.after, each.key, each.value));
    EXPECT_NE(error.find(each.message), std::string::npos) << each.value << ": " << error;
  }
  EXPECT_EQ(refusal_of(with("inverse_gram", "inverse_gram", "[1, 1, 1, 0, 0, 1, 0, 0, 0, 1]")), "nothing was thrown");
}

TEST(HostileFiles, LevelsAreAsManyAsATableMayHave) {
  llmt::InputColumn input{.name = "kind", .low = 0.0, .high = 1.0, .centre = 0.5};
  for (int k = 0; k < llmt::most_categories; ++k) input.levels.push_back(std::to_string(k));
  const auto error = [&] {
    return oracle::thrown([&] { llmt::Model({input}, {{.name = "y", .low = 0.0, .high = 1.0}}, {}, {}); });
  };
  EXPECT_EQ(error().find("levels"), std::string::npos) << error();
  input.levels.push_back("one more");
  EXPECT_EQ(error(), "llmt::Model: input 0: \"kind\": 10001 levels, at most 10000 are possible");
}

TEST(HostileFiles, NamesAreUnique) {
  EXPECT_EQ(refusal_of(with("centre", "name", "\"a\"")), "m.json: /inputs/1: two inputs have the name \"a\"");
  EXPECT_EQ(refusal_of(with("outputs", "name", "\"v\"")), "m.json: /outputs/1: two outputs have the name \"v\"");
  EXPECT_EQ(refusal_of(with("inputs", "levels", "[\"red\", \"red\", \"blue\"]")),
            "m.json: /inputs/1: two levels have the name \"red\"");
  const llmt::Model model = fitted_with_levels().model;
  EXPECT_EQ(oracle::thrown([&] {
              model.named({"a", "a"}, {"u", "v"});
            }),
            "llmt::Model: input 1: two inputs have the name \"a\"");
}

TEST(HostileFiles, NestingIsBounded) {
  for (const std::string& deep : {brackets(many), objects(many), std::string(many, '['), std::string(many, '{')}) {
    for (const char* key : {"version", "format", "unknown", "inputs"}) {
      EXPECT_EQ(refusal_of("{\"" + std::string(key) + "\":" + deep + "}").substr(0, 7), "m.json:");
    }
    EXPECT_EQ(refusal_of(deep).substr(0, 7), "m.json:");
  }
  EXPECT_NE(refusal_of(brackets(33)).find("more than 32 levels"), std::string::npos);
  EXPECT_EQ(refusal_of("{\"version\":" + brackets(30) + "}").find("m.json: not a model file"), 0U);
  EXPECT_NE(refusal_of(with("inputs", "low", brackets(20))).find("/inputs/0/low: a number is needed, not an array"),
            std::string::npos);
}

// 256 MiB of text and 16 777 216 values, containers counted, so that no file takes more than 2 GiB.
TEST(HostileFiles, SizeIsBounded) {
  const std::string five = "{\"a\":[1,2,3]}";
  EXPECT_NO_THROW(llmt::parse_json(five, "m.json", 5));
  EXPECT_EQ(oracle::thrown<std::runtime_error>([&] { llmt::parse_json(five, "m.json", 4); }),
            "m.json: /a/2: more than 4 values");
  std::string many_values = "{\"format\":[";
  for (std::size_t k = 0; k < std::size_t{1} << 24; ++k) many_values += "0,";
  EXPECT_EQ(refusal_of(many_values + "0]}"), "m.json: /format/16777214: more than 16777216 values");
  const std::string path = testing::TempDir() + "/large_model.json";
  llmt::write_file(path, "{");
  std::filesystem::resize_file(path, (std::uintmax_t{1} << 28) + 1);
  const std::string too_large = path + ": cannot be read: it holds more than 256 MiB, the most that is read";
  EXPECT_EQ(oracle::thrown<std::runtime_error>([&] { llmt::load(path); }), too_large);
  EXPECT_EQ(oracle::thrown<std::runtime_error>([&] { llmt::load_with_intervals(path); }), too_large);
  std::filesystem::remove(path);
}

TEST(HostileFiles, WhatCouldNotBeReadIsNotWritten) {
  const llmt::Model model = fitted_with_levels(1).model;
  constexpr Eigen::Index rows = Eigen::Index{1} << 24;
  const llmt::Intervals intervals({model}, {Eigen::MatrixXd::Zero(rows, 1)});
  const std::string error = oracle::thrown<std::runtime_error>([&] { llmt::to_json(model, intervals); });
  EXPECT_TRUE(error.starts_with("llmt::to_json: the model has 1677")) << error;
  EXPECT_NE(error.find("values; at most 256 MiB and 16777216 values are read"), std::string::npos) << error;
}

TEST(HostileFiles, LongTextsAreNotRepeatedInMessages) {
  const std::string text(1 << 20, 'x');
  for (const std::string& wrong :
       {with("inputs", "low", "\"" + text + "\""), with("validity", "kind", "\"" + text + "\""), text, "{\"" + text,
        with("inputs", "name", text), with("inputs", "low", "1" + std::string(1 << 20, '0'))}) {
    EXPECT_LT(refusal_of(wrong).size(), 500U) << refusal_of(wrong).substr(0, 500);
  }
}

// A file of `result`, with the intervals of `other`.
std::string mixed(const llmt::FitResult& result, const llmt::FitResult& other) {
  const std::string path = testing::TempDir() + "/llmt_mixed.json";
  llmt::save(other.model, other.intervals, path);
  const std::string text = llmt::read_file(path);
  const std::string model = llmt::to_json(result.model);
  llmt::write_file(path, model.substr(0, model.rfind('}')) + "," + text.substr(text.find(" \"intervals\"")));
  return path;
}

std::string error_of_file(const std::string& path) {
  return oracle::thrown<std::runtime_error>([&] { llmt::load_with_intervals(path); });
}

TEST(HostileFiles, IntervalsOfAnotherModelAreRefused) {
  const llmt::FitResult one = fitted_with_levels(1);
  const llmt::FitResult two = fitted_with_levels(2);
  const std::string own = mixed(two, two);
  EXPECT_EQ(error_of_file(own), "nothing was thrown");
  EXPECT_EQ(to_json(llmt::load_with_intervals(own).model), to_json(two.model));
  EXPECT_EQ(error_of_file(mixed(two, one)),
            testing::TempDir() +
                "/llmt_mixed.json: /intervals: the intervals belong to another model: fold 0 and the "
                "model have 2 inputs and 1 outputs, and 2 inputs and 2 outputs");
  EXPECT_EQ(oracle::thrown([&] { llmt::save(two.model, one.intervals, own); }).substr(0, 55),
            "llmt::to_json: the intervals belong to another model: f");
  // Other names, and another training extent.
  llmt::FitResult renamed = two;
  std::vector<llmt::Model> models;
  for (const llmt::Model& model : two.intervals.models()) models.push_back(model.named({"a", "sort"}, {"u", "v"}));
  renamed.intervals = llmt::Intervals(models, two.intervals.parts());
  EXPECT_NE(oracle::thrown([&] {
              llmt::save(two.model, renamed.intervals, own);
            }).find("input 1 of fold 0 is \"sort\", that of the model \"kind\""),
            std::string::npos);
  const Eigen::MatrixXd x = oracle::uniform(60, 2, 8);
  const llmt::FitResult near = llmt::fit(x, x.col(0));
  const llmt::FitResult far = llmt::fit(10.0 * x, x.col(0));
  EXPECT_NE(
      oracle::thrown([&] { llmt::save(near.model, far.intervals, own); }).find("input 0 of fold 0 was trained on"),
      std::string::npos);
  llmt::save(near.model, near.intervals, own);
  llmt::save(near.model.named({"a", "b"}, {"y"}), near.intervals, own);
  EXPECT_EQ(llmt::load_with_intervals(own).intervals.models().size(), near.intervals.models().size());
  std::filesystem::remove(own);
}

TEST(HostileFiles, IntervalsOfTheWrongTypeAreRefused) {
  const std::string path = testing::TempDir() + "/llmt_intervals.json";
  const std::string model = llmt::to_json(fitted_with_levels().model);
  for (const std::string& intervals :
       {std::string("7"), std::string("{}"), std::string("[7]"), "[{\"model\":" + brackets(many) + "}]",
        "[{\"model\":" + brackets(20) + "}]", "[{\"model\":" + model + "}]",
        "[{\"model\":" + model + ",\"residuals\":[[1],[1,2]]}]", "[{\"model\":" + model + ",\"residuals\":[[1]]}]",
        "[{\"model\":" + model + ",\"residuals\":[[1],[-1]]}]", "[{\"model\":" + model + ",\"residuals\":[1e400]}]",
        "[{\"model\":" + model + ",\"residuals\":[[1],[1]],\"residuals_incomplete\":7}]",
        "[{\"model\":" + model + ",\"residuals\":[[1],[1]],\"residuals_incomplete\":[[1]]}]",
        "[{\"model\":" + model + ",\"residuals\":[[1],[1]],\"residuals_incomplete\":[[1],[-1]]}]",
        "[{\"model\":" + model + ",\"parts\":7}]", "[{\"model\":" + model + ",\"parts\":[]}]",
        "[{\"model\":" + model + ",\"parts\":[{\"residuals\":[[1],[1]],\"spread\":[{\"nodes\":[]}]}]}]"}) {
    llmt::write_file(path, model.substr(0, model.rfind('}')) + ",\"intervals\":" + intervals + "}");
    EXPECT_EQ(error_of_file(path).find(path + ": /intervals"), 0U) << error_of_file(path) << intervals.substr(0, 40);
  }
  std::filesystem::remove(path);
}

}  // namespace
