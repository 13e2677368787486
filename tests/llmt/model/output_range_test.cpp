// Outputs that are clamped to a range: docs/algorithms/guards.md, B.5.
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <string>

#include "llmt/fit.hpp"
#include "llmt/model.hpp"
#include "oracles/clamped.hpp"
#include "oracles/edited.hpp"
#include "oracles/random_models.hpp"
#include "oracles/thrown.hpp"

namespace {

using oracle::replaced;

using llmt::ValidityKind;
using oracle::clamped;
using oracle::unclamped;
using random_models::Kind;
using random_models::random_model;

constexpr double open = std::numeric_limits<double>::infinity();

const Kind kinds[] = {
    {.name = "crisp", .outputs = 2},
    {.name = "blend", .validity = ValidityKind::blend, .outputs = 2},
    {.name = "shared", .validity = ValidityKind::blend, .categories = 1, .outputs = 2, .shared = true},
    {.name = "gaussian", .validity = ValidityKind::gaussian, .outputs = 2},
    {.name = "logistic", .validity = ValidityKind::logistic, .outputs = 2},
};

// Of both outputs; the second has no bound.
Eigen::MatrixXd one_range() {
  Eigen::MatrixXd range(2, 2);
  range << -0.6, 0.8, -open, open;
  return range;
}

bool is_outside(double value) { return value < -0.6 || value > 0.8; }

TEST(OutputRange, PredictionsAreThoseWithoutItClamped) {
  for (const Kind& kind : kinds) {
    const llmt::Model model = random_model(kind, 3);
    const Eigen::MatrixXd x = 1.8 * oracle::uniform(2000, kind.inputs, 4);
    Eigen::MatrixXd expected = model.predict(x);
    expected.col(0) = expected.col(0).cwiseMax(-0.6).cwiseMin(0.8);
    EXPECT_LT((expected.col(0).array() == 0.8).count(), 1900) << kind.name;
    EXPECT_GT((expected.col(0).array() == 0.8).count(), 100) << kind.name;
    EXPECT_EQ(clamped(model, one_range()).predict(x), expected) << kind.name;
    for (Eigen::Index i = 0; i < 20; ++i) {
      EXPECT_EQ(clamped(model, one_range()).predict(x.row(i)), expected.row(i)) << kind.name;
    }
  }
}

TEST(OutputRange, TheDerivativeIsZeroOutside) {
  for (const Kind& kind : kinds) {
    const llmt::Model model = random_model(kind, 5);
    const llmt::Model held = clamped(model, one_range());
    const Eigen::MatrixXd x = 1.5 * oracle::uniform(200, kind.inputs, 6);
    const Eigen::MatrixXd free = model.predict(x);
    int outside = 0;
    for (Eigen::Index i = 0; i < x.rows(); ++i) {
      Eigen::MatrixXd expected = model.jacobian(x.row(i).transpose());
      if (is_outside(free(i, 0))) expected.row(0).setZero();
      outside += is_outside(free(i, 0)) ? 1 : 0;
      EXPECT_EQ(held.jacobian(x.row(i).transpose()), expected) << kind.name;
    }
    EXPECT_GT(outside, 20);
    EXPECT_LT(outside, 180);
  }
}

TEST(OutputRange, PrefixesAndRenamedModelsKeepIt) {
  const llmt::Model model = clamped(random_model(kinds[1], 7), one_range());
  EXPECT_EQ(model.prefix(3).partitions()[0].output_range, model.partitions()[0].output_range);
  EXPECT_EQ(model.prefix(1).predict(Eigen::MatrixXd::Constant(1, 3, 1e3)).cwiseMax(-0.6).cwiseMin(0.8)(0),
            model.prefix(1).predict(Eigen::MatrixXd::Constant(1, 3, 1e3))(0));
  EXPECT_EQ(model.named({"a", "b", "c"}, {"u", "v"}).partitions()[0].output_range, model.partitions()[0].output_range);
}

TEST(OutputRange, FilesKeepIt) {
  for (const Kind& kind : kinds) {
    const llmt::Model model = clamped(random_model(kind, 9), one_range());
    const std::string text = to_json(model);
    EXPECT_NE(text.find("\"version\": 3"), std::string::npos);
    const llmt::Model back = llmt::from_json(text);
    EXPECT_EQ(to_json(back), text);
    EXPECT_EQ(back.partitions()[0].output_range, model.partitions()[0].output_range);
    const Eigen::MatrixXd x = 2.0 * oracle::uniform(300, kind.inputs, 9);
    EXPECT_EQ(back.predict(x), model.predict(x));
    // A model without one is as programs that know version 2 alone read it.
    const std::string without = to_json(unclamped(model));
    EXPECT_NE(without.find("\"version\": 2"), std::string::npos);
    EXPECT_EQ(without.find("output_range"), std::string::npos);
  }
}

// The file of a shared partition whose first output is clamped, with another range.
std::string with_range(const std::string& range) {
  std::string text = to_json(clamped(random_model(kinds[2], 13), one_range()));
  const std::size_t begin = text.find("\"output_range\": ") + 16;
  return text.replace(begin, text.find("\"nodes\"", begin) - begin, range + ", ");
}

TEST(OutputRange, NonsenseInFilesIsRefused) {
  const auto error_of = [](const std::string& text) {
    return oracle::thrown<std::runtime_error>([&] { llmt::from_json(text, "m"); });
  };
  EXPECT_EQ(error_of(with_range("[[-0.6, 0.8], []]")), "nothing was thrown");
  EXPECT_EQ(error_of(with_range("[[-5.0, 5.0], [0.0, 0.0]]")), "nothing was thrown");
  const std::string shape = "m: /partitions/0: output_range must be finite or open, 2 x 2, low <= high";
  EXPECT_EQ(error_of(with_range("[[0.8, -0.6], []]")), shape);
  EXPECT_EQ(error_of(with_range("[[-0.6, 0.8]]")), "m: /partitions/0/output_range: 2 rows are needed, there are 1");
  EXPECT_EQ(error_of(with_range("[]")), "m: /partitions/0/output_range: 2 rows are needed, there are 0");
  EXPECT_EQ(error_of(with_range("7")), "m: /partitions/0/output_range: an array is needed, not 7");
  EXPECT_EQ(error_of(with_range("[[-0.6, 0.8], [1]]")),
            "m: /partitions/0/output_range/1: 2 numbers are needed, there are 1");
  EXPECT_EQ(error_of(with_range("[[null, 0.8], []]")),
            "m: /partitions/0/output_range/0/0: a number is needed, not null");
  EXPECT_EQ(error_of(with_range("[[-0.6, 1e400], []]")).find("m: /partitions/0/output_range/0/1: 1e400 is beyond"), 0U);
  EXPECT_EQ(error_of(with_range("[[-0.6, 9.0], []]")),
            "m: /partitions/0: output_range -0.6 ... 9 of output 0 lies outside of its training range -5 ... 5");
  EXPECT_EQ(error_of(with_range("[[-1e9, 1.0], []]")),
            "m: /partitions/0: output_range -1000000000 ... 1 of output 0 lies outside of its training range -5 ... 5");
  // A program that knows version 2 alone would predict without it.
  EXPECT_EQ(error_of(replaced(with_range("[[-0.6, 0.8], []]"), "\"version\": 3", "\"version\": 2")),
            "m: /partitions/0/output_range: a file of version 2 has no such member");
}

TEST(OutputRange, NonsenseInModelsIsRefused) {
  const llmt::Model model = random_model(kinds[2], 11);
  const auto error_of = [&](const Eigen::MatrixXd& range) {
    std::vector<llmt::Partition> partitions = model.partitions();
    partitions[0].output_range = range;
    return oracle::thrown([&] { llmt::Model(model.inputs(), model.outputs(), model.regressors(), partitions); });
  };
  Eigen::MatrixXd range = one_range();
  EXPECT_EQ(error_of(range), "nothing was thrown");
  const std::string refused = "llmt::Model: partition 0: output_range must be finite or open, 2 x 2, low <= high";
  for (const double wrong : {std::nan(""), open, -open, 1.0}) {
    range(0, 0) = wrong;
    EXPECT_EQ(error_of(range), refused) << wrong;
  }
  EXPECT_EQ(error_of(Eigen::MatrixXd::Zero(1, 2)), refused);
  EXPECT_EQ(error_of(Eigen::MatrixXd::Zero(2, 3)), refused);
}

}  // namespace
