// Places that cannot take the file: a full disk, a full device, a read-only folder, a limit on the size of files.
#include <sys/mount.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>

#include "faults/job.hpp"

namespace {

using faults::JobFolder;

// The job fails with a reason, and the old file stays.
void expect_refusal(const JobFolder& at, const program::Outcome& outcome, const std::string& reason) {
  EXPECT_EQ(outcome.exit_code, 1) << outcome.err;
  EXPECT_NE(outcome.err.find("out/m.json: cannot be written: " + reason), std::string::npos) << outcome.err;
  EXPECT_EQ(at.count_new_files(), 0);
}

TEST(Places, AFullDiskKeepsTheOldFile) {
  JobFolder at(faults::fit_job());
  at.write_tables();
  at.learn_new_content();
  const std::string out = at.folder.file("out");
  std::filesystem::remove(at.out("m.json"));
  if (::mount("none", out.c_str(), "tmpfs", 0, "size=8k") != 0) {
    GTEST_SKIP() << "nothing can be mounted here: " << std::strerror(errno);
  }
  llmt::write_file(at.out("m.json"), JobFolder::old_content);
  std::filesystem::permissions(at.out("m.json"), std::filesystem::perms{JobFolder::old_mode});
  expect_refusal(at, at.folder.run(at.job().command), "No space left on device");
  EXPECT_EQ(::umount(out.c_str()), 0);
}

TEST(Places, AFullDeviceIsSaid) {
  JobFolder at({LLMT_PROGRAM " fit d.csv --target y --cv 0 -o /dev/full", {}});
  at.write_tables();
  const program::Outcome outcome = at.folder.run(at.job().command);
  EXPECT_EQ(outcome.exit_code, 1);
  EXPECT_NE(outcome.err.find("/dev/full: cannot be written: No space left on device"), std::string::npos)
      << outcome.err;
}

TEST(Places, AReadOnlyFolderKeepsTheOldFile) {
  if (::geteuid() == 0) GTEST_SKIP() << "root may write to any folder";
  JobFolder at(faults::fit_job());
  at.write_tables();
  at.learn_new_content();
  at.put_old_files();
  const std::filesystem::path out = at.folder.file("out");
  std::filesystem::permissions(out, std::filesystem::perms{0555});
  const program::Outcome outcome = at.folder.run(at.job().command);
  expect_refusal(at, outcome, "Permission denied");
  std::filesystem::permissions(out, std::filesystem::perms{0755});
}

TEST(Places, ALimitOnTheSizeOfFilesKeepsTheOldFile) {
  JobFolder at(faults::fit_job());
  at.write_tables();
  at.learn_new_content();
  at.put_old_files();
  expect_refusal(at, at.folder.run("ulimit -f 1; " + at.job().command), "File too large");
}

}  // namespace
