#include "shared/standard_error.hpp"

#include <fcntl.h>
#include <pthread.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <csignal>
#include <ctime>

namespace llmt::apps {

void write_stderr(std::string_view text) {
  // SIGPIPE comes to the thread that writes. It is held back, and taken from the thread before it is let through again.
  sigset_t pipe_signal;
  sigset_t before;
  ::sigemptyset(&pipe_signal);
  ::sigaddset(&pipe_signal, SIGPIPE);
  ::pthread_sigmask(SIG_BLOCK, &pipe_signal, &before);
  bool is_broken = false;
  while (!text.empty()) {
    const ssize_t written = ::write(STDERR_FILENO, text.data(), text.size());
    if (written < 0 && errno == EINTR) continue;
    if (written <= 0) {
      is_broken = errno == EPIPE;
      break;
    }
    text.remove_prefix(written);
  }
  constexpr timespec now = {};
  if (is_broken) ::sigtimedwait(&pipe_signal, nullptr, &now);
  ::pthread_sigmask(SIG_SETMASK, &before, nullptr);
}

void occupy_closed_standard_files() {
  struct Place {
    int number;
    const char* device;
    int mode;
  };
  // Input and output are opened in the wrong direction, so that they fail. /dev/full takes nothing even if /dev/stdout
  // is opened anew.
  constexpr std::array<Place, 3> places = {{{STDIN_FILENO, "/dev/null", O_WRONLY},
                                            {STDOUT_FILENO, "/dev/full", O_RDONLY},
                                            {STDERR_FILENO, "/dev/null", O_WRONLY}}};
  for (const Place& place : places) {
    if (::fcntl(place.number, F_GETFD) != -1 || errno != EBADF) continue;
    ::open(place.device, place.mode | O_NOCTTY);  // takes the lowest free number, which is this one
  }
}

}  // namespace llmt::apps
