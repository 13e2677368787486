// Trees that learn from a teacher's answers.
#include <gtest/gtest.h>

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <limits>
#include <mutex>
#include <set>
#include <stdexcept>
#include <string>
#include <vector>

#include "fit/prepared_rows.hpp"
#include "llmt/random.hpp"
#include "llmt/readable.hpp"
#include "llmt/teach.hpp"
#include "teach/learned.hpp"
#include "teach/made_rows.hpp"

namespace {

using Matrix = Eigen::MatrixXd;

double wave(double a, double b) { return std::sin(5.0 * a) * b + (a > 0.5 ? b : 0.0); }

Matrix truth(const Eigen::Ref<const Matrix>& inputs) {
  Matrix result(inputs.rows(), 1);
  for (Eigen::Index i = 0; i < inputs.rows(); ++i) result(i, 0) = wave(inputs(i, 0), inputs(i, 1));
  return result;
}

llmt::TrainingData rows_of_wave(Eigen::Index rows, double noise, std::uint64_t seed) {
  llmt::Random random(seed);
  llmt::TrainingData data{Matrix(rows, 2), Matrix(rows, 1)};
  for (Eigen::Index i = 0; i < rows; ++i) {
    data.inputs.row(i) << random.uniform(), random.uniform();
    data.outputs(i, 0) = wave(data.inputs(i, 0), data.inputs(i, 1)) + noise * random.normal();
  }
  return data;
}

// Knows the truth, whatever it is given.
llmt::Teacher all_knowing() {
  return [](const llmt::TrainingData&, const llmt::Progress&) -> llmt::Answers { return truth; };
}

double error_to_truth(const llmt::Model& model) {
  const llmt::TrainingData other = rows_of_wave(2000, 0.0, 99);
  return llmt::rmse(model.predict(other.inputs), other.outputs)(0);
}

TEST(Teaching, WithoutMadeRowsAndWithTheTruthIsTheFitOfItToTheByte) {
  const llmt::TrainingData data = rows_of_wave(200, 0.0, 1);
  const llmt::PreparedFit prepared(data);
  llmt::Work work;
  const llmt::Training& training = *prepared.rows().training;
  llmt::Taught made = llmt::teach(training, {.teacher = all_knowing(), .made_rows = 0}, work);
  llmt::PreparedRows rows = prepared.rows();
  rows.training = std::make_shared<const llmt::Training>(
      llmt::taught(training, std::make_shared<const llmt::Lessons>(std::move(made.lessons))));
  const llmt::FitResult alone = llmt::fit(prepared);
  const llmt::FitResult taught = llmt::fit(prepared.with_rows(rows));
  EXPECT_GT(alone.summary.partitions[0].leaves, 2);
  EXPECT_EQ(to_json(taught.model, taught.intervals), to_json(alone.model, alone.intervals));
}

TEST(Teaching, WithTheTruthComesNearATreeOfManyRowsWithoutNoise) {
  const llmt::Teacher teacher = all_knowing();
  const double of_many = error_to_truth(llmt::fit(rows_of_wave(1500, 0.0, 7)).model);
  for (std::uint64_t seed = 1; seed <= 3; ++seed) {
    const llmt::TrainingData data = rows_of_wave(300, 0.5, seed);
    const llmt::TaughtResult taught = llmt::fit_taught(data, {}, {.teacher = teacher});
    const double alone = error_to_truth(llmt::fit(data).model);
    EXPECT_TRUE(taught.is_taken);
    // Rows are between those of the data alone, and leaves are chosen by noisy rows: not all of the way.
    EXPECT_LT(error_to_truth(taught.fit.model) - of_many, 0.5 * (alone - of_many)) << alone << " " << of_many;
  }
}

// Each row has a number of its own in the third input.
TEST(Teaching, TheTeacherOfAFoldHasNotSeenItsRowsNorTheirGroup) {
  llmt::TrainingData data = rows_of_wave(120, 0.1, 1);
  data.inputs.conservativeResize(Eigen::NoChange, 3);
  for (Eigen::Index i = 0; i < 120; ++i) {
    data.inputs(i, 2) = static_cast<double>(i);
    data.groups.push_back(static_cast<double>(i / 4));
  }
  std::mutex mutex;
  std::vector<std::set<double>> seen;
  const llmt::Teacher teacher = [&](const llmt::TrainingData& rows, const llmt::Progress&) -> llmt::Answers {
    std::set<double> numbers;
    for (Eigen::Index i = 0; i < rows.inputs.rows(); ++i) numbers.insert(rows.inputs(i, 2));
    const std::lock_guard lock(mutex);
    seen.push_back(numbers);
    return [numbers](const Eigen::Ref<const Matrix>& inputs) -> Matrix {
      Matrix is_known(inputs.rows(), 1);
      for (Eigen::Index i = 0; i < inputs.rows(); ++i) is_known(i, 0) = numbers.contains(inputs(i, 2)) ? 1.0 : 0.0;
      return is_known;
    };
  };
  const llmt::PreparedFit prepared(data);
  llmt::Work work;
  const llmt::Taught made = llmt::teach(*prepared.rows().training, {.teacher = teacher}, work);
  ASSERT_EQ(seen.size(), 6U);  // five folds and the model
  ASSERT_EQ(made.held_out.size(), 5U);
  for (const Matrix& answers : made.held_out) {
    EXPECT_GT(answers.rows(), 0);
    EXPECT_TRUE(answers.isZero()) << "a held-out row was seen";
  }
  for (const auto& lesson : made.lessons.of_folds) EXPECT_TRUE((lesson->outputs.array() == 1.0).all());
  for (const std::set<double>& numbers : seen) {
    for (const double number : numbers) {
      const double first = 4.0 * std::floor(number / 4.0);
      for (int k = 0; k < 4; ++k) EXPECT_TRUE(numbers.contains(first + k)) << "a group was divided";
    }
  }
}

TEST(Teaching, TheErrorOfTheTeacherIsThatOfItsAnswersOnHeldOutRows) {
  const llmt::TrainingData data = rows_of_wave(100, 0.3, 1);
  const llmt::Teacher teacher = [](const llmt::TrainingData& rows, const llmt::Progress&) -> llmt::Answers {
    const double mean = rows.outputs.mean();
    return
        [mean](const Eigen::Ref<const Matrix>& inputs) -> Matrix { return Matrix::Constant(inputs.rows(), 1, mean); };
  };
  const llmt::TaughtResult taught = llmt::fit_taught(data, {}, {.teacher = teacher});
  double squares = 0.0;
  for (const std::vector<Eigen::Index>& held_out : taught.fit.summary.held_out) {
    double sum = data.outputs.sum();
    for (const Eigen::Index row : held_out) sum -= data.outputs(row, 0);
    const double mean = sum / static_cast<double>(100 - held_out.size());
    for (const Eigen::Index row : held_out) squares += std::pow(data.outputs(row, 0) - mean, 2);
  }
  EXPECT_NEAR(taught.partitions[0].teacher, std::sqrt(squares / 100.0), 1e-12);
  EXPECT_FALSE(taught.is_taken) << "a constant teaches nothing";
  const llmt::FitResult alone = llmt::fit(data);
  EXPECT_EQ(to_json(taught.fit.model, taught.fit.intervals), to_json(alone.model, alone.intervals));
  EXPECT_EQ(taught.partitions[0].alone, alone.summary.partitions[0].chosen.rmse);
}

TEST(MadeRows, HaveCoordinatesOfARowAndOfOneOfItsNearest) {
  llmt::Random random(3);
  Matrix inputs(60, 4);
  for (double& value : inputs.reshaped()) value = random.normal();
  inputs.col(3) = (inputs.col(3).array() > 0.0).cast<double>();
  inputs(7, 1) = std::numeric_limits<double>::quiet_NaN();
  const llmt::TeachOptions options{.made_rows = 5, .neighbours = 3};
  const llmt::MadeRows made = llmt::make_rows(inputs, {3}, options, 2);
  ASSERT_EQ(made.inputs.rows(), 300);
  const auto same = [](double a, double b) { return a == b || (std::isnan(a) && std::isnan(b)); };
  Eigen::RowVectorXd deviation(4);
  for (int j = 0; j < 4; ++j) {
    const Eigen::VectorXd all = inputs.col(j);
    std::vector<double> present;
    std::ranges::copy_if(all, std::back_inserter(present), [](double value) { return !std::isnan(value); });
    const Eigen::Map<const Eigen::VectorXd> values(present.data(), std::ssize(present));
    deviation(j) = std::sqrt((values.array() - values.mean()).square().mean());
  }
  const auto distance = [&](int a, int b) {
    double sum = 0.0;
    for (int j = 0; j < 4; ++j) {
      const double x = inputs(a, j);
      const double y = inputs(b, j);
      if (same(x, y)) continue;
      sum += j == 3 || std::isnan(x) || std::isnan(y) ? 2.0 : std::pow((x - y) / deviation(j), 2);
    }
    return sum;
  };
  int swapped = 0;
  for (int k = 0; k < 300; ++k) {
    const int own = made.made_of[k];
    ASSERT_EQ(own, k / 5);
    std::vector<std::pair<double, int>> others;
    for (int row = 0; row < 60; ++row) {
      if (row != own) others.emplace_back(distance(own, row), row);
    }
    std::ranges::sort(others);
    const bool is_of_near = std::any_of(others.begin(), others.begin() + 3, [&](const auto& other) {
      bool all = true;
      for (int j = 0; j < 4; ++j) {
        const double value = made.inputs(k, j);
        all = all && (same(value, inputs(own, j)) || same(value, inputs(other.second, j)));
      }
      return all;
    });
    EXPECT_TRUE(is_of_near) << k;
    swapped += same(made.inputs(k, 0), inputs(own, 0)) ? 0 : 1;
  }
  EXPECT_NEAR(swapped, 150, 4.0 * std::sqrt(300.0 / 4.0));  // four standard deviations
}

// Missing values, a category, two outputs.
llmt::TrainingData mixed_rows(Eigen::Index rows) {
  llmt::TrainingData data = rows_of_wave(rows, 0.1, 5);
  llmt::Random random(6);
  data.inputs.conservativeResize(Eigen::NoChange, 3);
  data.outputs.conservativeResize(Eigen::NoChange, 2);
  for (Eigen::Index i = 0; i < rows; ++i) {
    data.inputs(i, 2) = static_cast<double>(random.below(3));
    data.outputs(i, 1) = data.inputs(i, 2) == 1.0 ? 5.0 : data.inputs(i, 0);
    if (random.uniform() < 0.1) data.inputs(i, 0) = std::numeric_limits<double>::quiet_NaN();
  }
  data.levels = {{}, {}, {"red", "green", "blue"}};
  return data;
}

TEST(Teaching, IsTheSameToTheByteForAnyNumberOfThreads) {
  const llmt::TrainingData data = mixed_rows(150);
  std::set<std::string> texts;
  for (const int threads : {1, 3}) {
    const llmt::TaughtResult taught = llmt::fit_taught(data, {.max_threads = threads});
    std::string text = to_json(taught.fit.model, taught.fit.intervals);
    for (const llmt::TaughtPartition& errors : taught.partitions) {
      text += std::to_string(errors.taught) + " " + std::to_string(errors.teacher) + " ";
    }
    texts.insert(text);
    EXPECT_EQ(taught.partitions.size(), 2U);
    EXPECT_EQ(taught.made_rows, 600);
  }
  EXPECT_EQ(texts.size(), 1U);
}

TEST(Teaching, TakesAWeightForANumberOfRows) {
  const llmt::TrainingData data = rows_of_wave(150, 0.2, 8);
  llmt::TrainingData weighted = data;
  weighted.weights = Eigen::VectorXd::Ones(150);
  std::vector<Eigen::Index> rows;
  for (Eigen::Index i = 0; i < 150; ++i) {
    weighted.weights(i) = static_cast<double>(1 + i % 3);
    for (Eigen::Index k = 0; k <= i % 3; ++k) rows.push_back(i);
  }
  const llmt::TrainingData several{Matrix(data.inputs(rows, Eigen::all)), Matrix(data.outputs(rows, Eigen::all))};
  const llmt::TaughtResult of_weights = llmt::fit_taught(weighted);
  const llmt::TaughtResult of_rows = llmt::fit_taught(several);
  EXPECT_EQ(to_json(of_weights.fit.model, of_weights.fit.intervals), to_json(of_rows.fit.model, of_rows.fit.intervals));
  EXPECT_EQ(of_weights.partitions[0].taught, of_rows.partitions[0].taught);
  EXPECT_EQ(of_weights.partitions[0].teacher, of_rows.partitions[0].teacher);
}

TEST(Teaching, GivesTheReadableTreeTheSameTeacher) {
  const llmt::TrainingData data = rows_of_wave(300, 0.5, 2);
  const llmt::TaughtResult taught = llmt::fit_taught(data, {}, {.teacher = all_knowing()});
  ASSERT_TRUE(taught.is_taken);
  const llmt::ReadableResult readable = llmt::fit_readable(taught.prepared, taught.fit.summary);
  const llmt::PreparedFit alone(data);
  const llmt::ReadableResult of_data = llmt::fit_readable(alone, llmt::fit(alone).summary);
  EXPECT_LT(error_to_truth(readable.model), error_to_truth(of_data.model));
}

TEST(Teaching, CountsTheRowsOfTheData) {
  const llmt::TaughtResult taught = llmt::fit_taught(rows_of_wave(300, 0.5, 2), {}, {.teacher = all_knowing()});
  ASSERT_TRUE(taught.is_taken);
  Eigen::Index rows = 0;
  for (const llmt::Leaf& leaf : taught.fit.model.leaves(0)) rows += leaf.samples;
  EXPECT_EQ(rows, 300);
  EXPECT_GT(taught.fit.summary.partitions[0].train_rmse(0), 0.4) << "the noise of the data, not that of the answers";
}

TEST(Teaching, RefusesByName) {
  const auto message = [](const llmt::TrainingData& data, const llmt::FitOptions& options,
                          const llmt::TeachOptions& teach) -> std::string {
    try {
      llmt::fit_taught(data, options, teach);
    } catch (const std::exception& error) {
      return error.what();
    }
    return "";
  };
  const llmt::TrainingData data = rows_of_wave(60, 0.1, 1);
  const auto expect = [&](const std::string& found, const std::string& words) {
    EXPECT_NE(found.find(words), std::string::npos) << found;
  };
  expect(message(data, {.folds = {.count = 0}}, {}), "folds.count 0");
  expect(message(data, {}, {.made_rows = -1}), "made_rows is -1");
  expect(message(data, {}, {.most_made_rows = -1}), "most_made_rows is -1");
  expect(message(data, {}, {.neighbours = 0}), "neighbours is 0");
  expect(message(data, {}, {.swapped = 1.5}), "swapped is 1.5");
  expect(message(rows_of_wave(9, 0.1, 1), {}, {}), "at least 10");
  expect(message(rows_of_wave(1, 0.1, 1), {}, {}), "none to hold out");
  const llmt::Teacher lost = [](const llmt::TrainingData&, const llmt::Progress&) -> llmt::Answers {
    return [](const Eigen::Ref<const Matrix>& inputs) -> Matrix {
      return Matrix::Constant(inputs.rows(), 1, std::numeric_limits<double>::infinity());
    };
  };
  expect(message(data, {}, {.teacher = lost}), "not finite");
  const llmt::Teacher short_of_words = [](const llmt::TrainingData&, const llmt::Progress&) -> llmt::Answers {
    return [](const Eigen::Ref<const Matrix>&) -> Matrix { return Matrix(1, 1); };
  };
  expect(message(data, {}, {.teacher = short_of_words}), "answers are 1 x 1");
}

}  // namespace
