// Sums of trees, from rows to files.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "llmt/boosted.hpp"
#include "llmt/fit.hpp"
#include "llmt/random.hpp"
#include "oracles/boosted_formula.hpp"
#include "oracles/friedman.hpp"
#include "oracles/random_boosted.hpp"

namespace {

using oracle::friedman;

constexpr double no_value = std::numeric_limits<double>::quiet_NaN();

// Missing values, a categorical input, two outputs.
llmt::TrainingData mixed(Eigen::Index rows) {
  llmt::TrainingData data = friedman(rows, 2);
  llmt::Random random(3);
  data.outputs.conservativeResize(Eigen::NoChange, 2);
  for (Eigen::Index i = 0; i < rows; ++i) {
    data.inputs(i, 5) = static_cast<double>(random.below(3));
    data.outputs(i, 1) = data.inputs(i, 5) == 1.0 ? 5.0 : data.inputs(i, 0);
    if (random.uniform() < 0.1) data.inputs(i, 2) = no_value;
  }
  data.levels = {{}, {}, {}, {}, {}, {"red", "green", "blue"}};
  data.input_names = {"a", "b", "c", "d", "e", "colour"};
  data.output_names = {"p", "q"};
  return data;
}

TEST(BoostedModel, PredictsTheSumOfItsTreesToTheBit) {
  llmt::TrainingData data = mixed(600);
  llmt::Random random(4);  // of noise no variant is proven better than crisp trees, whose sums have one order
  for (double& value : data.outputs.reshaped()) value += 20.0 * random.normal();
  const llmt::BoostedModel model = llmt::fit_boosted(data, {.max_rounds = 30}).model;
  const Eigen::MatrixXd predicted = model.predict(data.inputs, 2);
  int blends = 0;
  for (Eigen::Index i = 0; i < data.inputs.rows(); ++i) {
    for (Eigen::Index o = 0; o < 2; ++o) {
      EXPECT_EQ(predicted(i, o), boosted_formula::sum_at(model, o, data.inputs.row(i), blends));
    }
    EXPECT_EQ(model.predict(data.inputs.row(i)), predicted.row(i));
  }
}

TEST(BoostedModel, BlendsTheSidesOfSoftSplits) {
  const llmt::BoostedModel model = random_boosted::model({.soft = true, .turned = true}, 1);
  const Eigen::MatrixXd inputs = random_boosted::rows(200, 1);
  const Eigen::MatrixXd predicted = model.predict(inputs);
  int blends = 0;
  for (Eigen::Index i = 0; i < inputs.rows(); ++i) {
    for (Eigen::Index o = 0; o < 2; ++o) {
      EXPECT_NEAR(predicted(i, o), boosted_formula::sum_at(model, o, inputs.row(i), blends), 1e-12);
    }
  }
  EXPECT_GT(blends, 200);
}

TEST(FitBoosted, IsTheSameBytesAtAnyNumberOfThreads) {
  const llmt::TrainingData data = friedman(5200, 4);  // enough for the races
  llmt::BoostOptions options{.max_rounds = 12, .max_threads = 1};
  const llmt::BoostResult one = llmt::fit_boosted(data, options);
  EXPECT_GE(one.summaries[0].compared.size(), 4U);
  for (const int threads : {2, 8}) {
    options.max_threads = threads;
    EXPECT_EQ(to_json(llmt::fit_boosted(data, options).model), to_json(one.model)) << threads;
  }
}

TEST(FitBoosted, TakesARowOfWeightKForKRowsToTheByte) {
  llmt::TrainingData weighted = friedman(200, 5);
  weighted.weights = Eigen::VectorXd::Ones(200);
  llmt::TrainingData repeated = weighted;
  repeated.weights.resize(0);
  Eigen::Index rows = 200;
  for (Eigen::Index i = 0; i < 200; i += 3) {
    weighted.weights(i) = 3.0;
    for (int copy = 0; copy < 2; ++copy) {
      repeated.inputs.conservativeResize(rows + 1, Eigen::NoChange);
      repeated.outputs.conservativeResize(rows + 1, Eigen::NoChange);
      repeated.inputs.row(rows) = weighted.inputs.row(i);
      repeated.outputs.row(rows++) = weighted.outputs.row(i);
    }
  }
  weighted.weights(1) = 0.0;
  repeated.weights = Eigen::VectorXd::Ones(rows);
  repeated.weights(1) = 0.0;
  const llmt::BoostOptions options{.max_rounds = 20};
  EXPECT_EQ(to_json(llmt::fit_boosted(weighted, options).model), to_json(llmt::fit_boosted(repeated, options).model));
}

TEST(FitBoosted, PredictsNewRowsBetterThanOneTreeWithSteps) {
  // Many steps, which one tree of few rows cannot have.
  const auto steps = [](Eigen::Index rows, std::uint64_t seed) {
    llmt::TrainingData data = friedman(rows, seed);
    for (Eigen::Index i = 0; i < rows; ++i) {
      const auto x = data.inputs.row(i);
      data.outputs(i, 0) = std::floor(4.0 * x(0)) * std::floor(3.0 * x(1)) + 2.0 * std::floor(5.0 * x(2)) + x(3);
    }
    return data;
  };
  const llmt::TrainingData data = steps(800, 6);
  const llmt::TrainingData fresh = steps(2000, 7);
  const llmt::BoostResult boosted = llmt::fit_boosted(data);
  const double error = llmt::rmse(boosted.model.predict(fresh.inputs), fresh.outputs)(0);
  const llmt::Model tree = llmt::fit(data).model;
  EXPECT_LT(error, 0.8 * llmt::rmse(tree.predict(fresh.inputs), fresh.outputs)(0));
  // Of trees of four fifths of the rows, so rather too large.
  EXPECT_LT(error, 1.15 * boosted.summaries[0].rmse);
}

TEST(FitBoosted, FitsTheOtherRowsAloneWhereRowsAreHeldOut) {
  llmt::TrainingData data = friedman(300, 8);
  for (Eigen::Index row = 0; row < 60; ++row) data.held_out.push_back(row);
  const llmt::BoostResult result = llmt::fit_boosted(data, {.max_rounds = 40});
  EXPECT_EQ(result.summaries[0].rows, 240);
  EXPECT_EQ(result.summaries[0].held_out, 60);
  const Eigen::MatrixXd predicted = result.model.predict(data.inputs.topRows(60));
  EXPECT_NEAR(result.summaries[0].rmse, llmt::rmse(predicted, data.outputs.topRows(60))(0), 1e-5);
}

// The error of several seeds is that of the model on the held-out rows, and no larger than the mean of the seeds' own.
TEST(FitBoosted, IsTheMeanOfSeveralSeeds) {
  llmt::TrainingData data = friedman(900, 21);
  llmt::Random random(22);
  for (double& value : data.outputs.reshaped()) value += random.normal();
  for (Eigen::Index i = 0; i < 900; i += 4) data.held_out.push_back(i);
  const llmt::BoostOptions three{.seeds = 3, .max_threads = 2};
  const llmt::BoostResult mean = llmt::fit_boosted(data, three);
  const Eigen::VectorXd predicted = mean.model.predict(data.inputs).col(0);
  double squares = 0.0;
  for (Eigen::Index i = 0; i < 900; i += 4) squares += std::pow(predicted(i) - data.outputs(i, 0), 2);
  EXPECT_NEAR(mean.summaries[0].rmse, std::sqrt(squares / 225.0), 1e-5);
  EXPECT_LT(mean.summaries[0].rmse, llmt::fit_boosted(data).summaries[0].rmse);
  EXPECT_EQ(llmt::to_json(llmt::fit_boosted(data, {.seeds = 3, .max_threads = 1}).model), llmt::to_json(mean.model));
  // Few rows: all of them are held out in turn.
  const llmt::TrainingData few = friedman(120, 23);
  const llmt::BoostSummary one = llmt::fit_boosted(few).summaries[0];
  const llmt::BoostSummary two = llmt::fit_boosted(few, {.seeds = 2}).summaries[0];
  EXPECT_EQ(two.held_out, 120);
  EXPECT_EQ(two.seeds, 2);
  EXPECT_LT(two.rmse, 1.05 * one.rmse);
  EXPECT_NE(two.rmse, one.rmse);
}

TEST(FitBoosted, DoesNotDependOnTheUnitOfAnOutput) {
  llmt::TrainingData data = friedman(300, 9);
  const llmt::BoostOptions options{.max_rounds = 20};
  const Eigen::MatrixXd predicted = llmt::fit_boosted(data, options).model.predict(data.inputs);
  data.outputs *= 1024.0;
  EXPECT_EQ(llmt::fit_boosted(data, options).model.predict(data.inputs), 1024.0 * predicted);
}

TEST(FitBoosted, KeepsPredictionsNearTheOutputsFarOutside) {
  const llmt::TrainingData data = friedman(400, 10);
  const llmt::BoostedModel model = llmt::fit_boosted(data).model;
  const double range = data.outputs.maxCoeff() - data.outputs.minCoeff();
  for (const double far : {-1e6, 1e6}) {
    const double value = model.predict(Eigen::MatrixXd::Constant(1, 6, far))(0, 0);
    EXPECT_GT(value, data.outputs.minCoeff() - range);
    EXPECT_LT(value, data.outputs.maxCoeff() + range);
  }
  EXPECT_GT(llmt::distance_outside(model, Eigen::MatrixXd::Constant(1, 6, 1e6))[0], 1e5);
  EXPECT_EQ(llmt::distance_outside(model, data.inputs.topRows(1))[0], 0.0);
}

TEST(FitBoosted, EndsWhereTheProgressSaysSo) {
  EXPECT_THROW(llmt::fit_boosted(friedman(300, 11), {}, [](const llmt::ProgressReport&) { return false; }),
               llmt::Cancelled);
}

TEST(FitBoosted, PredictsAnOutputThatNeverVaries) {
  llmt::TrainingData data = friedman(50, 12);
  data.outputs.setConstant(3.5);
  const llmt::BoostedModel model = llmt::fit_boosted(data).model;
  EXPECT_EQ(model.predict(data.inputs.topRows(1))(0, 0), 3.5);
}

TEST(FitBoosted, IsTheMeanOfFewRowsWhereThatIsAskedFor) {
  llmt::TrainingData data = friedman(9, 13);
  data.weights = Eigen::VectorXd::LinSpaced(9, 0.5, 2.5);
  const llmt::BoostResult result = llmt::fit_boosted(data, {.mean_of_few = true});
  EXPECT_EQ(result.summaries[0].variant, "mean");
  EXPECT_TRUE(result.model.sums()[0].trees.empty());
  const double mean = data.weights.dot(data.outputs.col(0)) / data.weights.sum();
  EXPECT_NEAR(result.model.predict(data.inputs)(4, 0), mean, 1e-12);
  EXPECT_FALSE(result.model.has_intervals());
}

void expect_refusal(const llmt::TrainingData& data, const llmt::BoostOptions& options, const std::string& words) {
  try {
    llmt::fit_boosted(data, options);
    FAIL() << words;
  } catch (const std::invalid_argument& error) {
    EXPECT_NE(std::string(error.what()).find(words), std::string::npos) << error.what();
  }
}

TEST(FitBoosted, SaysWhatIsWrong) {
  expect_refusal(friedman(50, 1), {.seeds = 0}, "seeds is 0, it must be from 1 to 100");
  expect_refusal(friedman(9, 1), {}, "different rows: 9; a sum of trees needs at least 10, one tree takes fewer");
  expect_refusal(friedman(50, 1), {.rate = 1.5}, "rate is 1.5");
  expect_refusal(friedman(50, 1), {.max_rounds = 0}, "max_rounds is 0");
  llmt::TrainingData data = friedman(50, 1);
  data.inputs(3, 2) = std::numeric_limits<double>::infinity();
  expect_refusal(data, {}, "inputs(3, 2) is inf");
}

TEST(BoostedFile, ReadsBackExactly) {
  const llmt::TrainingData data = mixed(200);
  const llmt::BoostedModel model = llmt::fit_boosted(data, {.max_rounds = 8}).model;
  const std::string text = to_json(model);
  const llmt::BoostedModel again = llmt::boosted_from_json(text);
  EXPECT_EQ(to_json(again), text);
  EXPECT_EQ(again.predict(data.inputs), model.predict(data.inputs));
  EXPECT_EQ(again.inputs()[5].levels, data.levels[5]);
}

TEST(BoostedFile, KeepsTheSmallestShareOfOneTree) {
  const llmt::TrainingData data = friedman(200, 4);
  const llmt::BoostedModel model = llmt::fit_boosted(data, {.max_rounds = 8}).model;
  const auto has_no_smallest = [](const llmt::BoostedTree& tree) { return tree.smallest_share == 0.0; };
  ASSERT_EQ(std::ranges::count_if(model.sums()[0].trees, has_no_smallest), 1);
  const llmt::BoostedModel again = llmt::boosted_from_json(to_json(model));
  EXPECT_EQ(std::ranges::count_if(again.sums()[0].trees, has_no_smallest), 1);
  EXPECT_EQ(again.predict(data.inputs), model.predict(data.inputs));
}

TEST(BoostedFile, HasTheVersionThatKnowsDirectionsOnlyWhereThereAreSome) {
  const Eigen::MatrixXd inputs = random_boosted::rows(50, 1);
  for (const bool turned : {false, true}) {
    const llmt::BoostedModel model = random_boosted::model({.turned = turned}, 1);
    const std::string text = to_json(model);
    EXPECT_NE(text.find(turned ? "\"version\":3" : "\"version\":2"), std::string::npos);
    const llmt::BoostedModel again = llmt::boosted_from_json(text);
    EXPECT_EQ(again.sums()[0].features, model.sums()[0].features);
    EXPECT_EQ(again.predict(inputs), model.predict(inputs));
    EXPECT_EQ(to_json(again), text);
  }
}

void expect_fault(const std::string& text, const std::string& words) {
  try {
    llmt::boosted_from_json(text, "file");
    FAIL() << words;
  } catch (const std::runtime_error& error) {
    EXPECT_NE(std::string(error.what()).find(words), std::string::npos) << error.what();
  }
}

TEST(BoostedFile, SaysWhereItIsWrong) {
  using Json = nlohmann::ordered_json;
  const llmt::TrainingData data = mixed(600);
  Json good = Json::parse(to_json(llmt::fit_boosted(data, {.max_rounds = 3}).model));
  good["sums"][0]["trees"][0].erase("means");  // its leaves are changed
  const auto changed = [&](const std::string& pointer, const Json& value) {
    Json bad = good;
    bad[Json::json_pointer(pointer)] = value;
    return bad.dump();
  };
  expect_fault(changed("/format", "llmt-model"), "not a file of a boosted model");
  expect_fault(changed("/version", 4), "version 4 of the format");
  expect_fault(changed("/version", 0), "version 0 of the format");
  expect_fault(changed("/inputs/0/deviation", 0.0), "/inputs/0: deviation is not a positive number");
  expect_fault(changed("/inputs/1/name", "a"), "/inputs/1: its name is there twice");
  expect_fault(changed("/sums/0/rate", 2.0), "/sums/0: rate is not in (0, 1]");
  expect_fault(changed("/sums/0/features/0/column", 6), "/sums/0/features/0: 6 is no numeric input");
  expect_fault(changed("/sums/0/features/0/plus_column", good["sums"][0]["features"][0]["column"]), "is there twice");
  const auto direction = [&](const std::vector<int>& columns, const std::vector<double>& factors) {
    return changed("/sums/0/features/0", {{"columns", columns}, {"factors", factors}});
  };
  expect_fault(direction({}, {}), "/sums/0/features/0: it has no input");
  expect_fault(direction({0, 1}, {0.6}), "/sums/0/features/0: not one factor an input");
  expect_fault(direction({0, 0}, {0.6, 0.8}), "/sums/0/features/0: input 0 is there twice");
  expect_fault(direction({0, 6}, {0.6, 0.8}), "/sums/0/features/0: 6 is no numeric input");
  expect_fault(changed("/sums/0/trees/0/splits/0/0", 99), "/sums/0/trees/0/splits/0: there is no feature 99");
  expect_fault(changed("/sums/0/trees/0/splits/0/4", 0), "/sums/0/trees/0/splits/0: 0 is no child");
  expect_fault(changed("/sums/0/trees/0/splits/0/4", -2000000000), "is no child");
  expect_fault(changed("/sums/0/trees/0/leaves/0", {1.0, 2.0}), "/sums/0/trees/0/leaves/0: a leaf has 3 numbers");
  expect_fault(changed("/sums/0/trees/0/leaves/0", {1.0, 3.0, 2.0}), "low and high are no range");
  expect_fault(changed("/sums/0/trees/0/splits/0/3", 1.01),
               "/sums/0/trees/0/splits/0: missing_left is not from 0 to 1");
  expect_fault(changed("/sums/0/trees/0/splits/0/3", -0.01), "missing_left is not from 0 to 1");
  const std::size_t means = good["sums"][0]["trees"][1]["means"].size();
  expect_fault(changed("/sums/0/trees/1/means", {1.0}),
               "/sums/0/trees/1/means: 1 means of " + std::to_string(means) + " slopes");
  expect_fault(changed("/sums/0/trees/0/smallest_share", 0.6), "smallest_share is not from 0 to 0.5");
  Json steep = {1.0, 0.0, 2.0};
  for (int slope = 0; slope <= llmt::most_leaf_slopes; ++slope) steep.insert(steep.end(), {0, 1.0});
  expect_fault(changed("/sums/0/trees/0/leaves/0", steep), "more than 12 slopes");
  expect_fault(changed("/sums/0/trees/0/leaves/0", {1.0, 1.0, 2.0, -1, 1.0}), "there is no feature -1");
  expect_fault(changed("/sums/0/residuals", {1.0, 2.0, -1.0}),
               "/sums/0/held_out/0/residuals/2: residuals are not finite");
  expect_fault(changed("/sums/1", Json::object()), "/sums/1");
  expect_fault("{}", "not a file of a boosted model");
}

TEST(BoostedFile, IsRefusedByNameWhereOneTreeIsNeeded) {
  const std::string text = to_json(llmt::fit_boosted(friedman(50, 1), {.max_rounds = 2}).model);
  try {
    llmt::from_json(text);
    FAIL();
  } catch (const std::runtime_error& error) {
    EXPECT_NE(std::string(error.what()).find("a boosted model, the sum of many trees"), std::string::npos);
  }
}

}  // namespace
