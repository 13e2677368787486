// Every number of the data that a call takes, set to what nobody means: finite results, or a refusal.
#include <fmt/format.h>

#include <functional>
#include <map>

#include "hostile_numbers.hpp"
#include "llmt/boosted.hpp"
#include "llmt/boosted_explain.hpp"
#include "llmt/compare.hpp"
#include "llmt/distributed.hpp"
#include "llmt/explain.hpp"
#include "llmt/fit.hpp"
#include "llmt/intervals.hpp"
#include "llmt/outliers.hpp"
#include "llmt/stream.hpp"
#include "llmt/teach.hpp"

namespace {

using namespace hostile;
using Change = std::function<void(llmt::TrainingData&, double)>;

// A number of the data is one cell, or all cells of a column.
const std::map<std::string, Change>& changes() {
  static const std::map<std::string, Change> all = {
      {"an input", [](auto& data, double value) { data.inputs(3, 1) = value; }},
      {"a column", [](auto& data, double value) { data.inputs.col(1).setConstant(value); }},
      {"a scale", [](auto& data, double value) { data.inputs.col(1) *= value; }},
      {"a target", [](auto& data, double value) { data.outputs(3, 0) = value; }},
      {"all targets", [](auto& data, double value) { data.outputs.setConstant(value); }},
      {"the scale of targets", [](auto& data, double value) { data.outputs *= value; }},
      {"a weight",
       [](auto& data, double value) {
         data.weights.setOnes(data.inputs.rows());
         data.weights(3) = value;
       }},
      {"all weights", [](auto& data, double value) { data.weights.setConstant(data.inputs.rows(), value); }},
      {"half of the weights",
       [](auto& data, double value) {
         data.weights.setConstant(data.inputs.rows(), 0.25);
         data.weights.head(data.inputs.rows() / 2).setConstant(value);
       }},
      {"weights and scales",
       [](auto& data, double value) {
         data.weights.setConstant(data.inputs.rows(), value);
         data.inputs *= value;
         data.outputs *= value;
       }},
      {"a group",
       [](auto& data, double value) {
         for (Eigen::Index i = 0; i < data.inputs.rows(); ++i) data.groups.push_back(static_cast<double>(i));
         data.groups[3] = value;
       }},
      {"a category", [](auto& data, double value) {
         data.inputs.col(1) = (data.inputs.col(1).array() > 0.5).template cast<double>();
         data.inputs(3, 1) = value;
         data.categorical_inputs = {1};
       }}};
  return all;
}

template <class Learn>
void walk(const std::string& name, Eigen::Index rows, const Learn& learn) {
  for (const auto& [what, change] : changes()) {
    for (const double value : numbers) {
      llmt::TrainingData data = small_table(rows);
      change(data, value);
      expect_finite_or_refused(fmt::format("{}: {} is {}", name, what, value), [&] { return learn(data); });
    }
  }
}

TEST(NumbersOfData, OfATree) {
  walk("fit", 60, [](const llmt::TrainingData& data) { return is_finite(llmt::fit(data).model, data.inputs); });
}

TEST(NumbersOfData, OfARobustTree) {
  llmt::FitOptions options;
  options.loss = llmt::Loss::tukey;
  options.folds.count = 2;
  walk("tukey", 40, [&](const auto& data) { return is_finite(llmt::fit(data, options).model, data.inputs); });
}

TEST(NumbersOfData, OfASumOfTrees) {
  walk("boost", 40, [](const llmt::TrainingData& data) {
    return is_finite(llmt::fit_boosted(data, {.max_rounds = 10}).model, data.inputs);
  });
}

TEST(NumbersOfData, OfATaughtTree) {
  const llmt::TeachOptions teach{.teacher = [](const llmt::TrainingData&, const llmt::Progress&) -> llmt::Answers {
                                   return [](const Eigen::Ref<const Eigen::MatrixXd>& inputs) -> Eigen::MatrixXd {
                                     return inputs.col(0);
                                   };
                                 },
                                 .most_made_rows = 20};
  llmt::FitOptions options;  // two folds: it is the teaching that is asked
  options.folds.count = 2;
  options.max_leaves = 2;
  walk("teach", 20, [&](const llmt::TrainingData& data) {
    return is_finite(llmt::fit_taught(data, options, teach).fit.model, data.inputs);
  });
}

TEST(NumbersOfData, OfAComparison) {
  const std::vector<llmt::Method> methods = {{"sum", {}, llmt::BoostOptions{.max_rounds = 5}}, {"tree", {}, {}}};
  for (const auto& what : {"an input", "all weights", "a target"}) {
    for (const double value : numbers) {
      llmt::TrainingData data = small_table(30);
      changes().at(what)(data, value);
      expect_finite_or_refused(fmt::format("compare: {} is {}", what, value), [&] {
        for (const llmt::Comparison& found : llmt::compare(data, methods, {.folds = {.count = 2}}).methods) {
          if (!std::isfinite(found.cv_rmse)) return false;
        }
        return true;
      });
    }
  }
}

TEST(NumbersOfData, OfAStream) {
  walk("stream", 400, [](const llmt::TrainingData& data) {
    if (!data.groups.empty() || !data.categorical_inputs.empty()) return true;  // a stream has neither
    llmt::Stream stream(2, 1);
    stream.add(data.inputs, data.outputs, data.weights);
    if (!is_finite(stream.snapshot(), data.inputs) || !stream.prequential_rmse().allFinite()) return false;
    llmt::Stream copy = llmt::stream_from_json(to_json(stream));
    return is_finite(llmt::merge(std::move(stream), std::move(copy)).snapshot(), data.inputs);
  });
}

TEST(NumbersOfData, OfAFitBeyondMemory) {
  namespace distributed = llmt::distributed;
  for (const Eigen::Index branch_rows : {100, 100000}) {  // the top of a tree by sums; all in one memory
    walk("beyond memory", 130, [&](const llmt::TrainingData& data) {
      if (!data.groups.empty()) return true;
      distributed::Options options{.branch_rows = branch_rows, .sample_rows = 100};
      options.weighted = data.weights.size() > 0;
      if (!data.categorical_inputs.empty()) options.levels = {{}, {"a", "b"}};
      distributed::State state = distributed::start({"a", "b"}, "y", options);
      const Eigen::VectorXd output = data.outputs.col(0);
      while (!state.finished()) {
        state = distributed::advance(state, distributed::sums({data.inputs, output, 0, data.weights}, state));
      }
      return is_finite(state.model(), data.inputs);
    });
  }
}

TEST(NumbersOfData, OfRowsThatAreHeldOut) {
  for (const Eigen::Index row : wholes<Eigen::Index>()) {
    llmt::TrainingData data = small_table();
    data.held_out = {5, row};
    expect_finite_or_refused(fmt::format("held out {}", row),
                             [&] { return is_finite(llmt::fit(data).model, data.inputs); });
    data.held_out.clear();
    data.categorical_inputs = {static_cast<int>(row)};
    expect_finite_or_refused(fmt::format("categorical {}", row),
                             [&] { return is_finite(llmt::fit(data).model, data.inputs); });
  }
}

TEST(NumbersOfData, OfQuestionsToATree) {
  const llmt::TrainingData data = small_table(200);
  const llmt::FitResult fitted = llmt::fit(data);
  const llmt::Model& model = fitted.model;
  for (const double value : numbers) {
    Eigen::MatrixXd rows = data.inputs.topRows(12);
    rows(3, 1) = value;
    const Eigen::VectorXd point = rows.row(3).transpose();
    const auto ask = [&](const char* what, const auto& call) {
      expect_finite_or_refused(fmt::format("{} at {}", what, value), call);
    };
    ask("predict", [&] { return model.predict(rows).allFinite(); });
    ask("jacobian", [&] { return model.jacobian(point).allFinite(); });
    ask("validities", [&] { return model.validities(rows, 0).allFinite(); });
    ask("leaf_of", [&] { return (model.leaf_of(rows).array() >= 0).all(); });
    ask("standard_errors", [&] {  // the square of a large number is infinite
      const Eigen::MatrixXd errors = model.standard_errors(rows);
      return std::abs(value) <= 1e150 ? errors.allFinite() : !errors.hasNaN();
    });
    ask("intervals", [&] {
      const llmt::Bounds bounds = fitted.intervals.predict(rows, 0.9);
      return bounds.lower.allFinite() && bounds.upper.allFinite();
    });
    ask("attribute", [&] {
      return llmt::attribute(model, point, llmt::reference_point(model)).contributions.allFinite() &&
             llmt::attribute(model, llmt::reference_point(model), point).contributions.allFinite();
    });
    ask("importance", [&] { return llmt::importance(model, rows).allFinite(); });
    ask("largest_jump", [&] { return std::isfinite(llmt::largest_jump(model, rows)); });
    expect_finite_or_refused(fmt::format("level {}", value), [&] {
      const llmt::Bounds bounds = fitted.intervals.predict(data.inputs, value);
      return bounds.lower.allFinite() && bounds.upper.allFinite();
    });
    const Eigen::VectorXd column = rows.col(1);
    expect_finite_or_refused(fmt::format("robust_scale {}", value), [&] {
      llmt::dominant_rows(column);
      return std::isfinite(llmt::robust_scale(column).deviation) || !std::isfinite(value);
    });
  }
  for (const Eigen::Index place : wholes<Eigen::Index>()) {
    expect_finite_or_refused(fmt::format("partition {}", place),
                             [&] { return model.validities(data.inputs, place).allFinite(); });
    expect_finite_or_refused(fmt::format("leaves {}", place), [&] { return !model.leaves(place).empty(); });
    expect_finite_or_refused(fmt::format("prefix {}", place),
                             [&] { return model.prefix(place).predict(data.inputs).allFinite(); });
  }
  for (const int threads : wholes<int>()) {
    expect_finite_or_refused(fmt::format("threads {}", threads),
                             [&] { return model.predict(data.inputs, threads).allFinite(); });
  }
}

TEST(NumbersOfData, OfQuestionsToASumOfTrees) {
  const llmt::TrainingData data = small_table(60);
  const llmt::BoostedModel model = llmt::fit_boosted(data, {.max_rounds = 20}).model;
  for (const double value : numbers) {
    Eigen::MatrixXd rows = data.inputs.topRows(6);
    rows(3, 1) = value;
    const auto ask = [&](const char* what, const auto& call) {
      expect_finite_or_refused(fmt::format("{} at {}", what, value), call);
    };
    const auto explained = [&](const Eigen::MatrixXd& inputs, const Eigen::MatrixXd& background) {
      for (const Eigen::MatrixXd& of_output : llmt::attribute_rows(model, inputs, background).contributions) {
        if (!of_output.allFinite()) return false;
      }
      return true;
    };
    ask("predict", [&] { return model.predict(rows).allFinite(); });
    ask("explain", [&] { return explained(rows, data.inputs.topRows(5)); });
    ask("background", [&] { return explained(data.inputs.topRows(5), rows); });
    ask("importance", [&] { return llmt::importance(model, rows).allFinite(); });
    ask("partial dependence", [&] {
      return llmt::partial_dependence(model, data.inputs, 1, Eigen::VectorXd::Constant(1, value)).allFinite();
    });
    expect_finite_or_refused(fmt::format("level {}", value),
                             [&] { return model.intervals(data.inputs.topRows(5), value).upper.allFinite(); });
  }
  for (const Eigen::Index place : wholes<Eigen::Index>()) {
    expect_finite_or_refused(fmt::format("input {}", place), [&] {
      return llmt::partial_dependence(model, data.inputs, place, Eigen::VectorXd::Zero(1)).allFinite();
    });
  }
  for (const int threads : wholes<int>()) {
    expect_finite_or_refused(fmt::format("threads {}", threads),
                             [&] { return model.predict(data.inputs, threads).allFinite(); });
  }
}

}  // namespace
