// The cases of the test of bytes: each gives one line of the manifest.
#pragma once

#include <functional>
#include <map>
#include <string>
#include <vector>

namespace bytes {

/// What is known of a case: a few words `what:hash`. Names of cases begin with their part: "trees/rd/crisp".
struct Results : std::map<std::string, std::string> {
  /// Each case is made at 1 and at 8 threads; otherwise at one of the two, in turns. What is not the same at both then
  /// differs from the manifest, whose cases were made at both.
  bool at_both_counts = true;
};

/// Makes all results of one part. `folder` is empty and belongs to the part.
using Part = std::function<void(const std::string& folder, Results& results)>;

void witness_trees(const std::string& folder, Results& results);
void witness_many_rows(const std::string& folder, Results& results);
void witness_comparison(const std::string& folder, Results& results);
void witness_streams(const std::string& folder, Results& results);
void witness_llmt(const std::string& folder, Results& results);
void witness_robots(const std::string& folder, Results& results);

/// Adds the result that `make` gives for 1 and for 8 threads, or for one of them. Where the two differ, both stand in
/// the result, so that it equals no line of the manifest. "refused" if `make` throws std::invalid_argument.
void add_for_threads(Results& results, const std::string& name, const std::function<std::string(int threads)>& make);

}  // namespace bytes
