#include "expressions/expression.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "oracles/thrown.hpp"

namespace llmt {
namespace {

std::string refusal(const std::string& text) {
  return oracle::thrown<ExpressionError>([&] { Expression{text}; });
}

TEST(Expression, HasTheValueOfItsVariables) {
  Expression expression("2 * b + (a > 1 ? sin(a) : -a) ^ 2 + pi", {{"pi", 3.0}});
  EXPECT_EQ(expression.names(), (std::vector<std::string>{"a", "b"}));
  EXPECT_NEAR(expression.value(std::vector<double>{2.0, 5.0}), 13.0 + std::sin(2.0) * std::sin(2.0), 1e-14);
  EXPECT_EQ(expression.value(std::vector<double>{0.5, 1.0}), 5.25);
  EXPECT_TRUE(std::isinf(Expression("1 / a").value(std::vector<double>{0.0})));
  EXPECT_EQ(Expression("(a >= 1) + (a <= 1) + (a != 2) + (a == 1)").value(std::vector<double>{1.0}), 4.0);
}

// In `joint: "q1=3"` it is a slip for ==, and it would change q1 for the following terms.
TEST(Expression, AssignsNothing) {
  EXPECT_EQ(refusal("q1=3"), "column 3 of \"q1=3\": == compares; = is not allowed");
  EXPECT_EQ(refusal("q2 + (q1 = 7)"), "column 10 of \"q2 + (q1 = 7)\": == compares; = is not allowed");
  EXPECT_NE(refusal("a === b").find("= is not allowed"), std::string::npos);
  EXPECT_NE(refusal("a =< b").find("= is not allowed"), std::string::npos);
  EXPECT_NE(refusal("= a").find("column 1 of"), std::string::npos);
}

TEST(Expression, HasOneValueAndOneLine) {
  EXPECT_EQ(refusal("a, b"), "column 1 of \"a, b\": there are several values, separated by commas");
  EXPECT_EQ(Expression("max(a, b)").value(std::vector<double>{1.0, 2.0}), 2.0);
  EXPECT_NE(refusal("\"a\"").find("no strings"), std::string::npos);
  EXPECT_NE(refusal(std::string("1 + \0 2", 7)).find("column 5"), std::string::npos);
  EXPECT_NE(refusal("sin(a").find("of \"sin(a\": "), std::string::npos);
  EXPECT_NE(refusal("atan2(a)").find("atan2"), std::string::npos);
  EXPECT_NE(refusal("").find("of \"\": "), std::string::npos);
}

TEST(Expression, TooLongOnesAreNotShownWhole) {
  std::string sum = "a";
  while (sum.size() + 2 <= Expression::longest) sum += "+a";
  EXPECT_EQ(Expression(sum).names().size(), 1U);
  const std::string message = refusal(sum + "+a");
  EXPECT_NE(message.find("has 10001 characters, at most 10000 are read"), std::string::npos) << message;
  EXPECT_LT(message.size(), 200U);
  std::string text(9999, 'x');
  text += " y";
  EXPECT_LT(refusal(text).size(), 400U);
}

}  // namespace
}  // namespace llmt
