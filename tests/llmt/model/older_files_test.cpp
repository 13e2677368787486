// Model files that hold what fits made before the first release.
#include <gtest/gtest.h>

#include <Eigen/Core>
#include <string>

#include "llmt/fit.hpp"
#include "oracles/oracles.hpp"
#include "oracles/thrown.hpp"

namespace {

std::string blend_as_json() {
  const Eigen::MatrixXd x = oracle::uniform(200, 2, 1);
  llmt::FitOptions options;
  options.validity = llmt::ValidityChoice::blend;
  options.max_leaves = 3;
  return llmt::to_json(llmt::fit(x, oracle::curved(x), options).model);
}

std::string refusal(std::string text, const std::string& from, const std::string& to) {
  const std::size_t at = text.find(from);
  if (at == std::string::npos) return "there is no " + from;
  text.replace(at, from.size(), to);
  return oracle::thrown<std::runtime_error>([&] { llmt::from_json(text); });
}

TEST(OlderFiles, BlendsWithTwoContinuousDerivativesAreRefused) {
  EXPECT_EQ(refusal(blend_as_json(), R"("smoothness": 1)", R"("smoothness": 2)"),
            "model: /partitions/0/validity/smoothness: 2 is not known: blends have 1 continuous derivative");
}

TEST(OlderFiles, LeavesThatShareALocalModelAreRefused) {
  for (const std::string member : {"shared_with", "guard_parent"}) {
    EXPECT_EQ(refusal(blend_as_json(), R"("samples": )", "\"" + member + R"(": 0, "samples": )"),
              "model: /partitions/0/nodes/0/" + member +
                  ": leaves that share a local model cannot be read; fit the model anew");
  }
}

}  // namespace
