// Leaves that share a local model.
#include "estimation/merging.hpp"

#include <gtest/gtest.h>

#include <Eigen/Core>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <numeric>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "data/dataset.hpp"
#include "estimation/estimate.hpp"
#include "estimation/joint_fit.hpp"
#include "llmt/explain.hpp"
#include "llmt/random.hpp"
#include "oracles/predict_oracle.hpp"
#include "oracles/random_trees.hpp"

namespace {

using namespace random_trees;

/// Rows with random weights, and a tree of them.
struct Grown {
  Eigen::MatrixXd x;
  Eigen::MatrixXd y;
  Eigen::VectorXd weights;
  Kind kind;
  llmt::Table table{x, y, weights, {0, 0, 0}, {0, 1, 2}, {0, 1, 2}};
  llmt::TrainingRows training = llmt::training_rows(table, all_rows());
  llmt::Partition tree = grown();

  std::vector<int> all_rows() const {
    std::vector<int> rows(static_cast<std::size_t>(x.rows()));
    std::iota(rows.begin(), rows.end(), 0);
    return rows;
  }
  llmt::Partition grown() const {
    llmt::FitOptions options = only(kind, llmt::Estimation::as_grown, 9);
    options.weights = weights;
    options.growth.shared_partition = true;
    return llmt::fit(x, y, options).model.partitions()[0];
  }
  llmt::Model model(llmt::Partition partition) const {
    llmt::describe_leaves(training, partition, false, 1);
    return {training.columns, training.output_columns, training.regressors, {std::move(partition)}};
  }
};

Grown grown(std::uint64_t seed, const Kind& kind, std::ptrdiff_t outputs = 1) {
  llmt::Random random(seed);
  Data d = data(seed);
  Eigen::VectorXd weights(d.x.rows());
  for (double& weight : weights) {
    weight = random.uniform(0.5, 2.0);
  }
  weights /= weights.mean();
  return {oracle::firm(d.x), d.y.leftCols(outputs), std::move(weights), kind};
}

/// Which leaf, of those from left to right, has which local model.
std::vector<int> local_models_of(const llmt::Model& model) {
  std::vector<int> result;
  for (const llmt::Leaf& leaf : model.leaves(0)) {
    result.push_back(leaf.local_model);
  }
  return result;
}

Eigen::MatrixXd with_constant(const Eigen::MatrixXd& x) {
  Eigen::MatrixXd a(x.rows(), x.cols() + 1);
  a << Eigen::VectorXd::Ones(x.rows()), x;
  return a;
}

/// Validities of the local models: sums of those of the leaves.
Eigen::MatrixXd shared_validities(const llmt::Model& model, const Eigen::MatrixXd& x) {
  const Eigen::MatrixXd of_leaves = model.validities(x, 0);
  const std::vector<int> number = local_models_of(model);
  Eigen::MatrixXd result = Eigen::MatrixXd::Zero(x.rows(), model.partitions()[0].num_local_models());
  for (std::size_t leaf = 0; leaf < number.size(); ++leaf) {
    result.col(number[leaf]) += of_leaves.col(static_cast<std::ptrdiff_t>(leaf));
  }
  return result;
}

double weighted_rss(const Eigen::MatrixXd& a, const Eigen::VectorXd& y, const Eigen::VectorXd& weights) {
  const Eigen::VectorXd roots = weights.cwiseSqrt();
  const Eigen::VectorXd w = oracle::least_squares(roots.asDiagonal() * a, roots.asDiagonal() * y);
  return weights.dot((y - a * w).cwiseAbs2());
}

TEST(Merging, LeavesThatTouchAreThoseOfNeighbouringCells) {
  // All cells of a grid of two numbers and a category; a cell's neighbours differ in one coordinate, categories in any
  // way.
  constexpr int side = 6;
  constexpr int levels = 4;
  for (std::uint64_t seed = 1; seed <= 6; ++seed) {
    llmt::Random random(seed);
    Eigen::MatrixXd x(4 * side * side * levels, 3);
    Eigen::MatrixXd y(x.rows(), 1);
    for (std::ptrdiff_t i = 0; i < x.rows(); ++i) {
      const std::ptrdiff_t cell = i / 4;
      x.row(i) << static_cast<double>(cell % side), static_cast<double>(cell / side % side),
          static_cast<double>(cell / side / side);
      y(i, 0) = random.normal();
    }
    llmt::FitOptions options = only(kinds[0], llmt::Estimation::as_grown, 14);
    options.categorical_inputs = {2};
    options.growth.min_leaf_samples = 8;
    options.growth.threshold = llmt::ThresholdPlacement::midpoint;  // two in one gap leave no sliver without a cell
    const llmt::Model model = llmt::fit(x, y, options).model;
    const llmt::Partition& partition = model.partitions()[0];
    std::vector<int> leaves;
    for (std::size_t i = 0; i < partition.nodes.size(); ++i) {
      if (partition.nodes[i].is_leaf()) {
        leaves.push_back(static_cast<int>(i));
      }
    }
    std::vector<int> leaf_of(static_cast<std::size_t>(x.rows()));
    const Eigen::MatrixXi places = model.leaf_of(x);
    const std::vector<llmt::Leaf> table = model.leaves(0);
    std::set<std::pair<int, int>> expected;
    const auto node_of = [&](std::ptrdiff_t row) { return table[static_cast<std::size_t>(places(row, 0))].node; };
    for (std::ptrdiff_t a = 0; a < x.rows(); a += 4) {
      for (std::ptrdiff_t b = 0; b < x.rows(); b += 4) {
        const Eigen::RowVector3d apart = (x.row(a) - x.row(b)).cwiseAbs();
        const bool next_number = apart(2) == 0.0 && apart(0) + apart(1) == 1.0;
        const bool other_level = apart(2) > 0.0 && apart(0) + apart(1) == 0.0;
        if ((next_number || other_level) && node_of(a) < node_of(b)) {
          expected.insert({node_of(a), node_of(b)});
        }
      }
    }
    std::set<std::pair<int, int>> found;
    for (const auto& [a, b] : llmt::touching_leaves(partition, leaves)) {
      found.insert({leaves[static_cast<std::size_t>(a)], leaves[static_cast<std::size_t>(b)]});
    }
    ASSERT_GT(leaves.size(), 10U);
    EXPECT_LT(found.size(), leaves.size() * (leaves.size() - 1) / 2);
    EXPECT_EQ(found, expected);
  }
}

TEST(Merging, EveryMergeIsTheCheapestOfAllRefits) {
  for (std::uint64_t seed = 1; seed <= 4; ++seed) {
    for (const std::size_t k : {0, 1, 4}) {
      const Grown g = grown(seed, kinds[k]);
      llmt::JointFit fit(g.training, g.tree, 1);
      const Eigen::MatrixXd validities = g.model(g.tree).validities(g.x, 0);
      const std::vector<llmt::Leaf> leaves = g.model(g.tree).leaves(0);
      std::vector<int> nodes;
      std::vector<Eigen::VectorXd> of_group;  // weights
      for (std::size_t leaf = 0; leaf < leaves.size(); ++leaf) {
        nodes.push_back(leaves[leaf].node);
        of_group.push_back(g.weights.cwiseProduct(validities.col(static_cast<std::ptrdiff_t>(leaf))));
      }
      std::vector<std::set<int>> members;
      for (const int node : nodes) {
        members.push_back({node});
      }
      std::set<std::pair<int, int>> touching;
      for (const auto& [a, b] : llmt::touching_leaves(g.tree, nodes)) {
        touching.insert({nodes[static_cast<std::size_t>(a)], nodes[static_cast<std::size_t>(b)]});
        touching.insert({nodes[static_cast<std::size_t>(b)], nodes[static_cast<std::size_t>(a)]});
      }
      const Eigen::MatrixXd a = with_constant(g.x);
      const Eigen::VectorXd y = g.y.col(0);
      const double whole = g.tree.nodes[0].rss(0);
      const std::vector<llmt::Merge> merges = fit.merges();
      ASSERT_EQ(merges.size(), leaves.size() - 1);
      for (const llmt::Merge& merge : merges) {
        double cheapest = 1e300;
        std::pair<std::size_t, std::size_t> best;
        for (std::size_t i = 0; i < members.size(); ++i) {
          for (std::size_t j = 0; j < members.size(); ++j) {
            const bool touch = std::any_of(members[i].begin(), members[i].end(), [&](int one) {
              return std::any_of(members[j].begin(), members[j].end(), [&](int other) {
                return touching.contains({one, other});
              });
            });
            if (i >= j || !touch) {
              continue;
            }
            const double rise = weighted_rss(a, y, of_group[i] + of_group[j]) - weighted_rss(a, y, of_group[i]) -
                                weighted_rss(a, y, of_group[j]);
            if (rise < cheapest) {
              cheapest = rise;
              best = {i, j};
            }
          }
        }
        EXPECT_NEAR(merge.rise * whole, cheapest, 1e-6 * (1.0 + cheapest));
        const std::set<int> firsts = {*members[best.first].begin(), *members[best.second].begin()};
        EXPECT_EQ(firsts, (std::set<int>{merge.kept, merge.merged}));
        members[best.first].merge(members[best.second]);
        of_group[best.first] += of_group[best.second];
        members.erase(members.begin() + static_cast<std::ptrdiff_t>(best.second));
        of_group.erase(of_group.begin() + static_cast<std::ptrdiff_t>(best.second));
      }
    }
  }
}

TEST(Merging, EstimatesAreLeastSquaresWithTheSharedUnknownsTied) {
  for (std::uint64_t seed = 1; seed <= 3; ++seed) {
    for (const Kind& kind : kinds) {
      for (const double ridge : {1e-3, 0.1}) {
        const Grown g = grown(seed, kind);
        llmt::JointFit fit(g.training, g.tree, 1);
        fit.merge_to(4);
        const llmt::Model joint = g.model(fit.joint(9, {{ridge, 0.0}}).front());
        const llmt::Model local = g.model(fit.local(9, 0.0));
        ASSERT_EQ(joint.partitions()[0].num_local_models(), 4);
        const Eigen::MatrixXd validities = shared_validities(joint, g.x);
        const Eigen::MatrixXd a = with_constant(g.x);
        const std::ptrdiff_t rows = g.x.rows();
        Eigen::MatrixXd stacked = Eigen::MatrixXd::Zero(rows * 5, 16);
        Eigen::VectorXd target = Eigen::VectorXd::Zero(stacked.rows());
        const Eigen::VectorXd roots = g.weights.cwiseSqrt();
        target.head(rows) = roots.asDiagonal() * g.y.col(0);
        Eigen::VectorXd expected_local = Eigen::VectorXd::Zero(rows);
        for (std::ptrdiff_t m = 0; m < 4; ++m) {
          const Eigen::VectorXd own = g.weights.cwiseProduct(validities.col(m)).cwiseSqrt();
          const Eigen::VectorXd w = oracle::least_squares(own.asDiagonal() * a, own.asDiagonal() * g.y.col(0));
          stacked.block(0, 4 * m, rows, 4) = roots.cwiseProduct(validities.col(m)).asDiagonal() * a;
          stacked.block(rows * (m + 1), 4 * m, rows, 4) = std::sqrt(ridge) * (own.asDiagonal() * a);
          target.segment(rows * (m + 1), rows) = std::sqrt(ridge) * (own.asDiagonal() * (a * w));
          expected_local += validities.col(m).cwiseProduct(a * w);
        }
        const Eigen::VectorXd coefficients = oracle::least_squares(stacked, target);
        Eigen::VectorXd expected = Eigen::VectorXd::Zero(rows);
        for (std::ptrdiff_t m = 0; m < 4; ++m) {
          expected += validities.col(m).cwiseProduct(a * coefficients.segment(4 * m, 4));
        }
        EXPECT_LT((joint.predict(g.x).col(0) - expected).cwiseAbs().maxCoeff(), 1e-4);
        EXPECT_LT((local.predict(g.x).col(0) - expected_local).cwiseAbs().maxCoeff(), 1e-4);
      }
    }
  }
}

TEST(Merging, CrispLeavesAsGrownAreLeastSquaresOfTheirRowsTogether) {
  for (std::uint64_t seed = 1; seed <= 3; ++seed) {
    const Grown g = grown(seed, kinds[0], 2);
    llmt::JointFit fit(g.training, g.tree, 1);
    fit.merge_to(3);
    const llmt::Model model = g.model(fit.as_grown(9));
    const Eigen::MatrixXd validities = shared_validities(model, g.x);
    const std::vector<llmt::Leaf> leaves = model.leaves(0);
    const Eigen::MatrixXd a = with_constant(g.x);
    for (const llmt::Leaf& leaf : leaves) {
      const Eigen::VectorXd roots = g.weights.cwiseProduct(validities.col(leaf.local_model)).cwiseSqrt();
      for (std::ptrdiff_t o = 0; o < 2; ++o) {
        const Eigen::VectorXd w = oracle::least_squares(roots.asDiagonal() * a, roots.asDiagonal() * g.y.col(o));
        EXPECT_NEAR(leaf.intercept(o), w(0), 1e-5);
        EXPECT_LT((leaf.slope.row(o).transpose() - w.tail(3)).cwiseAbs().maxCoeff(), 1e-5);
      }
      EXPECT_EQ(leaf.rank, 4);
    }
  }
}

TEST(Merging, LeveragesAndStandardErrorsAreThoseOfAllRowsOfASharedModel) {
  const Grown g = grown(7, kinds[0]);
  llmt::JointFit fit(g.training, g.tree, 1);
  fit.merge_to(3);
  const llmt::Model model = g.model(fit.as_grown(9));
  const Eigen::MatrixXd validities = shared_validities(model, g.x);
  const Eigen::MatrixXd a = with_constant(g.x);
  const Eigen::VectorXd error = g.y.col(0) - model.predict(g.x).col(0);
  const double rows = static_cast<double>(g.x.rows());
  const double overall = g.weights.dot(error.cwiseAbs2()) / (rows - 3.0 * 4.0);
  const std::vector<llmt::Extrapolation> extrapolation = model.extrapolation(g.x);
  const Eigen::MatrixXd found = model.standard_errors(g.x);
  for (std::ptrdiff_t m = 0; m < 3; ++m) {
    const Eigen::VectorXd own = validities.col(m);
    const Eigen::MatrixXd gram = a.transpose() * g.weights.cwiseProduct(own).asDiagonal() * a;
    const double rss = g.weights.cwiseProduct(own).dot(error.cwiseAbs2());
    const double variance = (rss + 10.0 * overall) / (own.sum() - 4.0 + 10.0);
    for (std::ptrdiff_t i = 0; i < g.x.rows(); ++i) {
      if (own(i) > 0.5) {
        const double leverage = a.row(i) * gram.inverse() * a.row(i).transpose();
        EXPECT_NEAR(extrapolation[static_cast<std::size_t>(i)].leverage, leverage, 1e-6);
        EXPECT_NEAR(found(i, 0), std::sqrt(variance * leverage), 1e-6);
      }
    }
  }
}

TEST(Merging, PredictionsPrefixesAndFilesHoldTheEquations) {
  for (std::uint64_t seed = 1; seed <= 3; ++seed) {
    for (const Kind& kind : kinds) {
      const Grown g = grown(seed, kind, 2);
      llmt::JointFit fit(g.training, g.tree, 1);
      fit.merge_to(4);
      const llmt::Model model = g.model(fit.joint(9, {{1e-3, 0.0}}).front());
      Eigen::MatrixXd query(300, 3);
      query << oracle::uniform(100, 3, seed + 10), 1.5 * oracle::uniform(100, 3, seed + 20),
          10.0 * oracle::uniform(100, 3, seed + 30);
      for (std::ptrdiff_t i = 0; i < 300; i += 7) {
        query(i, i % 3) = std::nan("");
      }
      const Eigen::MatrixXd predicted = model.predict(query);
      EXPECT_LT((predicted - oracle::predict_rows(model, query)).cwiseAbs().maxCoeff(), 1e-9);
      const llmt::Model back = llmt::from_json(llmt::to_json(model));
      EXPECT_EQ(back.predict(query), predicted);
      EXPECT_EQ(llmt::to_json(back), llmt::to_json(model));
      EXPECT_EQ(local_models_of(back), local_models_of(model));
      for (std::ptrdiff_t leaves = 1; leaves < 9; ++leaves) {
        const llmt::Model smaller = llmt::from_json(llmt::to_json(model.prefix(leaves)));
        EXPECT_LE(smaller.partitions()[0].num_local_models(), leaves);
        EXPECT_LT((smaller.predict(query) - oracle::predict_rows(smaller, query)).cwiseAbs().maxCoeff(), 1e-9);
      }
    }
  }
}

TEST(Merging, DerivativesAndSharesOfTheInputsAreThoseOfThePrediction) {
  const double step = 1e-6;
  for (const std::size_t k : {0, 1, 2}) {
    const Grown g = grown(2, kinds[k]);
    llmt::JointFit fit(g.training, g.tree, 1);
    fit.merge_to(4);
    const llmt::Model model = g.model(fit.joint(9, {{1e-3, 0.0}}).front());
    const Eigen::MatrixXd points = 1.6 * oracle::uniform(60, 3, 77);
    for (std::ptrdiff_t i = 0; i < points.rows(); ++i) {
      const Eigen::VectorXd point = points.row(i).transpose();
      const Eigen::MatrixXd jacobian = model.jacobian(point);
      for (int j = 0; j < 3; ++j) {
        Eigen::MatrixXd sides(2, 3);
        sides << point.transpose(), point.transpose();
        sides(0, j) += step;
        sides(1, j) -= step;
        const Eigen::MatrixXi leaves = model.leaf_of(sides);
        if (k == 0 && leaves(0, 0) != leaves(1, 0)) {
          continue;  // a jump
        }
        const Eigen::MatrixXd values = model.predict(sides);
        const double quotient = (values(0, 0) - values(1, 0)) / (2.0 * step);
        EXPECT_NEAR(jacobian(0, j), quotient, 1e-5 * (1.0 + std::abs(quotient)));
      }
      const llmt::Attribution shares = llmt::attribute(model, point);
      EXPECT_NEAR(shares.contributions.sum(), shares.prediction(0) - shares.reference(0), 1e-9);
    }
  }
}

TEST(Merging, MistakesInASharedModelAreNamed) {
  const Grown g = grown(1, kinds[0]);
  llmt::JointFit fit(g.training, g.tree, 1);
  fit.merge_to(8);
  const llmt::Partition partition = g.model(fit.as_grown(9)).partitions()[0];
  std::size_t shared = 0;
  while (partition.nodes[shared].shared_with < 0) {
    ++shared;
  }
  const auto error = [&](const auto& change) {
    llmt::Partition wrong = partition;
    change(wrong.nodes[shared]);
    return message_of([&] { g.model(wrong); });
  };
  const auto bare = [&](const auto& change) {  // describe_leaves() follows indices
    llmt::Partition wrong = partition;
    change(wrong.nodes[shared]);
    return message_of(
        [&] { llmt::Model(g.training.columns, g.training.output_columns, g.training.regressors, {wrong}); });
  };
  EXPECT_NE(bare([](llmt::Node& node) { node.shared_with = 0; }).find("which must be a leaf with its own"),
            std::string::npos);
  EXPECT_NE(bare([](llmt::Node& node) { node.shared_with = 1000; }).find("which must be an earlier one"),
            std::string::npos);
  EXPECT_NE(error([](llmt::Node& node) { node.value(0) += 1.0; }).find("whose local model it shares"),
            std::string::npos);
  const Data d = data(1);
  llmt::FitOptions options;
  options.growth.merge_leaves = true;
  options.selection.folds.count = 0;
  EXPECT_EQ(message_of([&] { llmt::fit(d.x, d.y, options); }),
            "llmt::fit: selection.folds.count is 0, it must be at least 2 for growth.merge_leaves");
}

}  // namespace
