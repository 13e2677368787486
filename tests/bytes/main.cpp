// The witness of bytes: `bytes_witness check|renew MANIFEST FOLDER [PART...]`.
//
// check makes the results of the parts (all, if none is named) and compares them with the manifest's. A case is made at
// 1 or at 8 threads, in a study (study.hpp) at both. renew makes them at both and writes the manifest anew, with the
// fingerprint of this build.
#include <cstdio>
#include <filesystem>
#include <sstream>
#include <stdexcept>

#include "bytes/cases.hpp"
#include "llmt/files.hpp"
#include "study.hpp"

namespace bytes {
namespace {

const std::map<std::string, Part>& parts() {
  static const std::map<std::string, Part> all = {
      {"trees", witness_trees},     {"many_rows", witness_many_rows}, {"comparison", witness_comparison},
      {"streams", witness_streams},
#ifdef LLMT_PROGRAM
      {"llmt", witness_llmt},
#endif
#ifdef LLMT_ROBOT_PROGRAM
      {"robots", witness_robots},
#endif
  };
  return all;
}

std::string part_of(const std::string& name) { return name.substr(0, name.find('/')); }

Results make_results(const std::vector<std::string>& names, const std::string& folder, bool at_both_counts) {
  Results results;
  results.at_both_counts = at_both_counts;
  for (const std::string& name : names) {
    const auto part = parts().find(name);
    if (part == parts().end()) throw std::runtime_error("no part is called " + name);
    const std::filesystem::path own = std::filesystem::path(folder) / name;
    std::filesystem::remove_all(own);
    std::filesystem::create_directories(own);
    part->second(own.string(), results);
  }
  return results;
}

Results read_manifest(const std::string& path, const std::vector<std::string>& names) {
  Results results;
  std::istringstream text(llmt::read_file(path));
  for (std::string line; std::getline(text, line);) {
    const std::size_t blank = line.find(' ');
    const std::string name = line.substr(0, blank);
    for (const std::string& part : names) {
      if (part_of(name) == part) results[name] = line.substr(blank + 1);
    }
  }
  return results;
}

// Prints the cases that differ and returns their number.
int report_differences(const Results& expected, const Results& got) {
  Results names = expected;
  names.insert(got.begin(), got.end());
  int differences = 0;
  for (const auto& [name, unused] : names) {
    const auto text_in = [&key = name](const Results& results) {
      const auto found = results.find(key);
      return found == results.end() ? std::string("no such case") : found->second;
    };
    if (text_in(expected) == text_in(got)) continue;
    ++differences;
    std::printf("%s\n  expected %s\n  got      %s\n", name.c_str(), text_in(expected).c_str(), text_in(got).c_str());
  }
  return differences;
}

void write_manifest(const std::string& path, const Results& results) {
  std::string text = "fingerprint " LLMT_FINGERPRINT "\n";
  text += "# Written by the target renew_bytes, see CONTRIBUTING.md. A line: the case, and hashes of what it leaves.\n";
  for (const auto& [name, result] : results) text += name + " " + result + "\n";
  llmt::write_file(path, text);
}

int run(const std::vector<std::string>& arguments) {
  if (arguments.size() < 3) throw std::runtime_error("usage: bytes_witness check|renew MANIFEST FOLDER [PART...]");
  std::vector<std::string> names(arguments.begin() + 3, arguments.end());
  if (names.empty()) {
    for (const auto& [name, unused] : parts()) names.push_back(name);
  }
  const bool is_renewal = arguments[0] == "renew";
  const Results got = make_results(names, arguments[2], is_renewal || sampled(true, false));
  if (is_renewal) {
    write_manifest(arguments[1], got);
    std::printf("%zu cases written to %s\n", got.size(), arguments[1].c_str());
    return 0;
  }
  const int differences = report_differences(read_manifest(arguments[1], names), got);
  std::printf("%zu cases, %d differ\n", got.size(), differences);
  if (differences > 0) {
    std::printf("If the change is meant: build the target renew_bytes and commit the manifest, see CONTRIBUTING.md.\n");
  }
  return differences > 0 ? 1 : 0;
}

}  // namespace
}  // namespace bytes

int main(int argc, char** argv) {
  try {
    return bytes::run({argv + 1, argv + argc});
  } catch (const std::exception& error) {
    std::fprintf(stderr, "bytes_witness: %s\n", error.what());
    return 2;
  }
}
