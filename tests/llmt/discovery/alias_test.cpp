// Of causes that predict the same.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <set>

#include "search_cases.hpp"

namespace {

using namespace search_cases;

TEST(SearchVerdict, ARivalThatLeavesAsMuchButPredictsOtherwiseIsNotExact) {
  Case data = random_case(6, 200, 1, 3, 6, 6);
  llmt::Random random(7);
  data.evidence.jacobian.resize(200, 0);
  const Eigen::VectorXd cause = normal_matrix(random, 200, 1);
  data.evidence.residuals += 3.0 * cause;
  // Orthogonal to the residuals: one cause with it and one without leave the same sum of squares.
  Eigen::MatrixXd others(200, 2);
  others << data.evidence.residuals, cause;
  const Eigen::VectorXd aside = refitted_errors(others, normal_matrix(random, 200, 1));
  data.candidates[0].signature = cause + 0.03 * aside;
  data.candidates[1].signature = cause - 0.03 * aside;
  const Verdict verdict = search(data.evidence, data.candidates);
  ASSERT_EQ(verdict.findings.size(), 1U);
  ASSERT_EQ(verdict.findings[0].rivals.size(), 1U);
  EXPECT_NEAR(verdict.findings[0].rivals[0].score_difference, 0.0, 1e-6);
  EXPECT_FALSE(verdict.findings[0].rivals[0].exact);
}

// Of x, y and x - y any two say the same.
TEST(SearchVerdict, TheLeastComplexOfExactAliasesIsNamed) {
  for (std::uint64_t seed = 1; seed <= 8; ++seed) {
    Case data = random_case(seed, 100, 1, 3, 9, 9);
    data.candidates[0].signature = data.candidates[0].signature.leftCols(1);
    data.candidates[3].signature = data.candidates[3].signature.leftCols(1);
    data.candidates[6].signature = data.candidates[0].signature - data.candidates[3].signature;
    for (EffectCandidate& candidate : data.candidates) candidate.location = "here";
    add_effect(data, 0, 2.0);
    add_effect(data, 3, 0.7);
    for (const auto& [plain, middle, complex] : {std::array{0, 3, 6}, std::array{3, 6, 0}, std::array{6, 0, 3}}) {
      data.candidates[plain].complexity = 1;
      data.candidates[middle].complexity = 2;
      data.candidates[complex].complexity = 3;
      const Verdict verdict = search(data.evidence, data.candidates);
      ASSERT_EQ(verdict.findings.size(), 2U);
      const std::set<std::string> names = {verdict.findings[0].family, verdict.findings[1].family};
      EXPECT_EQ(names, (std::set{data.candidates[plain].family, data.candidates[middle].family})) << seed;
      // The third is another way of writing the same at the same place.
      for (const Finding& finding : verdict.findings) {
        EXPECT_TRUE(std::ranges::none_of(finding.rivals, &Rival::exact)) << seed;
      }
    }
  }
}

// Two causes of one another's shape at different places stay rivals, whichever is more complex.
TEST(SearchVerdict, AnExactAliasElsewhereIsARivalHoweverComplex) {
  Case data = random_case(5, 100, 1, 3, 6, 6);
  data.candidates[4].signature = -2.0 * data.candidates[1].signature;
  data.candidates[1].complexity = 9;
  data.candidates[4].complexity = 2;
  data.candidates[4].location = "elsewhere";
  add_effect(data, 1, 1.0);
  const Verdict verdict = search(data.evidence, data.candidates);
  ASSERT_EQ(verdict.findings.size(), 1U);
  EXPECT_EQ(verdict.findings[0].family, data.candidates[4].family);
  ASSERT_EQ(verdict.findings[0].rivals.size(), 1U);
  EXPECT_TRUE(verdict.findings[0].rivals[0].exact);
  EXPECT_EQ(verdict.answer, Answer::indistinguishable);
}

}  // namespace
