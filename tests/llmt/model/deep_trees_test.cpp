// Trees as deep as a file may hold them, deeper than any that a fit is likely to make.
#include <gtest/gtest.h>

#include <Eigen/Core>

#include "llmt/explain.hpp"
#include "llmt/model.hpp"
#include "oracles/chains.hpp"
#include "oracles/oracles.hpp"
#include "oracles/predict_oracle.hpp"
#include "oracles/thrown.hpp"

namespace {

using llmt::ValidityKind;
using oracle::Way;

constexpr int chain_length = 2001;  // leaves below 2000 splits

TEST(DeepTrees, AChainThatIsDeeperIsRefused) {
  const auto error = [](Way way) {
    return oracle::thrown([&] { oracle::chain(chain_length + 1, ValidityKind::crisp, 0.0, way); });
  };
  EXPECT_EQ(error(Way::left), "llmt::Model: partition 0 node 4001: the tree is deeper than 2000 splits");
  EXPECT_EQ(error(Way::right), error(Way::left));
}

TEST(DeepTrees, AChainOfCrispLeavesIsRead) {
  for (const Way way : {Way::left, Way::right}) {
    const llmt::Model model = oracle::chain(chain_length, ValidityKind::crisp, 0.0, way);
    const Eigen::MatrixXd x = oracle::uniform(50, 2, 1);
    EXPECT_TRUE(model.predict(x).allFinite());
    EXPECT_EQ(model.predict(x.topRows(3)), model.predict(x).topRows(3));
    EXPECT_EQ(model.validities(x.topRows(1), 0).sum(), 1.0);
    EXPECT_EQ(std::ssize(model.leaves(0)), chain_length);
    EXPECT_TRUE(model.jacobian(x.row(0)).allFinite());
    EXPECT_TRUE(llmt::attribute(model, x.row(0)).contributions.allFinite());
    EXPECT_TRUE(llmt::importance(model, x).allFinite());
  }
}

TEST(DeepTrees, AChainOfLeavesThatAllOverlapIsRead) {
  for (const Way way : {Way::left, Way::right}) {
    const llmt::Model model = oracle::chain(chain_length, ValidityKind::blend, 100.0, way);
    const Eigen::MatrixXd x = oracle::uniform(30, 2, 2);
    const Eigen::MatrixXd predicted = model.predict(x);
    EXPECT_TRUE(predicted.allFinite());
    EXPECT_EQ(model.predict(x.topRows(3)), predicted.topRows(3));
    const llmt::Attribution shares = llmt::attribute(model, x.row(0));
    EXPECT_NEAR(shares.contributions.sum(), shares.prediction(0) - shares.reference(0), 1e-9);
    EXPECT_TRUE(llmt::importance(model, x.topRows(2)).allFinite());
  }
}

TEST(DeepTrees, GuardsAskSixtyFourAncestorsAndThenTheRoot) {
  const Eigen::MatrixXd x = 1.5 * oracle::uniform(40, 2, 3);
  for (const int leaves : {20, 64, 65, 66, 67, 150}) {
    for (const Way way : {Way::left, Way::right}) {
      const llmt::Model model = oracle::chain(leaves, ValidityKind::blend, 3.0, way);
      EXPECT_LT((model.predict(x) - oracle::predict_rows(model, x)).cwiseAbs().maxCoeff(), 1e-11) << leaves;
    }
  }
}

TEST(DeepTrees, DerivativesOfAChainAreThoseOfItsPrediction) {
  const llmt::Model model = oracle::chain(100, ValidityKind::blend, 3.0, Way::right);
  const Eigen::Vector2d at(0.3, -0.4);
  const double step = 1e-6;
  const Eigen::MatrixXd slopes = model.jacobian(at);
  for (int j = 0; j < 2; ++j) {
    const Eigen::Vector2d way = step * Eigen::Vector2d::Unit(j);
    const double change = (model.predict((at + way).transpose()) - model.predict((at - way).transpose()))(0, 0);
    EXPECT_NEAR(slopes(0, j), change / (2.0 * step), 1e-6);
  }
}

}  // namespace
