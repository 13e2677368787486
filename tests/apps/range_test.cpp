// A program with an option that takes a number and has no range does not start.
#include <gtest/gtest.h>

#include "shared/cli.hpp"
#include "shared/options.hpp"

namespace {

int start(CLI::App& app) {
  std::string name = "program";
  char* arguments[] = {name.data(), nullptr};
  testing::internal::CaptureStderr();
  const int code = llmt::apps::run(app, 1, arguments);
  const std::string text = testing::internal::GetCapturedStderr();
  EXPECT_EQ(text, code == 0 ? "" : "program: option --number has no range\n");
  return code;
}

template <class Number>
int start_with(Number number) {
  CLI::App app("", "program");
  app.add_subcommand("command", "")->add_option("--number", number);
  return start(app);
}

TEST(Range, EveryNumberOfAProgramHasOne) {
  EXPECT_EQ(start_with(1.0), 1);
  EXPECT_EQ(start_with(1), 1);
  EXPECT_EQ(start_with(std::uint64_t{1}), 1);
  EXPECT_EQ(start_with(std::vector<double>{1.0}), 1);
  EXPECT_EQ(start_with(std::string("text")), 0);
  CLI::App app("", "program");
  double number = 0.0;
  llmt::apps::add_number(app, "--number", number, llmt::any_share, "");
  EXPECT_EQ(start(app), 0);
}

}  // namespace
