#include "shared/child_process.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <poll.h>
#include <signal.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <atomic>
#include <cerrno>
#include <chrono>
#include <cstring>
#include <stdexcept>

extern char** environ;

namespace llmt::apps {
namespace {

using Clock = std::chrono::steady_clock;

std::atomic<pid_t> running_group = 0;
static_assert(std::atomic<pid_t>::is_always_lock_free);

[[noreturn]] void fail(const char* what, int error) {
  throw std::runtime_error(fmt::format("{}: {}", what, std::strerror(error)));
}

// A pipe whose ends are closed in programs that are started, unless they are passed on.
class Pipe {
 public:
  Pipe() {
    if (::pipe2(ends_.data(), O_CLOEXEC) != 0) fail("no pipe for a child", errno);
  }
  ~Pipe() {
    close(0);
    close(1);
  }
  Pipe(const Pipe&) = delete;
  Pipe& operator=(const Pipe&) = delete;

  int end(int which) const { return ends_[which]; }
  void close(int which) {
    if (ends_[which] >= 0) ::close(ends_[which]);
    ends_[which] = -1;
  }
  void do_not_wait(int which) { ::fcntl(ends_[which], F_SETFL, ::fcntl(ends_[which], F_GETFL) | O_NONBLOCK); }

 private:
  std::array<int, 2> ends_ = {-1, -1};
};

// A child that reads no further must not end this program.
class WithoutPipeSignal {
 public:
  WithoutPipeSignal() {
    struct sigaction ignore = {};
    ignore.sa_handler = SIG_IGN;
    ::sigaction(SIGPIPE, &ignore, &before_);
  }
  ~WithoutPipeSignal() { ::sigaction(SIGPIPE, &before_, nullptr); }
  WithoutPipeSignal(const WithoutPipeSignal&) = delete;
  WithoutPipeSignal& operator=(const WithoutPipeSignal&) = delete;

 private:
  struct sigaction before_ = {};
};

pid_t spawn(const std::string& command, const Pipe& in, const Pipe& out, const Pipe& err) {
  posix_spawn_file_actions_t actions;
  posix_spawnattr_t attributes;
  ::posix_spawn_file_actions_init(&actions);
  ::posix_spawnattr_init(&attributes);
  ::posix_spawn_file_actions_adddup2(&actions, in.end(0), 0);
  ::posix_spawn_file_actions_adddup2(&actions, out.end(1), 1);
  ::posix_spawn_file_actions_adddup2(&actions, err.end(1), 2);
  sigset_t defaults;
  ::sigemptyset(&defaults);
  ::sigaddset(&defaults, SIGPIPE);
  ::posix_spawnattr_setsigdefault(&attributes, &defaults);
  ::posix_spawnattr_setpgroup(&attributes, 0);
  ::posix_spawnattr_setflags(&attributes, POSIX_SPAWN_SETPGROUP | POSIX_SPAWN_SETSIGDEF);
  std::string shell = "sh";
  std::string option = "-c";
  std::string text = command;
  std::array<char*, 4> arguments = {shell.data(), option.data(), text.data(), nullptr};
  pid_t child = 0;
  const int error = ::posix_spawn(&child, "/bin/sh", &actions, &attributes, arguments.data(), environ);
  ::posix_spawn_file_actions_destroy(&actions);
  ::posix_spawnattr_destroy(&attributes);
  if (error != 0) fail("/bin/sh cannot be started", error);
  return child;
}

// Appends what can be read now; false at the end of the file.
bool read_some(int file, std::string& text) {
  std::array<char, 65536> buffer;
  const ssize_t got = ::read(file, buffer.data(), buffer.size());
  if (got > 0) text.append(buffer.data(), static_cast<std::size_t>(got));
  return got > 0 || (got < 0 && (errno == EAGAIN || errno == EINTR));
}

// True if the child has ended. It is left to be waited for, so that no other process gets its number.
bool is_over(pid_t child) {
  siginfo_t info = {};
  return ::waitid(P_PID, static_cast<id_t>(child), &info, WEXITED | WNOHANG | WNOWAIT) == 0 && info.si_pid == child;
}

void keep_last(std::string& text) {
  constexpr std::size_t most = 4000;
  if (text.size() > 2 * most) text.erase(0, text.size() - most);
}

}  // namespace

ChildOutcome run_child(const std::string& command, std::string_view input, double seconds) {
  const WithoutPipeSignal guard;
  Pipe in;
  Pipe out;
  Pipe err;
  const pid_t child = spawn(command, in, out, err);
  running_group = child;
  in.close(0);
  out.close(1);
  err.close(1);
  in.do_not_wait(1);
  out.do_not_wait(0);
  err.do_not_wait(0);
  const Clock::time_point begin = Clock::now();
  ChildOutcome outcome;
  std::size_t written = 0;
  bool has_ended = false;
  if (input.empty()) in.close(1);
  // Whatever inherited the outputs may keep them open for longer than the child lives.
  while (true) {
    std::array<pollfd, 3> files = {pollfd{in.end(1), POLLOUT, 0}, {out.end(0), POLLIN, 0}, {err.end(0), POLLIN, 0}};
    constexpr int milliseconds = 50;
    const int ready = ::poll(files.data(), files.size(), milliseconds);
    if (ready < 0 && errno != EINTR) break;
    if (ready > 0 && files[0].revents != 0) {
      const ssize_t done = ::write(in.end(1), input.data() + written, input.size() - written);
      if (done > 0) written += static_cast<std::size_t>(done);
      if (written == input.size() || (done < 0 && errno != EAGAIN && errno != EINTR)) in.close(1);
    }
    if (ready > 0 && files[1].revents != 0 && !read_some(out.end(0), outcome.out)) out.close(0);
    if (ready > 0 && files[2].revents != 0 && !read_some(err.end(0), outcome.err)) err.close(0);
    keep_last(outcome.err);
    outcome.overflowed = outcome.out.size() > longest_output;
    // The child had ended before poll() found nothing, so all that it wrote has been read.
    if (has_ended && files[1].revents == 0 && files[2].revents == 0) break;
    has_ended = has_ended || is_over(child);
    // In doubles: the clock's own durations end after 292 years.
    outcome.timed_out = std::chrono::duration<double>(Clock::now() - begin).count() > seconds && !has_ended;
    if (outcome.timed_out || outcome.overflowed) break;
  }
  ::kill(-child, SIGKILL);
  int status = 0;
  while (::waitpid(child, &status, 0) < 0 && errno == EINTR) {
  }
  running_group = 0;
  outcome.exit_code = WIFEXITED(status) ? WEXITSTATUS(status) : -1;
  outcome.signal = WIFSIGNALED(status) ? WTERMSIG(status) : 0;
  return outcome;
}

void kill_running_child() noexcept {
  const pid_t group = running_group;
  if (group > 0) ::kill(-group, SIGKILL);
}

}  // namespace llmt::apps
