// The commands that the documents show, with what they print. In a block of kind `console` a line that begins with "$ "
// is a command of one of our programs, and what follows up to the next one is its output on both streams. A line "..."
// stands for any number of lines.
#include <fmt/format.h>

#include <filesystem>
#include <sstream>
#include <vector>

#include "apps/program.hpp"

namespace {

struct Command {
  std::string text;
  std::vector<std::string> expected;
};

std::vector<std::string> lines_of(const std::string& text) {
  std::vector<std::string> lines;
  std::istringstream stream(text);
  for (std::string line; std::getline(stream, line);) lines.push_back(line);
  return lines;
}

// The blocks of a document, each with its commands.
std::vector<std::vector<Command>> blocks_of(const std::string& document) {
  std::vector<std::vector<Command>> blocks;
  bool inside = false;
  for (const std::string& line : lines_of(document)) {
    if (line.starts_with("```")) {
      inside = line == "```console";
      if (inside) blocks.emplace_back();
    } else if (inside && line.starts_with("$ ")) {
      blocks.back().push_back({line.substr(2), {}});
    } else if (inside && !blocks.back().empty()) {
      blocks.back().back().expected.push_back(line);
    }
  }
  return blocks;
}

// Whether the lines are those expected, where "..." stands for any.
bool agree(const std::vector<std::string>& lines, std::size_t line, const std::vector<std::string>& expected,
           std::size_t at) {
  if (at == expected.size()) return line == lines.size();
  if (expected[at] != "...") {
    return line < lines.size() && lines[line] == expected[at] && agree(lines, line + 1, expected, at + 1);
  }
  for (std::size_t next = line; next <= lines.size(); ++next) {
    if (agree(lines, next, expected, at + 1)) return true;
  }
  return false;
}

// The program's path in place of its name.
std::string runnable(const std::string& command) {
  for (const auto& [name, path] : {std::pair{"llmt-robot ", LLMT_ROBOT_PROGRAM}, std::pair{"llmt ", LLMT_PROGRAM}}) {
    if (command.starts_with(name)) return std::string(path) + " " + command.substr(std::string(name).size());
  }
  ADD_FAILURE() << "a command of neither program: " << command;
  return "false";
}

class Documents : public testing::TestWithParam<const char*> {};

TEST_P(Documents, ShowWhatTheCommandsPrint) {
  const program::Folder folder;
  std::filesystem::create_directory_symlink(LLMT_ROOT "/docs", folder.file("docs"));
  int commands = 0;
  for (const std::vector<Command>& block : blocks_of(llmt::read_file(std::string(LLMT_ROOT "/") + GetParam()))) {
    for (const Command& command : block) {
      const program::Outcome outcome = folder.run(runnable(command.text) + " 2>&1");
      EXPECT_EQ(outcome.exit_code, 0) << command.text << "\n" << outcome.out;
      EXPECT_TRUE(agree(lines_of(outcome.out), 0, command.expected, 0)) << command.text << " prints\n" << outcome.out;
      ++commands;
    }
  }
  EXPECT_GT(commands, 0);
}

INSTANTIATE_TEST_SUITE_P(All, Documents,
                         testing::Values("README.md", "docs/dynamics.md", "docs/regression.md", "docs/robots.md"),
                         [](const auto& name) {
                           std::string text(name.param);
                           for (char& c : text) c = std::isalnum(static_cast<unsigned char>(c)) != 0 ? c : '_';
                           return text;
                         });

TEST(DocumentLines, DifferWhereALineDoes) {
  EXPECT_TRUE(agree({"a", "b", "c"}, 0, {"a", "...", "c"}, 0));
  EXPECT_TRUE(agree({"a", "c"}, 0, {"a", "...", "c"}, 0));
  EXPECT_FALSE(agree({"a", "b"}, 0, {"a", "...", "c"}, 0));
  EXPECT_FALSE(agree({"a", "b"}, 0, {"a"}, 0));
}

}  // namespace
