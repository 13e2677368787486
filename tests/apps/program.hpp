// Runs a program as a user would and catches what it prints.
#pragma once

#include <gtest/gtest.h>
#include <sys/wait.h>

#include <cstdlib>
#include <filesystem>
#include <string>

#include "llmt/files.hpp"

namespace program {

struct Outcome {
  int exit_code = -1;
  std::string out;
  std::string err;
};

/// A folder of its own for each test, removed at the end.
class Folder {
 public:
  Folder() {
    const testing::TestInfo* test = testing::UnitTest::GetInstance()->current_test_info();
    path_ = std::filesystem::path(testing::TempDir()) / (std::string(test->test_suite_name()) + "." + test->name());
    std::filesystem::remove_all(path_);
    std::filesystem::create_directories(path_);
  }
  ~Folder() { std::filesystem::remove_all(path_); }
  Folder(const Folder&) = delete;
  Folder& operator=(const Folder&) = delete;

  std::string file(const std::string& name) const { return (path_ / name).string(); }
  std::string write(const std::string& name, const std::string& text) const {
    llmt::write_file(file(name), text);
    return file(name);
  }

  /// Runs `command` with a shell in this folder.
  Outcome run(const std::string& command) const {
    const std::string out = file(".out");
    const std::string err = file(".err");
    const int status = std::system(
        ("cd '" + path_.string() + "' && (" + command + ") >'" + out + "' 2>'" + err + "' </dev/null").c_str());
    return {WIFEXITED(status) ? WEXITSTATUS(status) : -1, llmt::read_file(out), llmt::read_file(err)};
  }

 private:
  std::filesystem::path path_;
};

}  // namespace program
