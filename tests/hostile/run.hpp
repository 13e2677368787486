// Runs a program on an input of unknown origin, within the time and memory that the threat model promises.
#pragma once

#include <string>
#include <vector>

namespace hostile {

struct Limits {
  double seconds = 5.0;
  double mebibytes = 1024.0;  ///< of address space; 0: none
};

struct Outcome {
  int exit_code = -1;  ///< -1: a signal, or the end of the time
  int signal = 0;
  bool is_late = false;
  double seconds = 0.0;
  double mebibytes = 0.0;  ///< resident, the peak
  std::string out;
  std::string err;
};

Outcome run(const std::vector<std::string>& command, const Limits& limits);

/// Counts what it prints: a line per case with its state.
class List {
 public:
  /// Runs the command. It is well if the program ends by itself in time, with exit code 0 to 2, and a refusal names
  /// `file`.
  Outcome ask(const std::string& name, const std::vector<std::string>& command, const std::string& file);
  /// A case that a caller has judged.
  void judge(const std::string& name, const Outcome& outcome, const std::string& fault);

  int bad() const { return bad_; }
  int cases() const { return cases_; }

 private:
  int cases_ = 0;
  int bad_ = 0;
};

void write(const std::string& path, const std::string& text);
std::string read(const std::string& path);

}  // namespace hostile
