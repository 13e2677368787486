// Every system call with which a program writes its files fails, one after another; or a signal comes just before it.
#include <csignal>

#include "faults/job.hpp"

namespace {

using faults::Job;
using faults::JobFolder;

#ifdef LLMT_FAULT_SHIM

struct Fault {
  std::string kind;  // as LLMT_FAULT_KIND
  bool nameless = true;
};

// The outcome of the job with the fault at a call; `fired`: whether the job makes that call at all.
program::Outcome run_with(const Fault& fault, int call, const JobFolder& at, bool& fired) {
  at.put_old_files();
  const std::string marker = at.folder.file("fired");
  std::filesystem::remove(marker);
  const program::Outcome outcome = at.folder.run(
      fmt::format("LD_PRELOAD='{}' LLMT_FAULT_FOLDER='{}' LLMT_FAULT_CALL={} LLMT_FAULT_KIND={} LLMT_FAULT_NAMELESS={} "
                  "LLMT_FAULT_FIRED='{}' {}",
                  LLMT_FAULT_SHIM, at.folder.file("out"), call, fault.kind, fault.nameless ? "yes" : "no", marker,
                  at.job().command));
  fired = std::filesystem::exists(marker);
  return outcome;
}

bool names_a_reason(const std::string& message) {
  for (const char* reason : {"No space left on device", "Input/output error", "Operation not permitted",
                             "Disk quota exceeded", "Permission denied"}) {
    if (message.find(reason) != std::string::npos) return true;
  }
  return false;
}

// Lets every call fail. Returns how many there were.
int fail_every_call(JobFolder& at, bool nameless) {
  at.learn_new_content();
  constexpr int many = 100;
  for (int call = 1; call < many; ++call) {
    bool fired = false;
    const program::Outcome outcome = run_with({"fail", nameless}, call, at, fired);
    const int written = at.count_new_files();
    if (!fired) {
      EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
      EXPECT_EQ(written, std::ssize(at.job().files));
      return call - 1;
    }
    if (outcome.exit_code == 0) {  // a folder that is not closed well loses nothing
      EXPECT_EQ(written, std::ssize(at.job().files)) << "call " << call;
      continue;
    }
    EXPECT_EQ(outcome.exit_code, 1) << "call " << call;
    EXPECT_TRUE(names_a_reason(outcome.err)) << "call " << call << ": " << outcome.err;
  }
  ADD_FAILURE() << "the job makes more than " << many << " calls";
  return many;
}

TEST(FailingCalls, LeaveAModelOldOrNew) {
  for (const bool nameless : {true, false}) {
    JobFolder at(faults::fit_job());
    at.write_tables();
    EXPECT_GE(fail_every_call(at, nameless), 6) << nameless;  // open, write, fsync, close, rename, fsync of the folder
  }
}

TEST(FailingCalls, LeaveATableOldOrNew) {
  JobFolder at({LLMT_PROGRAM " predict m.json d.csv -o out/p.csv", {"p.csv"}});
  at.write_tables();
  ASSERT_EQ(at.folder.run(LLMT_PROGRAM " fit d.csv --target y --cv 0 -o m.json").exit_code, 0);
  EXPECT_GE(fail_every_call(at, true), 6);
}

#ifdef LLMT_ROBOT_PROGRAM
TEST(FailingCalls, LeaveADescriptionAndItsCorrectionOldOrNew) {
  JobFolder at({LLMT_ROBOT_PROGRAM " calibrate robot.yaml measured.csv --correct --folds 0 -o out/c.yaml",
                {"c.yaml", "c.correction.json"}});
  at.folder.write("robot.yaml", llmt::read_file(LLMT_ROBOTS "/tx200_like.yaml"));
  ASSERT_EQ(
      at.folder.run(LLMT_ROBOT_PROGRAM " simulate robot.yaml --poses 150 --noise-um 10 -o measured.csv").exit_code, 0);
  EXPECT_GE(fail_every_call(at, true), 12);
}
#endif

// The handler of the programs removes a file that has a name for the moment.
TEST(Signals, AtEveryCallLeaveTheOldFileOrTheNewOne) {
  for (const bool nameless : {true, false}) {
    JobFolder at(faults::fit_job());
    at.write_tables();
    at.learn_new_content();
    for (const int signal : {SIGINT, SIGTERM, SIGHUP}) {
      bool fired = true;
      for (int call = 1; fired; ++call) {
        const program::Outcome outcome = run_with({fmt::format("{}", signal), nameless}, call, at, fired);
        at.count_new_files();
        EXPECT_EQ(outcome.exit_code, fired ? 128 + signal : 0) << "call " << call << ": " << outcome.err;
      }
    }
  }
}

#else
TEST(FailingCalls, LeaveAModelOldOrNew) { GTEST_SKIP() << "a sanitizer is on, and the shim cannot be preloaded"; }
#endif

}  // namespace
