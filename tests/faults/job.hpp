// A program that writes files into a folder of its own, and what must be true of that folder whatever went wrong.
#pragma once

#include <fmt/format.h>
#include <gtest/gtest.h>
#include <sys/stat.h>

#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "apps/program.hpp"
#include "llmt/random.hpp"

namespace faults {

inline mode_t mode_of(const std::string& path) {
  struct stat status = {};
  return ::stat(path.c_str(), &status) == 0 ? status.st_mode & 0777 : 0;
}

/// A command that writes `files` into the folder `out`, from inputs that stand elsewhere.
struct Job {
  std::string command;
  std::vector<std::string> files;
};

class JobFolder {
 public:
  explicit JobFolder(Job job) : job_(std::move(job)) { std::filesystem::create_directory(folder.file("out")); }

  /// The inputs of all jobs: 400 rows, and a model of them.
  void write_tables() const {
    llmt::Random random(1);
    std::string text = "a,b,y\n";
    for (int i = 0; i < 400; ++i) {
      const double a = random.uniform(-1.0, 1.0);
      const double b = random.uniform(-1.0, 1.0);
      text += fmt::format("{},{},{}\n", a, b, a * b + 0.1 * random.normal());
    }
    folder.write("d.csv", text);
  }

  /// Runs the job undisturbed and keeps what it wrote.
  void learn_new_content() {
    const program::Outcome outcome = folder.run(job_.command);
    ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
    for (const std::string& file : job_.files) content_[file] = llmt::read_file(out(file));
  }

  /// Puts old files in place that are not as a new one would be.
  void put_old_files() const {
    std::filesystem::remove_all(folder.file("out"));
    std::filesystem::create_directory(folder.file("out"));
    for (const std::string& file : job_.files) {
      llmt::write_file(out(file), old_content);
      ASSERT_EQ(::chmod(out(file).c_str(), old_mode), 0);
    }
  }

  /// Every file is the old one or the new one, with its mode, and there is no other, but for one that was about to take
  /// its name where that is allowed. Returns how many are new.
  int count_new_files(bool may_be_unfinished = false) const {
    int count = 0;
    for (const std::string& file : job_.files) {
      const std::string content = llmt::read_file(out(file));
      EXPECT_TRUE(content == old_content || content == content_.at(file)) << file << " is neither old nor new";
      EXPECT_EQ(mode_of(out(file)), old_mode) << file;
      count += content == old_content ? 0 : 1;
    }
    for (const auto& entry : std::filesystem::directory_iterator(folder.file("out"))) {
      const std::string name = entry.path().filename().string();
      const bool is_unfinished = name.starts_with(".llmt-") && name.ends_with(".tmp");
      EXPECT_TRUE(content_.contains(name) || (may_be_unfinished && is_unfinished)) << name << " is left";
    }
    return count;
  }

  const Job& job() const { return job_; }
  std::string out(const std::string& file) const { return folder.file("out/" + file); }

  const program::Folder folder;

  static constexpr const char* old_content = "old\n";
  static constexpr mode_t old_mode = 0660;  // the usual umask takes a bit of it

 private:
  Job job_;
  std::map<std::string, std::string> content_;
};

/// A fit of a small table, in a tenth of a second.
inline Job fit_job() {
  return {LLMT_PROGRAM " fit d.csv --target y --validity crisp --cv 2 --threads 1 -o out/m.json", {"m.json"}};
}

}  // namespace faults
