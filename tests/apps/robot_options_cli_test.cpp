// What the command line of llmt-robot refuses before any work.
#include <fmt/format.h>

#include <filesystem>

#include "apps/programs.hpp"

namespace {

using program::Folder;
using program::Outcome;
using program::robot_program;

const std::string arm = LLMT_ROBOTS "/tx200_like.yaml";

void expect_robot_usage(const Folder& folder, const std::string& arguments, const std::string& message) {
  const Outcome outcome = folder.run(robot_program + " " + arguments);
  EXPECT_EQ(outcome.exit_code, 2) << arguments << ": " << outcome.err;
  EXPECT_EQ(outcome.err, "llmt-robot: " + message + "\n") << arguments;
}

TEST(RobotOptions, NumbersOutsideTheirRangeAreRefusedWithIt) {
  const Folder folder;
  const auto refused = [&](const std::string& command, const std::string& option, const std::string& value,
                           const std::string& range) {
    expect_robot_usage(folder, fmt::format("{} {} {}", command, option, value),
                       fmt::format("{} is \"{}\", it must be {}", option, value, range));
  };
  const std::string seed = "a whole number from 0 to 18446744073709551615";
  refused("discover r.yaml d.csv", "--held-out", "nan", "a number from 0 to 0.9");
  refused("discover r.yaml d.csv", "--mass-uncertainty", "nan", "a number from 0 to 1");
  refused("discover r.yaml d.csv", "--folds", "1", "a whole number from 2 to 100");
  refused("discover r.yaml d.csv", "--seed", "-1", seed);
  refused("calibrate r.yaml d.csv", "--seed", "99999999999999999999", seed);
  refused("calibrate r.yaml d.csv", "--folds", "-1", "a whole number from 0 to 2147483647");
  refused("calibrate r.yaml d.csv", "--threads", "-1", "a whole number from 0 to 4096");
  refused("simulate r.yaml", "--noise-um", "nan", "a finite number, 0 or more");
  refused("simulate r.yaml", "--noise-um", "-1", "a finite number, 0 or more");
  refused("simulate r.yaml", "--poses", "1000000000", "a whole number from 1 to 1000000");
  refused("paper", "--seeds", "0", "a whole number from 1 to 2147483647");
  refused("paper", "--seed", "-1", seed);
}

TEST(RobotOptions, AnOutputThatIsAnInputIsRefusedBeforeTheWork) {
  const Folder folder;
  const std::string description = llmt::read_file(arm);
  folder.write("r.yaml", description);
  ASSERT_EQ(folder.run(robot_program + " simulate r.yaml --poses 150 --noise-um 10 -o d.csv").exit_code, 0);
  std::filesystem::create_symlink("r.yaml", folder.file("link.yaml"));
  const auto lost = [&](const std::string& arguments, const std::string& output, const std::string& input) {
    expect_robot_usage(folder, arguments,
                       output + ": would be overwritten, and is an input of this command (" + input +
                           "); give the output a name of its own");
  };
  lost("simulate r.yaml -o r.yaml", "r.yaml", "r.yaml");
  lost("simulate r.yaml --poses-from d.csv -o d.csv", "d.csv", "d.csv");
  lost("calibrate r.yaml d.csv -o link.yaml", "link.yaml", "r.yaml");
  lost("calibrate r.yaml d.csv --test r.yaml -o d.csv", "d.csv", "d.csv");
  lost("discover r.yaml d.csv -o r.yaml", "r.yaml", "r.yaml");
  EXPECT_EQ(llmt::read_file(folder.file("r.yaml")), description);

  // The correction that the description names is an input too.
  ASSERT_EQ(folder.run(robot_program + " calibrate r.yaml d.csv --correct --folds 0 -o c.yaml").exit_code, 0);
  ASSERT_TRUE(std::filesystem::exists(folder.file("c.correction.json")));
  std::filesystem::copy(folder.file("c.yaml"), folder.file("c2.yaml"));
  lost("simulate c2.yaml -o c.correction.json", "c.correction.json", "c.correction.json");
  lost("calibrate c2.yaml d.csv -o c.yaml", "c.correction.json", "c.correction.json");
}

TEST(RobotOptions, TwoOutputsOfOneNameAreRefusedBeforeTheWork) {
  const Folder folder;
  folder.write("r.yaml", llmt::read_file(arm));
  folder.write("m.yaml", "{}");
  folder.write("d.csv", "q1_deg\n0\n");
  const auto twice = [&](const std::string& arguments, const std::string& output, const std::string& options) {
    expect_robot_usage(
        folder, arguments,
        fmt::format("{}: would be written twice by this command ({}); give each output a name of its own", output,
                    options));
  };
  twice("calibrate r.yaml d.csv -o z.svg --plot z.svg", "z.svg", "--output and --plot");
  twice("discover r.yaml d.csv -o z.svg --plot ./z.svg", "z.svg", "--output and --plot");
  twice("mechanism r.yaml d.csv -o s --errors s", "s", "--errors and --output");
  // The description of an arm stands beside its URDF.
  expect_robot_usage(folder, "calibrate a.urdf d.csv --columns m.yaml -o m.urdf",
                     "m.yaml: would be overwritten, and is an input of this command (m.yaml); give the output a name "
                     "of its own");
  EXPECT_EQ(llmt::read_file(folder.file("m.yaml")), "{}");
}

TEST(RobotOptions, AMessageThatCannotBeWrittenChangesNoExitCode) {
  const Folder folder;
  folder.write("r.yaml", llmt::read_file(arm));
  for (const std::string arguments : {"simulate r.yaml --poses 3 -o s.csv", "mechanism r.yaml s.csv", "predict r.yaml",
                                      "check r.yaml no.csv", "simulate no.urdf"}) {
    const int expected = folder.run(robot_program + " " + arguments).exit_code;
    EXPECT_EQ(folder.run(robot_program + " " + arguments + " 2>&-").exit_code, expected) << arguments;
    EXPECT_EQ(folder.run(robot_program + " " + arguments + " 2>/dev/full").exit_code, expected) << arguments;
  }
}

TEST(RobotOptions, WhatIsWrongIsSaidWithItsFileOrOption) {
  const Folder folder;
  folder.write("r.yaml", llmt::read_file(arm));
  const auto says = [&](const std::string& arguments, int exit_code, const std::string& message) {
    const Outcome outcome = folder.run(robot_program + " " + arguments);
    EXPECT_EQ(outcome.exit_code, exit_code) << arguments;
    EXPECT_NE(outcome.err.find(message), std::string::npos) << arguments << ": " << outcome.err;
  };
  says("demo -o /proc/x", 1, "/proc/x: the folder cannot be made: ");
  says("simulate r.yaml --poses 3 -o -", 2, "-: is no name of an output; /dev/stdout is standard output");
  folder.write("m.yaml", "mechanism: m\njoints: []\n");
  says("simulate m.yaml", 1, "m.yaml:1: this is a mechanism and no arm: llmt-robot mechanism reads it");
  folder.write("zero.yaml", std::string("name: a\nx: ") + '\0' + "\n");
  says("simulate zero.yaml", 1, "zero.yaml:2: a byte is 0");
  folder.write("f.yaml",
               llmt::read_file(arm) +
                   "effects:\n  - {type: formula, at: joint1, name: u, terms: [{joint: \"sin(q1)\", name: s}], "
                   "coefficients: [1e-4]}\n");
  says("export --c f.yaml -o f.c", 1, "f.yaml: effect ");
  ASSERT_EQ(folder.run(robot_program + " simulate r.yaml --poses 60 -o d.csv").exit_code, 0);
  says("calibrate r.yaml d.csv --prior joint2.a=1e-300", 2,
       "--prior joint2.a is \"1e-300\", it must be a finite number, 1e-9 or more (mm or deg); --fix holds a parameter");
  says("calibrate r.yaml d.csv --folds 1", 2, "--folds is \"1\", it must be 0, or a whole number, 2 or more");
}

TEST(RobotOptions, EndlessDescriptionsAreRefused) {
  const Folder folder;
  const Outcome outcome = folder.run(robot_program + " simulate /dev/zero");
  EXPECT_EQ(outcome.exit_code, 1);
  EXPECT_EQ(outcome.err, "llmt-robot: /dev/zero: cannot be read: it holds more than 16 MiB, the most that is read\n");
  const Outcome version = folder.run(robot_program + " --version");
  EXPECT_EQ(version.exit_code, 0);
  EXPECT_EQ(version.out, "llmt-robot " LLMT_VERSION "\n");
}

}  // namespace
