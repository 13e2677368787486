// Reading and writing of whole files. Failing disks and signals: tests/faults.
#include "llmt/files.hpp"

#include <gtest/gtest.h>
#include <sys/stat.h>
#include <unistd.h>

#include <filesystem>
#include <stdexcept>
#include <vector>

#include "oracles/thrown.hpp"

namespace {

namespace fs = std::filesystem;

class Files : public testing::Test {
 protected:
  void SetUp() override {
    folder_ = fs::path(testing::TempDir()) / ("llmt_files." + std::to_string(::getpid()));
    fs::remove_all(folder_);
    fs::create_directories(folder_);
  }
  void TearDown() override { fs::remove_all(folder_); }

  std::string path(const std::string& name) const { return (folder_ / name).string(); }
  std::vector<std::string> names() const {
    std::vector<std::string> result;
    for (const auto& entry : fs::directory_iterator(folder_)) result.push_back(entry.path().filename().string());
    return result;
  }
  static mode_t mode_of(const std::string& file) {
    struct stat status = {};
    EXPECT_EQ(::stat(file.c_str(), &status), 0);
    return status.st_mode & 0777;
  }

 private:
  fs::path folder_;
};

TEST_F(Files, OldPermissionsStayAndNewOnesFollowTheUmask) {
  const mode_t before = ::umask(027);
  llmt::write_file(path("new"), "1");
  EXPECT_EQ(mode_of(path("new")), 0640);
  for (const mode_t mode : {0600, 0444, 0777}) {
    llmt::write_file(path("old"), "1");
    ASSERT_EQ(::chmod(path("old").c_str(), mode), 0);
    llmt::write_file(path("old"), "2");
    EXPECT_EQ(mode_of(path("old")), mode);
    EXPECT_EQ(llmt::read_file(path("old")), "2");
  }
  ::umask(before);
  EXPECT_EQ(names().size(), 2U);
}

TEST_F(Files, ALinkStaysALinkAndADanglingOneGetsItsTarget) {
  fs::create_directory(path("sub"));
  fs::create_symlink("sub/target", path("link"));
  fs::create_symlink("link", path("chain"));
  llmt::write_file(path("chain"), "made");
  EXPECT_TRUE(fs::is_symlink(path("chain")));
  EXPECT_TRUE(fs::is_symlink(path("link")));
  EXPECT_EQ(llmt::read_file(path("sub/target")), "made");
  llmt::write_file(path("chain"), "replaced");
  EXPECT_EQ(llmt::read_file(path("sub/target")), "replaced");
  fs::create_symlink("circle", path("circle"));
  EXPECT_EQ(oracle::thrown<std::runtime_error>([&] { llmt::write_file(path("circle"), "x"); }),
            path("circle") + ": cannot be written: Too many levels of symbolic links");
}

TEST_F(Files, NoLinkThatAnotherHasPutThereIsFollowed) {
  llmt::write_file(path("victim"), "victim");
  // The name that earlier versions took.
  fs::create_symlink("victim", path("m.json." + std::to_string(::getpid()) + ".tmp"));
  llmt::write_file(path("m.json"), "model");
  EXPECT_EQ(llmt::read_file(path("victim")), "victim");
  EXPECT_FALSE(fs::is_symlink(path("m.json")));
}

TEST_F(Files, AFailureLeavesTheOldFileAndNothingElse) {
  llmt::write_file(path("f"), "old");
  EXPECT_THROW(llmt::write_file(path("f"),
                                [](const llmt::TextSink& sink) {
                                  sink("half");
                                  throw std::logic_error("no more");
                                }),
               std::logic_error);
  EXPECT_EQ(llmt::read_file(path("f")), "old");
  EXPECT_EQ(names().size(), 1U);
  EXPECT_EQ(oracle::thrown<std::runtime_error>([&] { llmt::write_file(path("no/f"), "x"); }),
            path("no/f") + ": cannot be written: No such file or directory");
  EXPECT_EQ(oracle::thrown<std::runtime_error>([&] { llmt::write_file(path("f/g"), "x"); }),
            path("f/g") + ": cannot be written: Not a directory");
  EXPECT_EQ(oracle::thrown<std::runtime_error>([&] { llmt::write_file(path("."), "x"); }),
            path(".") + ": cannot be written: Is a directory");
}

TEST_F(Files, ThatBelongTogetherAreWrittenTogether) {
  llmt::write_file(path("a"), "old");
  const std::vector<llmt::NewFile> files = {{path("a"), "new"}, {path("no/b"), "new"}};
  EXPECT_EQ(oracle::thrown<std::runtime_error>([&] { llmt::write_files(files); }),
            path("no/b") + ": cannot be written: No such file or directory");
  EXPECT_EQ(llmt::read_file(path("a")), "old");
  EXPECT_EQ(names().size(), 1U);
}

TEST_F(Files, WhatNeverEndsIsRefusedAtTheLimit) {
  EXPECT_EQ(oracle::thrown<std::runtime_error>([] { llmt::read_file("/dev/zero", llmt::description_limit); }),
            "/dev/zero: cannot be read: it holds more than 16 MiB, the most that is read");
  EXPECT_EQ(oracle::thrown<std::runtime_error>([] { llmt::read_file("/dev/zero", {.line_bytes = 1 << 20}); }),
            "/dev/zero: cannot be read: no line ends within 1 MiB");
  std::string two_lines(4096, 'x');
  two_lines.append("\n").append(4096, 'x');
  llmt::write_file(path("f"), two_lines);
  EXPECT_EQ(llmt::read_file(path("f"), {.bytes = 8193}).size(), 8193U);
  EXPECT_EQ(oracle::thrown<std::runtime_error>([&] { llmt::read_file(path("f"), {.bytes = 8192}); }),
            path("f") + ": cannot be read: it holds more than 8 KiB, the most that is read");
  EXPECT_EQ(llmt::read_file(path("f"), {.line_bytes = 4096}).size(), 8193U);
  // Its size is known at once: nothing of it is read.
  ASSERT_EQ(::truncate(path("f").c_str(), off_t{1} << 40), 0);
  EXPECT_EQ(oracle::thrown<std::runtime_error>([&] { llmt::read_file(path("f")); }),
            path("f") + ": cannot be read: it holds more than 1 GiB, the most that is read");
  EXPECT_EQ(oracle::thrown<std::runtime_error>([&] { llmt::read_file(path(".")); }),
            path(".") + ": cannot be read: it is a folder");
}

}  // namespace
