// Signals at random times, two processes on one output.
#include <signal.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <chrono>
#include <thread>

#include "faults/job.hpp"

extern char** environ;

namespace {

using faults::JobFolder;

// Starts the job with a shell that becomes the program.
pid_t start(const JobFolder& at) {
  const std::string command =
      fmt::format("cd '{}' && exec {} >/dev/null 2>&1 </dev/null", at.folder.file("."), at.job().command);
  std::vector<std::string> words = {"sh", "-c", command};
  std::vector<char*> arguments = {words[0].data(), words[1].data(), words[2].data(), nullptr};
  pid_t process = 0;
  EXPECT_EQ(::posix_spawn(&process, "/bin/sh", nullptr, nullptr, arguments.data(), environ), 0);
  return process;
}

int wait_for(pid_t process) {
  int status = 0;
  EXPECT_EQ(::waitpid(process, &status, 0), process);
  return status;
}

TEST(Kills, AtRandomTimesLeaveTheOldFileOrTheNewOne) {
  JobFolder at(faults::fit_job());
  at.write_tables();
  const auto begin = std::chrono::steady_clock::now();
  at.learn_new_content();
  const double seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
  llmt::Random random(14);
  for (const int signal : {SIGTERM, SIGINT, SIGKILL}) {
    for (int i = 0; i < 8; ++i) {
      at.put_old_files();
      const pid_t process = start(at);
      std::this_thread::sleep_for(std::chrono::duration<double>(random.uniform(0.0, 1.2 * seconds)));
      ::kill(process, signal);
      wait_for(process);
      // Nothing can be done after SIGKILL, and between the first name and the last one there is an instant.
      at.count_new_files(signal == SIGKILL);
    }
  }
}

// A fit of several CSV files keeps their rows in the folder for temporary files.
TEST(Kills, LeaveNothingInTheFolderForTemporaryFiles) {
  JobFolder at({"env TMPDIR=tmp " LLMT_PROGRAM
                " fit long.csv long.csv --target y --memory 2M --cv 0 --threads 1 -o out/m.json",
                {"m.json"}});
  llmt::Random random(57);
  std::string text = "a,b,y\n";
  for (int i = 0; i < 20000; ++i) {
    const double a = random.uniform();
    text += fmt::format("{:.5f},{:.5f},{:.5f}\n", a, random.uniform(), 2.0 * a);
  }
  at.folder.write("long.csv", text);
  const std::filesystem::path kept = at.folder.file("tmp");
  std::filesystem::create_directory(kept);
  const auto begin = std::chrono::steady_clock::now();
  at.learn_new_content();
  const double seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
  EXPECT_TRUE(std::filesystem::is_empty(kept));
  for (const int signal : {SIGTERM, SIGINT, SIGKILL}) {
    for (int i = 0; i < 8; ++i) {
      const pid_t process = start(at);
      std::this_thread::sleep_for(std::chrono::duration<double>(random.uniform(0.0, 0.6 * seconds)));
      ::kill(process, signal);
      wait_for(process);
      EXPECT_TRUE(std::filesystem::is_empty(kept)) << signal;
    }
  }
}

TEST(TwoProcesses, OnOneOutputLeaveItWhole) {
  JobFolder at(faults::fit_job());
  at.write_tables();
  at.learn_new_content();
  for (int i = 0; i < 5; ++i) {
    at.put_old_files();
    const pid_t one = start(at);
    const pid_t other = start(at);
    EXPECT_EQ(wait_for(one), 0);
    EXPECT_EQ(wait_for(other), 0);
    EXPECT_EQ(at.count_new_files(), 1);
  }
}

}  // namespace
