#include "llmt/finding.hpp"

#include <gtest/gtest.h>

namespace llmt {
namespace {

const Face of_python{.before_option = "", .between_words = '_', .switched_on = "=True", .in_memory = true};

TEST(Finding, EachFaceHasItsOwnWords) {
  const std::vector<Eigen::Index> lines = {5, 7};
  const Finding zeros = {"zeros", [=](const Face& face) {
                           return face.table("<measured>") + ": " + face.rows(lines) + ": " + face.switched("robust");
                         }};
  EXPECT_EQ(zeros.words({}), "<measured>: lines 5, 7: --robust");
  EXPECT_EQ(zeros.words(of_python), "measured: rows 3, 5: robust=True");
  EXPECT_EQ(words({zeros, finding("plain", "the same")}, of_python).back(), "the same");
}

TEST(Finding, PlacesAndOptionsAreNamed) {
  EXPECT_EQ(Face().place("m.csv", 7), "m.csv:7");
  EXPECT_EQ(of_python.place("<measured>", 7), "measured, row 5");
  EXPECT_EQ(Face().option("same-session"), "--same-session");
  EXPECT_EQ(of_python.option("same-session"), "same_session");
  EXPECT_EQ(Face().rows({4}), "line 4");
  EXPECT_EQ(numbered("row", {1, 2, 3}, 2), "rows 1, 2, ...");
}

}  // namespace
}  // namespace llmt
