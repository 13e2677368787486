// Runs the programs as a user would and takes the bytes that they leave behind.
#pragma once

#include <string>
#include <vector>

namespace bytes {

/// Runs `command` with a shell in `folder`. The result has its exit code, and where the program printed something:
/// - json: standard output, without the members whose names end with "seconds" or "seconds_per_million_rows";
/// - numbers: the same without the text of strings that are values, so that a message put in other words changes json
///   alone;
/// - the name of each of `files`: its content; "none" where the program did not write it.
std::string run_and_hash(const std::string& folder, const std::string& command, const std::vector<std::string>& files);

}  // namespace bytes
