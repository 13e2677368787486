#include "bytes/program_runs.hpp"

#include <sys/wait.h>

#include <cstdlib>
#include <filesystem>
#include <regex>

#include "bytes/hash.hpp"
#include "llmt/files.hpp"

namespace bytes {
namespace {

// Members that are times. A regular expression, for the rest must stay byte by byte.
std::string without_times(const std::string& json) {
  static const std::regex times("\"[a-z_]*seconds(_per_million_rows)?\": *[-+.0-9e]+");
  return std::regex_replace(json, times, "\"seconds\": 0");
}

// Nor may the version and the day of a record count.
std::string without_origin(const std::string& text) {
  static const std::regex origin("\"?(program|date)\"?: \"?(llmt-robot [0-9.]+|[0-9]{4}-[0-9]{2}-[0-9]{2})");
  return std::regex_replace(text, origin, "$1");
}

// Every string that is not the name of a member becomes "".
std::string without_words(const std::string& json) {
  std::string kept;
  for (std::size_t begin = 0; begin < json.size();) {
    if (json[begin] != '"') {
      kept += json[begin++];
      continue;
    }
    std::size_t end = begin + 1;
    while (end < json.size() && json[end] != '"') end += json[end] == '\\' ? 2 : 1;
    ++end;
    const bool is_name = end < json.size() && json[end] == ':';
    kept += is_name ? json.substr(begin, end - begin) : "\"\"";
    begin = end;
  }
  return kept;
}

}  // namespace

std::string run_and_hash(const std::string& folder, const std::string& command, const std::vector<std::string>& files) {
  const std::filesystem::path path(folder);
  for (const std::string& file : files) std::filesystem::remove(path / file);
  const int status =
      std::system(("cd '" + folder + "' && " + command + " >stdout.txt 2>stderr.txt </dev/null").c_str());
  const int exit_code = WIFEXITED(status) ? WEXITSTATUS(status) : -1;
  std::string text = "exit:" + std::to_string(exit_code);
  const std::string json = without_origin(without_times(llmt::read_file((path / "stdout.txt").string())));
  if (json.empty()) return text;
  text += " json:" + hash_of(json) + " numbers:" + hash_of(without_words(json));
  for (const std::string& file : files) {
    const bool written = std::filesystem::exists(path / file);
    text += " " + file + ":" + (written ? hash_of(without_origin(llmt::read_file((path / file).string()))) : "none");
  }
  return text;
}

}  // namespace bytes
