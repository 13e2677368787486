#include "hostile/run.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <chrono>
#include <csignal>
#include <cstdio>

#include "llmt/files.hpp"

namespace hostile {
namespace {

constexpr const char* out_file = "hostile.out";
constexpr const char* err_file = "hostile.err";

void redirect(const char* path, int number) {
  const int file = ::open(path, O_WRONLY | O_CREAT | O_TRUNC, 0644);
  ::dup2(file, number);
}

[[noreturn]] void become(std::vector<char*> arguments, const Limits& limits) {
  if (limits.mebibytes > 0.0) {
    const auto bytes = static_cast<rlim_t>(limits.mebibytes * 1048576.0);
    const rlimit space{bytes, bytes};
    ::setrlimit(RLIMIT_AS, &space);
  }
  const rlimit none{0, 0};
  ::setrlimit(RLIMIT_CORE, &none);
  ::dup2(::open("/dev/null", O_RDONLY), STDIN_FILENO);
  redirect(out_file, STDOUT_FILENO);
  redirect(err_file, STDERR_FILENO);
  ::execv(arguments.front(), arguments.data());
  ::_exit(127);
}

// One line of at most 100 bytes.
std::string first_line(const std::string& text) { return text.substr(0, std::min<std::size_t>(text.find('\n'), 100)); }

}  // namespace

Outcome run(const std::vector<std::string>& command, const Limits& limits) {
  using Clock = std::chrono::steady_clock;
  std::vector<std::string> texts = command;
  std::vector<char*> arguments;
  for (std::string& text : texts) arguments.push_back(text.data());
  arguments.push_back(nullptr);
  const Clock::time_point begin = Clock::now();
  const pid_t child = ::fork();
  if (child == 0) become(arguments, limits);
  Outcome outcome;
  int status = 0;
  rusage usage = {};
  while (::wait4(child, &status, WNOHANG, &usage) == 0) {
    ::usleep(2000);
    if (std::chrono::duration<double>(Clock::now() - begin).count() < limits.seconds || outcome.is_late) continue;
    outcome.is_late = true;
    ::kill(child, SIGKILL);
  }
  outcome.seconds = std::chrono::duration<double>(Clock::now() - begin).count();
  outcome.mebibytes = static_cast<double>(usage.ru_maxrss) / 1024.0;
  outcome.exit_code = WIFEXITED(status) ? WEXITSTATUS(status) : -1;
  outcome.signal = WIFSIGNALED(status) ? WTERMSIG(status) : 0;
  outcome.out = read(out_file);
  outcome.err = read(err_file);
  return outcome;
}

Outcome List::ask(const std::string& name, const std::vector<std::string>& command, const std::string& file) {
  const Outcome outcome = run(command, {});
  const bool is_named = outcome.exit_code == 0 || outcome.err.find(file) != std::string::npos;
  judge(name, outcome, is_named ? "" : "the file is not named");
  return outcome;
}

void List::judge(const std::string& name, const Outcome& outcome, const std::string& fault) {
  const std::string state = outcome.is_late                                  ? "TOO LATE"
                            : outcome.signal != 0                            ? fmt::format("SIGNAL {}", outcome.signal)
                            : outcome.exit_code < 0 || outcome.exit_code > 2 ? fmt::format("EXIT {}", outcome.exit_code)
                            : !fault.empty()                                 ? "WRONG: " + fault
                            : outcome.exit_code == 0                         ? "taken"
                                                                             : "refused";
  ++cases_;
  if (state != "taken" && state != "refused") ++bad_;
  fmt::print("{:<8} {:6.2f} s {:5.0f} MiB  {:<48} {}\n", state, outcome.seconds, outcome.mebibytes, name,
             first_line(outcome.err));
  std::fflush(stdout);
}

void write(const std::string& path, const std::string& text) { llmt::write_file(path, text); }

std::string read(const std::string& path) { return llmt::read_file(path); }

}  // namespace hostile
