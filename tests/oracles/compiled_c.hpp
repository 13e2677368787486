// Exported C, compiled and run.
#pragma once

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <Eigen/Core>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <limits>
#include <string>

#include "llmt/c_source.hpp"
#include "llmt/files.hpp"

namespace oracle {

using Rows = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

// A folder of its own for every test; skips the test where there is no C compiler.
class CompiledC : public testing::Test {
 protected:
  void SetUp() override {
    if (std::system("command -v cc >/dev/null") != 0) GTEST_SKIP() << "no C compiler";
    const testing::TestInfo& test = *testing::UnitTest::GetInstance()->current_test_info();
    folder_ = std::filesystem::path(testing::TempDir()) / fmt::format("{}_{}", test.test_suite_name(), test.name());
    std::filesystem::create_directories(folder_);
  }
  void TearDown() override { std::filesystem::remove_all(folder_); }

  // What `main_text`, which includes NAME.h, reads `in` from standard input and writes to standard output: rows of
  // doubles. NaN where it wrote nothing.
  Rows run_c(const llmt::CSource& c, const std::string& name, const std::string& main_text, const Rows& in,
             Eigen::Index columns) const {
    llmt::write_file((folder_ / (name + ".c")).string(), c.source);
    llmt::write_file((folder_ / (name + ".h")).string(), c.header);
    llmt::write_file((folder_ / "main.c").string(), main_text);
    const std::string here = fmt::format("cd '{}' && ", folder_.string());
    const std::string compile = "cc -std=c99 -O1 -Wall -Wextra -Werror -pedantic {0}.c main.c -o {0} -lm";
    EXPECT_EQ(std::system((here + fmt::format(fmt::runtime(compile), name)).c_str()), 0);
    std::ofstream(folder_ / "in", std::ios::binary)
        .write(reinterpret_cast<const char*>(in.data()), static_cast<std::streamsize>(in.size() * sizeof(double)));
    EXPECT_EQ(std::system((here + fmt::format("./{} <in >out", name)).c_str()), 0);
    Rows out = Rows::Constant(in.rows(), columns, std::numeric_limits<double>::quiet_NaN());
    std::ifstream(folder_ / "out", std::ios::binary)
        .read(reinterpret_cast<char*>(out.data()), static_cast<std::streamsize>(out.size() * sizeof(double)));
    return out;
  }

 private:
  std::filesystem::path folder_;
};

}  // namespace oracle
