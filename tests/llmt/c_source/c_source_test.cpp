// Exported C, compiled and run, against the library.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <string>

#include "llmt/boosted.hpp"
#include "llmt/c_source.hpp"
#include "llmt/fit.hpp"
#include "oracles/compiled_c.hpp"
#include "oracles/random_boosted.hpp"
#include "oracles/random_models.hpp"

namespace {

using llmt::ValidityKind;
using random_models::Kind;

constexpr double missing = std::numeric_limits<double>::quiet_NaN();

// Reads rows of doubles, writes rows of doubles.
const char* const main_of_c = R"(#include <stdio.h>
#include "tree.h"
int main(void) {
  double x[%INPUTS%], y[%OUTPUTS%];
  while (fread(x, sizeof(double), %INPUTS%, stdin) == %INPUTS%) {
    if (tree_predict(x, y) != 0) return 3;
    fwrite(y, sizeof(double), %OUTPUTS%, stdout);
  }
  return 0;
}
)";

std::string replaced(std::string text, const std::string& what, const std::string& by) {
  for (std::size_t at = text.find(what); at != std::string::npos; at = text.find(what))
    text.replace(at, what.size(), by);
  return text;
}

class CSource : public oracle::CompiledC {
 protected:
  // What the exported model says of rows.
  template <class AnyModel>
  Eigen::MatrixXd run(const AnyModel& model, const Eigen::MatrixXd& x) const {
    const std::string with_inputs = replaced(main_of_c, "%INPUTS%", std::to_string(model.num_inputs()));
    const std::string main_text = replaced(with_inputs, "%OUTPUTS%", std::to_string(model.num_outputs()));
    return run_c(llmt::to_c(model, "tree", "tree.h"), "tree", main_text, x, model.num_outputs());
  }

  // The bound is 0 units in the last place: both add in the same order. Gaussians rest on the same exp() here.
  template <class AnyModel>
  void expect_equal(const AnyModel& model, const Eigen::MatrixXd& x, const std::string& name) {
    const Eigen::MatrixXd expected = model.predict(x);
    const Eigen::MatrixXd found = run(model, x);
    EXPECT_TRUE((expected.array() == found.array()).all())
        << name << ": " << (expected - found).cwiseAbs().maxCoeff() << " apart";
  }
};

Eigen::MatrixXd queries(const Kind& kind, const llmt::Model& model) {
  llmt::Random random(7);
  Eigen::MatrixXd x(2000, kind.inputs);
  for (Eigen::Index i = 0; i < x.rows(); ++i) {
    const double reach = i % 3 == 0 ? 2.5 : 0.9;
    for (Eigen::Index j = 0; j < kind.inputs; ++j) {
      const bool number = j < kind.inputs - kind.categories;
      x(i, j) = number ? random.uniform(-reach, reach) : std::floor(random.uniform(0.0, 4.2));
      if (i % 5 == 0 && random.uniform() < 0.3) x(i, j) = missing;
    }
    const llmt::Node& node = model.partitions()[0].nodes[i % model.partitions()[0].nodes.size()];
    if (i % 7 == 0 && !node.is_leaf() && node.level_side.empty()) x(i, node.split_input) = node.threshold;
  }
  return x;
}

TEST_F(CSource, CompiledSourceGivesTheBytesOfTheLibrary) {
  const std::vector<Kind> kinds = {
      {.name = "crisp"},
      {.name = "crisp, six inputs, clamped", .inputs = 6, .outputs = 3, .clamped = true},
      {.name = "blend", .validity = ValidityKind::blend, .outputs = 2, .shared = true},
      {.name = "blend of many leaves", .validity = ValidityKind::blend, .leaves = 60},
      {.name = "categories", .validity = ValidityKind::blend, .inputs = 5, .categories = 2, .clamped = true},
      {.name = "gaussian", .validity = ValidityKind::gaussian, .inputs = 5},
      {.name = "gaussian, categories", .validity = ValidityKind::gaussian, .inputs = 4, .categories = 1},
      {.name = "oblique", .validity = ValidityKind::logistic, .inputs = 4, .outputs = 2, .oblique = true},
      {.name = "one leaf", .leaves = 1}};
  for (const Kind& kind : kinds) {
    for (const std::uint64_t seed : {3, 4}) {  // of 4 missing values are levels
      const llmt::Model model = random_models::random_model(kind, seed);
      expect_equal(model, queries(kind, model), kind.name);
    }
  }
}

TEST_F(CSource, FittedModelsWithProductsAndCodesGiveTheBytesOfTheLibrary) {
  llmt::Random random(4);
  Eigen::MatrixXd x(600, 3);
  Eigen::MatrixXd y(600, 1);
  for (Eigen::Index i = 0; i < 600; ++i) {
    x.row(i) << random.uniform(-1.0, 2.0), random.uniform(-3.0, 1.0), std::floor(random.uniform(0.0, 5.0)) * 10.0;
    y(i, 0) = x(i, 0) * x(i, 1) + std::sin(3.0 * x(i, 0)) + (x(i, 2) == 20.0 ? 2.0 : 0.0) + 0.01 * random.normal();
  }
  llmt::FitOptions products;
  products.terms = llmt::LocalTerms::quadratic;
  llmt::FitOptions codes;
  for (const llmt::FitOptions& options : {llmt::FitOptions{}, products, codes}) {
    const llmt::Model model = llmt::fit(x, y, options).model;
    Eigen::MatrixXd at = 1.7 * x;
    at.col(2) = x.col(2).array() + 4.9;
    expect_equal(model, at, "fitted");
  }
  // Codes, and rows without one.
  for (Eigen::Index i = 0; i < 600; ++i) {
    x(i, 2) = i % 9 == 8 ? missing : static_cast<double>(i % 9 + 1);
    y(i, 0) += static_cast<double>(i % 9 * 5 % 9);
  }
  const llmt::Model model = llmt::fit(x, y).model;
  EXPECT_FALSE(model.inputs()[2].codes.empty());
  EXPECT_TRUE(model.inputs()[2].has_empty_level());
  expect_equal(model, x, "a missing code");
}

TEST_F(CSource, SumsOfTreesGiveTheBytesOfTheLibrary) {
  const std::vector<random_boosted::Kind> kinds = {{.soft = false},
                                                   {.trees = 30, .leaves = 40, .soft = true},
                                                   {.trees = 3, .leaves = 1},
                                                   {.trees = 0},
                                                   {.trees = 30, .leaves = 40, .turned = true}};
  for (std::size_t k = 0; k < kinds.size(); ++k) {
    Eigen::MatrixXd x = random_boosted::rows(2000, k);
    const llmt::BoostedModel model = random_boosted::model(kinds[k], k);
    for (Eigen::Index row = 0; row < x.rows() && kinds[k].trees > 0 && kinds[k].leaves > 1; row += 7) {
      const llmt::BoostedSplit& split = model.sums()[0].trees[0].splits[0];  // rows on a threshold
      if (split.feature < 4) {
        x(row, split.feature) =
            model.inputs()[split.feature].centre + split.threshold * model.deviations()[split.feature];
      }
    }
    expect_equal(model, x, "kind " + std::to_string(k));
  }
}

TEST_F(CSource, AFittedSumGivesTheBytesOfTheLibrary) {
  llmt::Random random(5);
  llmt::TrainingData data{.inputs = random_boosted::rows(300, 2), .outputs = Eigen::MatrixXd(300, 1)};
  for (Eigen::Index i = 0; i < 300; ++i) {
    data.outputs(i, 0) = (std::isnan(data.inputs(i, 0)) ? 1.0 : std::abs(data.inputs(i, 0))) + 0.1 * random.normal();
  }
  data.categorical_inputs = {4};
  expect_equal(llmt::fit_boosted(data).model, random_boosted::rows(1000, 3), "fitted");
}

TEST_F(CSource, InfiniteInputsAreRefusedAndTheNameIsAnIdentifier) {
  const llmt::Model model = random_models::random_model({.name = "crisp"}, 1);
  for (const char* name : {"", "2tree", "a-b", "double", "a_name_of_more_than_thirty_one_letters"}) {
    EXPECT_THROW(llmt::to_c(model, name, "x.h"), std::invalid_argument) << name;
  }
  EXPECT_NE(llmt::to_c(model, "tree", "x.h").source.find("#include \"x.h\""), std::string::npos);
}

TEST_F(CSource, NamesOfColumnsCannotEndTheComment) {
  const llmt::Model model = random_models::random_model({.name = "crisp"}, 1)
                                .named({"*/ #error",
                                        "b\n?"
                                        "?/",
                                        "c"},
                                       {"d"});
  run(model, Eigen::MatrixXd::Zero(1, 3));
  const llmt::Model marked = model.named({"a\xE2\x80\xAE", "b\xE2\x81\xA6z",
                                          "gr\xC3\xB6\xC3\x9F"
                                          "e"},
                                         {"d\xD8\x9Cy"});
  const std::string source = llmt::to_c(marked, "tree", "x.h").source;
  EXPECT_EQ(source.find("\xE2"), std::string::npos);
  EXPECT_EQ(source.find("\xD8"), std::string::npos);
  EXPECT_NE(source.find("b_z"), std::string::npos);
  EXPECT_NE(source.find("gr\xC3\xB6\xC3\x9F"
                        "e"),
            std::string::npos);
}

}  // namespace
