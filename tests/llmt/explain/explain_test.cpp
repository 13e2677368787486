#include "llmt/explain.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>
#include <vector>

#include "llmt/fit.hpp"
#include "oracles/clamped.hpp"
#include "oracles/oracles.hpp"
#include "oracles/random_trees.hpp"
#include "oracles/thrown.hpp"

namespace {

constexpr double missing = std::numeric_limits<double>::quiet_NaN();

struct Kind {
  llmt::ValidityChoice validity;
};
const Kind kinds[] = {{llmt::ValidityChoice::crisp}, {llmt::ValidityChoice::blend}, {llmt::ValidityChoice::gaussian}};

// Three numbers, of which one is often missing, and a category; two outputs.
struct Data {
  Eigen::MatrixXd x;
  Eigen::MatrixXd y;
};
Data mixed(Eigen::Index rows) {
  llmt::Random random(5);
  Data data{oracle::uniform(rows, 4, 4), Eigen::MatrixXd(rows, 2)};
  for (Eigen::Index i = 0; i < rows; ++i) {
    data.x(i, 3) = static_cast<double>(random.below(4));
    data.y(i, 0) = std::sin(3.0 * data.x(i, 0)) * data.x(i, 1) + std::abs(data.x(i, 2)) + 0.5 * data.x(i, 3);
    data.y(i, 1) = data.x(i, 3) == 2.0 ? std::exp(data.x(i, 0)) : data.x(i, 1) * data.x(i, 2);
    if (random.uniform(0.0, 1.0) < 0.2) {
      data.x(i, 2) = missing;
    }
  }
  return data;
}

llmt::Model fitted(const Data& data, const Kind& kind, std::vector<int> categorical = {3},
                   llmt::LocalTerms terms = llmt::LocalTerms::linear) {
  llmt::FitOptions options;
  options.terms = terms;
  options.max_leaves = 12;
  options.significance = 1.0;
  options.min_leaf_samples = 8;
  options.validity = kind.validity;
  options.expert.widths = {1.5};
  options.folds.count = 0;
  const llmt::TrainingData rows{.inputs = data.x, .outputs = data.y, .categorical_inputs = std::move(categorical)};
  return llmt::fit(rows, options).model;
}

// Steps along the line, in each of which one input after the other is moved, in both orders: from predictions alone.
Eigen::MatrixXd step_by_step(const llmt::Model& model, const Eigen::VectorXd& point, const Eigen::VectorXd& reference,
                             int steps) {
  const Eigen::Index inputs = point.size();
  std::vector<Eigen::VectorXd> line = {reference};
  const auto is_switched = [&](Eigen::Index j) {
    return std::isnan(reference(j) + point(j)) || model.inputs()[j].is_categorical();
  };
  for (int step = 1; step <= steps; ++step) {
    line.push_back(line.back());
    for (Eigen::Index j = 0; j < inputs; ++j) {
      if (!is_switched(j)) {
        line.back()(j) = reference(j) + (point(j) - reference(j)) * step / steps;
      }
    }
    for (Eigen::Index j = 0; 2 * step == steps && j < inputs; ++j) {
      if (is_switched(j)) {
        line.push_back(line.back());
        line.back()(j) = point(j);
      }
    }
  }
  Eigen::MatrixXd rows(2 * std::ssize(line) * (inputs + 1), inputs);
  Eigen::Index row = 0;
  for (std::size_t k = 0; k + 1 < line.size(); ++k) {
    for (const bool forward : {true, false}) {
      Eigen::VectorXd x = line[k];
      rows.row(row++) = x;
      for (Eigen::Index i = 0; i < inputs; ++i) {
        const Eigen::Index j = forward ? i : inputs - 1 - i;
        x(j) = line[k + 1](j);
        rows.row(row++) = x;
      }
    }
  }
  const Eigen::MatrixXd predicted = model.predict(rows.topRows(row));
  Eigen::MatrixXd shares = Eigen::MatrixXd::Zero(model.num_outputs(), inputs);
  row = 0;
  for (std::size_t k = 0; k + 1 < line.size(); ++k) {
    for (const bool forward : {true, false}) {
      for (Eigen::Index i = 0; i < inputs; ++i, ++row) {
        shares.col(forward ? i : inputs - 1 - i) += 0.5 * (predicted.row(row + 1) - predicted.row(row)).transpose();
      }
      ++row;
    }
  }
  return shares;
}

double worst_sum(const llmt::Attribution& attribution) {
  return (attribution.prediction - attribution.reference - attribution.contributions.rowwise().sum())
      .cwiseAbs()
      .maxCoeff();
}

// Splits x1 at 0 and then both halves x2 at 0; constant leaves.
llmt::Model four_fields(double half_width, const Eigen::Vector4d& values) {
  const auto node = [&](int left, int input, double value) {
    llmt::Node made;
    made.left = left;
    made.right = left < 0 ? -1 : left + 1;
    made.split_input = input;
    made.half_width = left < 0 ? 0.0 : half_width;
    made.rss = Eigen::VectorXd::Zero(1);
    made.value = Eigen::VectorXd::Constant(1, value);
    made.slope = Eigen::MatrixXd::Zero(1, 2);
    made.mean = Eigen::VectorXd::Zero(2);
    made.low = Eigen::VectorXd::Constant(2, -10.0);
    made.high = Eigen::VectorXd::Constant(2, 10.0);
    return made;
  };
  llmt::Partition partition;
  partition.outputs = {0};
  if (half_width > 0.0) {
    partition.validity = {llmt::ValidityKind::blend, 1.0};
  }
  partition.nodes = {node(1, 0, 0.0),         node(3, 1, 0.0),         node(5, 1, 0.0),        node(-1, -1, values(0)),
                     node(-1, -1, values(1)), node(-1, -1, values(2)), node(-1, -1, values(3))};
  return {{{.name = "a", .low = -10.0, .high = 10.0}, {.name = "b", .low = -10.0, .high = 10.0}},
          {{.name = "y", .low = -20.0, .high = 20.0}},
          {{.input = 0}, {.input = 1}},
          {partition}};
}

TEST(Explain, AnAffineModelGivesSlopeTimesDistance) {
  const Eigen::MatrixXd x = oracle::uniform(100, 3, 1);
  const Eigen::Vector3d slope(2.0, -0.5, 0.0);
  const llmt::Model model = llmt::fit(x, (x * slope).array() + 7.0, {}).model;
  // The second point lies far outside: affine data are reproduced there too.
  for (const Eigen::Vector3d& point : {Eigen::Vector3d(0.3, -0.9, 0.5), Eigen::Vector3d(40.0, -9.0, 3.0)}) {
    const llmt::Attribution attribution = llmt::attribute(model, point);
    const Eigen::VectorXd expected = slope.cwiseProduct(point - x.colwise().mean().transpose());
    EXPECT_LT((attribution.contributions.row(0).transpose() - expected).cwiseAbs().maxCoeff(), 1e-10);
    EXPECT_NEAR(attribution.prediction(0), slope.dot(point) + 7.0, 1e-10);
  }
}

TEST(Explain, ContributionsAddUp) {
  const Data data = mixed(400);
  for (const Kind& kind : kinds) {
    const llmt::Model model = fitted(data, kind);
    const Eigen::VectorXd usual = llmt::reference_point(model);
    EXPECT_TRUE(std::isnan(usual(3)));
    for (int row = 0; row < 30; ++row) {
      Eigen::VectorXd point = data.x.row(row);
      point.head(3) *= row % 3 == 0 ? 3.0 : 1.0;  // some outside
      for (const Eigen::VectorXd& reference : {usual, Eigen::VectorXd(data.x.row(row + 1))}) {
        const llmt::Attribution attribution = llmt::attribute(model, point, reference);
        EXPECT_LT(worst_sum(attribution), 1e-12 * std::max(1.0, attribution.prediction.cwiseAbs().maxCoeff()));
        EXPECT_LT((attribution.prediction - model.predict(point.transpose()).transpose()).norm(), 1e-14);
        EXPECT_LT((attribution.reference - model.predict(reference.transpose()).transpose()).norm(), 1e-14);
      }
    }
  }
}

TEST(Explain, EqualsSmallStepsAlongTheLine) {
  const Data data = mixed(400);
  for (int k = 0; k < 6; ++k) {
    const Kind& kind = kinds[k % 3];
    const llmt::LocalTerms terms = k < 3 ? llmt::LocalTerms::linear : llmt::LocalTerms::quadratic;
    const llmt::Model model = fitted(data, kind, {3}, terms);
    const Eigen::VectorXd reference = llmt::reference_point(model);
    for (int row = 0; row < 5; ++row) {
      Eigen::VectorXd point = data.x.row(row);
      point.head(3) *= row % 4 == 0 ? 2.0 : 1.0;
      const Eigen::MatrixXd exact = llmt::attribute(model, point).contributions;
      // Where a step crosses a jump, what its order changes is the step times the change of slope.
      const double bound = kind.validity == llmt::ValidityChoice::crisp ? 1e-2 : 1e-5;
      EXPECT_LT((exact - step_by_step(model, point, reference, 8000)).cwiseAbs().maxCoeff(), bound)
          << k << " row " << row;
    }
  }
}

TEST(Explain, ClampedModelsEqualSmallStepsAlongTheLine) {
  const Data data = mixed(400);
  Eigen::MatrixXd range(2, 2);
  range << 0.3, 1.6, -0.1, 0.9;
  int clamped_lines = 0;
  for (int k = 0; k < 6; ++k) {
    const Kind& kind = kinds[k % 3];
    const llmt::LocalTerms terms = k < 3 ? llmt::LocalTerms::linear : llmt::LocalTerms::quadratic;
    const llmt::Model free = fitted(data, kind, {3}, terms);
    const llmt::Model model = oracle::clamped(free, range);
    const Eigen::VectorXd reference = llmt::reference_point(model);
    for (int row = 0; row < 8; ++row) {
      Eigen::VectorXd point = data.x.row(row);
      point.head(3) *= row % 4 == 0 ? 2.0 : 1.0;
      const llmt::Attribution found = llmt::attribute(model, point);
      EXPECT_LT(worst_sum(found), 1e-12);
      // Where a step enters or leaves the range, its order changes no more than what the step moves the output: with
      // slopes of less than 4 along a line of less than 2 it is less than 8 / 8000.
      const double bound = kind.validity == llmt::ValidityChoice::crisp ? 1e-2 : 1e-3;
      const Eigen::MatrixXd expected = step_by_step(model, point, reference, 8000);
      EXPECT_LT((found.contributions - expected).cwiseAbs().maxCoeff(), bound) << k << " row " << row;
      clamped_lines += (found.contributions - llmt::attribute(free, point).contributions).norm() > 0.05 ? 1 : 0;
    }
  }
  EXPECT_GT(clamped_lines, 20);
}

// A hill that leaves the range for a short part of the line between two points where nothing is clamped.
TEST(Explain, AShortWayOutsideIsNotMissed) {
  llmt::Model hill = four_fields(1.0, {0.0, 1.0, 1.0, 0.0});
  const Eigen::Vector2d from(-0.6, 0.9);
  const Eigen::Vector2d to(0.5, -0.8);
  double top = 0.0;
  for (int k = 0; k <= 10000; ++k) {
    top = std::max(top, hill.predict((from + k / 10000.0 * (to - from)).transpose())(0));
  }
  for (const double below : {1e-2, 1e-4}) {
    Eigen::MatrixXd range(1, 2);
    range << 0.0, top - below;
    const llmt::Model model = oracle::clamped(hill, range);
    const Eigen::MatrixXd expected = step_by_step(model, to, from, 200000);
    const Eigen::MatrixXd found = llmt::attribute(model, to, from).contributions;
    const Eigen::MatrixXd without = llmt::attribute(hill, to, from).contributions;
    EXPECT_GT((without - expected).cwiseAbs().maxCoeff(), 0.2 * below);
    EXPECT_LT((found - expected).cwiseAbs().maxCoeff(), 1e-3 * below);
  }
}

TEST(Explain, AnInputThatIsNotUsedGetsNothing) {
  Data data = mixed(400);
  for (const Kind& kind : kinds) {
    llmt::FitOptions options;
    options.significance = 1.0;
    options.min_leaf_samples = 8;
    options.max_leaves = 12;
    options.split_inputs = {0, 2, 3};
    options.regression_inputs = {0, 2, 3};
    options.validity = kind.validity;
    options.expert.widths = {1.5};
    options.folds.count = 0;
    const llmt::TrainingData rows{.inputs = data.x, .outputs = data.y, .categorical_inputs = {3}};
    const llmt::Model model = llmt::fit(rows, options).model;
    for (int row = 0; row < 20; ++row) {
      EXPECT_EQ(llmt::attribute(model, data.x.row(row).transpose()).contributions.col(1), Eigen::Vector2d::Zero());
    }
    EXPECT_EQ(llmt::importance(model, data.x).col(1), Eigen::Vector2d::Zero());
  }
}

TEST(Explain, InputsThatAreTreatedAlikeGetAlike) {
  const llmt::Model model = four_fields(1.0, {0.0, 1.0, 1.0, 5.0});
  const llmt::Attribution attribution = llmt::attribute(model, Eigen::Vector2d(0.7, 0.7), Eigen::Vector2d(-2.0, -2.0));
  EXPECT_NEAR(attribution.contributions(0, 0), attribution.contributions(0, 1), 1e-14);
  EXPECT_GT(attribution.contributions(0, 0), 0.5);
}

TEST(Explain, AJumpBelongsToTheInputThatCrosses) {
  const llmt::Model model = four_fields(0.0, {0.0, 1.0, 10.0, 15.0});
  const auto shares = [&](double a0, double b0, double a1, double b1) {
    const llmt::Attribution attribution = llmt::attribute(model, Eigen::Vector2d(a1, b1), Eigen::Vector2d(a0, b0));
    EXPECT_EQ(worst_sum(attribution), 0.0);
    return Eigen::Vector2d(attribution.contributions.row(0));
  };
  EXPECT_EQ(shares(-1.0, -2.0, 3.0, 1.0), Eigen::Vector2d(10.0, 5.0));  // a first
  EXPECT_EQ(shares(-2.0, -1.0, 1.0, 3.0), Eigen::Vector2d(14.0, 1.0));  // b first
  EXPECT_EQ(shares(-1.0, -1.0, 1.0, 1.0), Eigen::Vector2d(10.0, 5.0));  // together: in the order of the columns
  EXPECT_EQ(shares(1.0, 1.0, -1.0, -1.0), Eigen::Vector2d(-14.0, -1.0));
  // A threshold belongs to the left.
  EXPECT_EQ(shares(0.0, -1.0, 1.0, -1.0), Eigen::Vector2d(10.0, 0.0));
  EXPECT_EQ(shares(1.0, -1.0, 0.0, -1.0), Eigen::Vector2d(-10.0, 0.0));
  EXPECT_EQ(shares(-1.0, -1.0, 0.0, 0.0), Eigen::Vector2d(0.0, 0.0));
  // A missing value takes half of either side here.
  EXPECT_EQ(shares(-1.0, -1.0, missing, -1.0), Eigen::Vector2d(5.0, 0.0));
  EXPECT_EQ(shares(missing, missing, 1.0, 1.0), Eigen::Vector2d(6.0, 2.5));
  EXPECT_EQ(shares(missing, -1.0, missing, 1.0), Eigen::Vector2d(0.0, 3.0));
}

TEST(Explain, ImportanceIsTheShareOfTheMovedOutput) {
  const Eigen::MatrixXd x = oracle::uniform(1200, 3, 9);
  Eigen::MatrixXd y(1200, 2);
  y << x * Eigen::Vector3d(3.0, -1.0, 0.0), Eigen::VectorXd::Constant(1200, 4.0);
  const Eigen::MatrixXd importance = llmt::importance(llmt::fit(x, y).model, x);
  EXPECT_NEAR(importance(0, 0), 0.75, 0.02);
  EXPECT_NEAR(importance(0, 1), 0.25, 0.02);
  EXPECT_NEAR(importance.row(0).sum(), 1.0, 1e-14);
  EXPECT_EQ(importance.row(1), Eigen::RowVector3d::Zero());

  const Data data = mixed(700);
  for (const Kind& kind : kinds) {
    const llmt::Model model = fitted(data, kind);
    // More rows than it looks at for the kind that is cheap.
    const Eigen::MatrixXd rows = data.x.topRows(kind.validity == llmt::ValidityChoice::crisp ? 700 : 60);
    const Eigen::Index looked_at = std::min(rows.rows(), llmt::importance_rows);
    Eigen::MatrixXd mean = Eigen::MatrixXd::Zero(2, 4);
    for (Eigen::Index k = 0; k < looked_at; ++k) {
      mean += llmt::attribute(model, rows.row(k * rows.rows() / looked_at).transpose()).contributions.cwiseAbs();
    }
    for (Eigen::Index o = 0; o < 2; ++o) {
      mean.row(o) /= mean.row(o).sum();
    }
    const Eigen::MatrixXd found = llmt::importance(model, rows, 1);
    EXPECT_LT((found - mean).cwiseAbs().maxCoeff(), 1e-3);
    EXPECT_EQ(llmt::importance(model, rows, 4), found);
  }
}

TEST(Explain, ImportanceEndsAtTheRowAtWhichItIsStopped) {
  const Eigen::MatrixXd x = oracle::uniform(1200, 3, 9);
  const llmt::Model model = llmt::fit(x, x.col(0)).model;
  int reports = 0;
  const auto importance = [&](int most) {
    reports = 0;
    return llmt::importance(model, x, 1, [&](const llmt::ProgressReport&) { return ++reports < most; });
  };
  EXPECT_THROW(importance(4), llmt::Cancelled);
  EXPECT_EQ(reports, 4);
  EXPECT_EQ(importance(100000), llmt::importance(model, x));
  EXPECT_GE(reports, llmt::importance_rows);
}

TEST(Explain, RejectsWhatDoesNotFit) {
  const llmt::Model model = four_fields(1.0, {0.0, 1.0, 1.0, 5.0});
  using oracle::thrown;
  EXPECT_EQ(thrown([&] { llmt::attribute(model, Eigen::Vector3d::Zero()); }),
            "llmt::attribute: point has 3 entries, the model has 2 inputs");
  EXPECT_EQ(thrown([&] { llmt::attribute(model, Eigen::Vector2d::Zero(), Eigen::VectorXd::Zero(1)); }),
            "llmt::attribute: reference has 1 entries, the model has 2 inputs");
  EXPECT_EQ(
      thrown([&] { llmt::attribute(model, Eigen::Vector2d(0.0, HUGE_VAL)); }).find("llmt::attribute: point(1, 0)"), 0U);
  EXPECT_EQ(thrown([&] { llmt::importance(model, Eigen::MatrixXd::Zero(0, 2)); }),
            "llmt::importance: inputs is 0 x 2, it must have a row and the model's 2 inputs");
  EXPECT_EQ(thrown([&] { llmt::importance(model, Eigen::MatrixXd::Zero(2, 3)); }),
            "llmt::importance: inputs is 2 x 3, it must have a row and the model's 2 inputs");
}

}  // namespace
