#include "base/staged_file.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/stat.h>

#include <array>
#include <atomic>
#include <cerrno>
#include <climits>
#include <cstdio>
#include <cstring>
#include <random>
#include <stdexcept>

namespace llmt {
namespace {

// The name of a temporary file. A signal handler reads these: no lock, no memory of the heap.
struct Announcement {
  std::atomic<bool> taken = false;
  std::atomic<bool> readable = false;
  std::array<char, PATH_MAX> path = {};
};
std::array<Announcement, 16> announcements;
static_assert(std::atomic<bool>::is_always_lock_free);

// Announces a path. Its place in the list; -1 if there is none left, and then it is not announced.
int announced(const std::string& path) {
  if (path.size() >= PATH_MAX) return -1;
  for (std::size_t place = 0; place < announcements.size(); ++place) {
    Announcement& entry = announcements[place];
    if (entry.taken.exchange(true)) continue;
    std::memcpy(entry.path.data(), path.c_str(), path.size() + 1);
    entry.readable = true;
    return static_cast<int>(place);
  }
  return -1;
}

void forget(int place) {
  announcements[place].readable = false;
  announcements[place].taken = false;
}

// Short, so that it fits wherever the name of the target fits.
std::string unforeseeable_name() {
  constexpr std::string_view letters = "abcdefghijklmnopqrstuvwxyz234567";
  std::random_device random;
  std::string name = ".llmt-";
  for (int i = 0; i < 16; ++i) {
    name += letters[random() % letters.size()];
  }
  return name + ".tmp";
}

// The name under which an open file can be linked.
std::string link_source(const Descriptor& file) { return fmt::format("/proc/self/fd/{}", file.number()); }

// A file without a name, which is gone with the process, however that ends. Not open where the file system has none.
Descriptor open_nameless(const std::filesystem::path& folder, mode_t mode) {
#ifdef O_TMPFILE
  Descriptor file(::open(folder.c_str(), O_TMPFILE | O_RDWR | O_CLOEXEC, mode));
  if (file.is_open() && ::access(link_source(file).c_str(), F_OK) == 0) return file;
  if (!file.is_open()) return file;
#endif
  errno = EOPNOTSUPP;
  return Descriptor();
}

// File systems without nameless files answer with one of these errors; any other one is final.
bool has_no_nameless(int error) { return error == EOPNOTSUPP || error == EISDIR || error == EINVAL || error == ENOSYS; }

bool synchronise(const Descriptor& file) {
  return ::fsync(file.number()) == 0 || errno == EINVAL || errno == ENOTSUP;  // the last two: nothing to do there
}

}  // namespace

bool write_all(const Descriptor& file, std::string_view text) {
  while (!text.empty()) {
    const ssize_t written = ::write(file.number(), text.data(), text.size());
    if (written < 0 && errno == EINTR) continue;
    if (written < 0) return false;
    text.remove_prefix(written);
  }
  return true;
}

TemporaryName::TemporaryName(const std::filesystem::path& folder) : path_(folder / unforeseeable_name()) {}

TemporaryName::~TemporaryName() {
  if (is_made_) ::unlink(path());
  if (place_ >= 0) forget(place_);
}

void TemporaryName::announce() { place_ = announced(path_.string()); }

void TemporaryName::remove_announced() noexcept {
  for (const Announcement& entry : announcements) {
    if (entry.readable) ::unlink(entry.path.data());
  }
}

Descriptor temporary_file(const std::filesystem::path& folder) {
  constexpr mode_t mode = 0600;
  Descriptor file = open_nameless(folder, mode);
  if (file.is_open() || !has_no_nameless(errno)) return file;
  TemporaryName name(folder);  // removes the name again
  name.announce();
  file = Descriptor(::open(name.path(), O_CREAT | O_EXCL | O_NOFOLLOW | O_RDWR | O_CLOEXEC, mode));
  name.set_made(file.is_open());
  return file;
}

StagedFile::StagedFile(std::string name, std::filesystem::path target)
    : name_(std::move(name)),
      target_(std::move(target)),
      folder_(target_.has_parent_path() ? target_.parent_path() : "."),
      temporary_(folder_) {
  struct stat old = {};
  const bool replaces = ::stat(target_.c_str(), &old) == 0;
  const mode_t mode = replaces ? old.st_mode & 0777 : 0666;
  open(mode);
  struct stat made = {};
  check(::fstat(file_.number(), &made) == 0);
  if (replaces && (made.st_mode & 0777) != mode) {  // the umask took some
    check(::fchmod(file_.number(), mode) == 0);
  }
}

void StagedFile::fail(const char* reason) const {
  throw std::runtime_error(fmt::format("{}: cannot be written: {}", name_, reason));
}

void StagedFile::check(bool done) {
  if (done) return;
  has_failed_ = true;
  fail(std::strerror(errno));
}

void StagedFile::open(mode_t mode) {
  file_ = open_nameless(folder_, mode);
  if (file_.is_open()) return;
  check(has_no_nameless(errno));
  temporary_.announce();
  file_ = Descriptor(::open(temporary_.path(), O_CREAT | O_EXCL | O_NOFOLLOW | O_WRONLY | O_CLOEXEC, mode));
  check(file_.is_open());
  temporary_.set_made(true);
}

void StagedFile::write(std::string_view text) { check(write_all(file_, text)); }

void StagedFile::give_name() {
  if (temporary_.is_made()) return;
  temporary_.announce();
  check(::linkat(AT_FDCWD, link_source(file_).c_str(), AT_FDCWD, temporary_.path(), AT_SYMLINK_FOLLOW) == 0);
  temporary_.set_made(true);
}

void StagedFile::finish() {
  if (has_failed_) fail("a part of it could not be written");
  check(synchronise(file_));
  give_name();  // a link cannot take the place of a file, a renamed file can
  check(file_.close());
}

void StagedFile::replace_target() {
  check(std::rename(temporary_.path(), target_.c_str()) == 0);
  temporary_.set_made(false);
}

void StagedFile::make_durable() const {
  const Descriptor folder(::open(folder_.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC));
  if (!folder.is_open() && errno == EACCES) return;  // a folder that may be written to and not read
  if (!folder.is_open() || !synchronise(folder)) {
    throw std::runtime_error(
        fmt::format("{}: is written, but a power failure may still undo that: its folder cannot be synchronised: {}",
                    name_, std::strerror(errno)));
  }
}

}  // namespace llmt
