// What the command line of llmt refuses before any work, and what it prints about itself.
#include <fmt/format.h>
#include <unistd.h>

#include <filesystem>

#include "apps/programs.hpp"
#include "llmt/random.hpp"

namespace {

using program::Folder;
using program::llmt_program;
using program::Outcome;

std::string line(int rows) {
  llmt::Random random(1);
  std::string text = "x,y\n";
  for (int i = 0; i < rows; ++i) text += fmt::format("{},{}\n", i, 2 * i + random.normal());
  return text;
}

void expect_usage(const Folder& folder, const std::string& arguments, const std::string& message) {
  const Outcome outcome = folder.run(llmt_program + " " + arguments);
  EXPECT_EQ(outcome.exit_code, 2) << arguments << ": " << outcome.err;
  EXPECT_EQ(outcome.out, "") << arguments;
  EXPECT_EQ(outcome.err, "llmt: " + message + "\n") << arguments;
}

TEST(Options, NumbersOutsideTheirRangeAreRefusedWithIt) {
  const Folder folder;
  folder.write("d.csv", line(30));
  ASSERT_EQ(folder.run(llmt_program + " fit d.csv -t y -o m.json").exit_code, 0);
  const auto refused = [&](const std::string& command, const std::string& option, const std::string& value,
                           const std::string& range) {
    expect_usage(folder, fmt::format("{} {} {}", command, option, value),
                 fmt::format("{} is \"{}\", it must be {}", option, value, range));
  };
  for (const char* value : {"nan", "0", "1", "900", "1e400", "0.9x"}) {
    refused("predict m.json d.csv", "--interval", value, "a number from 0.01 to 0.9999");
  }
  refused("predict m.json d.csv", "--interval", "90", "a number from 0.01 to 0.9999; 90 % is 0.9");
  for (const char* value : {"-1", "99999999999999999999", "1.5", "nan", "0x10", "+-1"}) {
    refused("fit d.csv -t y", "--seed", value, "a whole number from 0 to 18446744073709551615");
  }
  for (const char* value : {"700", "nan", "-0.1"}) {
    refused("fit d.csv -t y", "--significance", value, "a number from 0 to 1");
  }
  refused("fit d.csv -t y", "--significance", "7", "a number from 0 to 1; 7 % is 0.07");
  refused("fit d.csv -t y", "--cv", "-1", "a whole number from 0 to 2147483647");
  refused("fit d.csv -t y", "--cv", "4294967297", "a whole number from 0 to 2147483647");
  refused("fit d.csv -t y", "--max-leaves", "-1", "a whole number, 0 or more");
  refused("fit d.csv -t y", "--max-leaves", "six", "a whole number, 0 or more");
  refused("fit d.csv -t y", "--min-leaf", "99999999999999999999", "a whole number from 0 to 9223372036854775807");
  refused("fit d.csv -t y", "--threads", "-1", "a whole number from 0 to 4096");
  refused("fit d.csv -t y", "--width", "0", "a finite number above 0");
  refused("fit d.csv -t y", "--width", "nan", "a finite number above 0");
  refused("fit d.csv -t y", "--ridge", "inf", "a finite number, 0 or more");
  refused("fit d.csv -t y", "--shrinkage", "-1", "a finite number, 0 or more");
  refused("fit d.csv -t y", "--jump", "nan", "a number of 0 or more, or inf");
  refused("explain m.json d.csv", "--row", "0", "a whole number, 1 or more");
  refused("discover d.csv d.csv --target y", "--held-out", "nan", "a number from 0 to 0.9");
  refused("compare d.csv -t y", "--seed", "-1", "a whole number from 0 to 18446744073709551615");
  expect_usage(folder, "fit d.csv -t y --width 1,two", "--width is \"two\", it must be a finite number above 0");
}

TEST(Options, NumbersAtTheEndsOfTheirRangeAreTaken) {
  const Folder folder;
  folder.write("d.csv", line(30));
  const Outcome outcome = folder.run(llmt_program +
                                     " fit d.csv -t y --seed 18446744073709551615 --significance 1 --cv 2 --jump inf,1 "
                                     "--ridge 0 --width +0.5");
  EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
}

TEST(Options, AnOutputThatIsAnInputIsRefusedBeforeTheWork) {
  const Folder folder;
  const std::string data = line(30);
  folder.write("d.csv", data);
  ASSERT_EQ(folder.run(llmt_program + " fit d.csv -t y -o m.json").exit_code, 0);
  const std::string model = llmt::read_file(folder.file("m.json"));
  std::filesystem::create_symlink("d.csv", folder.file("link.csv"));
  std::filesystem::create_hard_link(folder.file("d.csv"), folder.file("hard.csv"));
  const auto lost = [&](const std::string& arguments, const std::string& output, const std::string& input) {
    expect_usage(folder, arguments,
                 output + ": would be overwritten, and is an input of this command (" + input +
                     "); give the output a name of its own");
  };
  lost("fit d.csv -t y -o d.csv", "d.csv", "d.csv");
  lost("fit -o ./d.csv -t y d.csv", "./d.csv", "d.csv");
  lost("fit d.csv -t y -o link.csv", "link.csv", "d.csv");
  lost("fit hard.csv -t y --output d.csv", "d.csv", "hard.csv");
  lost("fit d.csv -t y --stream -o d.csv", "d.csv", "d.csv");
  lost("fit - -t y --stream -o d.csv <d.csv", "d.csv", "/dev/stdin");
  lost("predict m.json d.csv -o m.json", "m.json", "m.json");
  lost("predict m.json d.csv -o ../" + std::filesystem::path(folder.file(".")).parent_path().filename().string() +
           "/d.csv",
       "../" + std::filesystem::path(folder.file(".")).parent_path().filename().string() + "/d.csv", "d.csv");
  lost("discover d.csv hard.csv --target y -o d.csv", "d.csv", "d.csv");
  folder.write("t.txt", "twice = 2 * x\n");
  lost("discover d.csv hard.csv --target y --terms t.txt -o t.txt", "t.txt", "t.txt");
  EXPECT_EQ(llmt::read_file(folder.file("d.csv")), data);
  EXPECT_EQ(llmt::read_file(folder.file("m.json")), model);
  EXPECT_EQ(folder.run(llmt_program + " predict m.json d.csv -o /dev/null").exit_code, 0);
}

TEST(Options, TwoOutputsOfOneNameAreRefusedBeforeTheWork) {
  const Folder folder;
  folder.write("d.csv", line(30));
  std::filesystem::create_symlink("m.svg", folder.file("link.svg"));
  const auto refused = [&](const std::string& arguments, const std::string& name, const std::string& options) {
    expect_usage(folder, arguments,
                 fmt::format("{}: would be written twice by this command ({}); give each output a name of its own",
                             name, options));
  };
  refused("fit d.csv -t y -o m.svg --plot m.svg", "m.svg", "--output and --plot");
  refused("fit d.csv -t y -o ./m.svg --plot m.svg", "./m.svg", "--output and --plot");
  refused("fit d.csv -t y -o m.svg --plot link.svg", "m.svg", "--output and --plot");  // of a file that is not there
  refused("fit d.csv -t y -o m.svg --plot m.readable.json", "m.readable.json", "--output and --plot");
  EXPECT_FALSE(std::filesystem::exists(folder.file("m.svg")));
}

TEST(Program, AMessageThatCannotBeWrittenChangesNothing) {
  const Folder folder;
  folder.write("d.csv", line(30));
  ASSERT_EQ(folder.run(llmt_program + " fit d.csv -t y -o m.json").exit_code, 0);
  folder.write("far.csv", "x,y\n1000,0\n");
  for (const std::string arguments :
       {"fit d.csv -t y -o n.json --json", "predict m.json far.csv -o n.json", "fit no.csv -t y", "fit d.csv -t no",
        "fit d.csv --nonsense", "fit - -t y --stream -o n.json <d.csv", "explain m.json far.csv",
        "discover d.csv d.csv --target y"}) {
    const auto run = [&](const char* standard_error) {
      std::filesystem::remove(folder.file("n.json"));
      const Outcome outcome = folder.run(fmt::format("({} {}) {}", llmt_program, arguments, standard_error));
      const bool written = std::filesystem::exists(folder.file("n.json"));
      return std::tuple(outcome.exit_code, outcome.out, written ? llmt::read_file(folder.file("n.json")) : "");
    };
    const auto expected = run("2>/dev/null");
    EXPECT_EQ(run("2>&-"), expected) << arguments;
    EXPECT_EQ(run("2>/dev/full"), expected) << arguments;
  }
  // A pipe that nobody reads any more: its reader, true, has ended by then.
  const Outcome piped = folder.run("(sleep 0.2; " + llmt_program + " fit no.csv -t y; echo $? >code) 2>&1 | true");
  EXPECT_EQ(llmt::read_file(folder.file("code")), "1\n") << piped.err;
}

// The first file that a program opens gets the number of a standard file that is closed.
TEST(Program, AnOutputIsNoStandardErrorThatIsClosed) {
  const Folder folder;
  folder.write("d.csv", line(30));
  ASSERT_EQ(folder.run(llmt_program + " fit d.csv -t y -o m.json").exit_code, 0);
  EXPECT_EQ(folder.run(llmt_program + " predict m.json d.csv >&-").exit_code, 1);
  EXPECT_EQ(folder.run(llmt_program + " predict m.json d.csv -o /dev/stdout >&-").exit_code, 1);
  EXPECT_EQ(folder.run(llmt_program + " predict m.json - <&-").exit_code, 1);
}

TEST(Options, AnOutputWithoutAFolderIsRefusedBeforeTheWork) {
  const Folder folder;
  const auto refusal = [&](const std::string& output) {
    const Outcome outcome = folder.run(llmt_program + " fit /dev/zero -t y -o " + output);
    EXPECT_EQ(outcome.exit_code, 1);
    return outcome.err;
  };
  EXPECT_EQ(refusal("no/m.json"), "llmt: no/m.json: cannot be written: its folder does not exist\n");
  EXPECT_EQ(refusal("."), "llmt: .: cannot be written: it is a folder\n");
}

TEST(Program, SaysItsVersionAndWhenItCannotBeHeard) {
  const Folder folder;
  const Outcome version = folder.run(llmt_program + " --version");
  EXPECT_EQ(version.exit_code, 0);
  EXPECT_EQ(version.out, "llmt " LLMT_VERSION "\n");
  for (const char* arguments : {"--help", "--version", "fit --help"}) {
    const Outcome full = folder.run(fmt::format("{} {} >/dev/full", llmt_program, arguments));
    EXPECT_EQ(full.exit_code, 1) << arguments;
    EXPECT_EQ(full.err, "llmt: standard output: cannot be written\n") << arguments;
  }
}

TEST(Program, WritesNoControlCharacterOfAFile) {
  const Folder folder;
  std::string text = "\"\x1b]0;title\x07\",\"c\xC2\x9b\",y\n";
  for (int i = 0; i < 30; ++i) text += fmt::format("{},{},{}\n", i, i % 3, 2 * i);
  folder.write("d.csv", text);
  const Outcome fitted = folder.run(llmt_program + " fit d.csv -t y -o m.json");
  ASSERT_EQ(fitted.exit_code, 0) << fitted.err;
  for (const std::string& printed : {fitted.out, folder.run(llmt_program + " inspect m.json").out,
                                     folder.run(llmt_program + " fit d.csv -t z").err}) {
    EXPECT_EQ(printed.find_first_of("\x1b\x07"), std::string::npos) << printed;
    EXPECT_EQ(printed.find("\xC2\x9b"), std::string::npos) << printed;
    EXPECT_NE(printed.find("\\x1b]0;title\\x07"), std::string::npos) << printed;
  }
  // Data stay as they are where no terminal reads them.
  EXPECT_EQ(folder.run(llmt_program + " predict m.json d.csv").out.find("\"\x1b]0;title\x07\""), 0U);
}

TEST(Program, ShortensLongMessages) {
  const Folder folder;
  folder.write("s.csv", line(30));
  const Outcome outcome = folder.run(llmt_program + " fit s.csv --target " + std::string(50000, 'x'));
  EXPECT_EQ(outcome.exit_code, 1);
  EXPECT_LT(outcome.err.size(), 2200U);
  EXPECT_NE(outcome.err.find("xxx"), std::string::npos) << outcome.err;
  EXPECT_NE(outcome.err.find(" bytes) ... "), std::string::npos) << outcome.err;
}

}  // namespace
