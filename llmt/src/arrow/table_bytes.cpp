#include "arrow/table_bytes.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <unistd.h>

#include <atomic>
#include <cerrno>
#include <cstring>
#include <limits>
#include <stdexcept>
#include <utility>

namespace llmt {
namespace {

// Files with a name that tables hold open.
std::atomic<std::int64_t> held_files = 0;

// Half of the files that this process may have open; the others are for what else it does.
std::int64_t most_held_files() {
  rlimit limit = {};
  if (::getrlimit(RLIMIT_NOFILE, &limit) != 0 || limit.rlim_cur == RLIM_INFINITY) {
    return std::numeric_limits<std::int64_t>::max();
  }
  return static_cast<std::int64_t>(limit.rlim_cur / 2);
}

struct stat status_of(const TableBytes& bytes, const Descriptor& file) {
  struct stat status = {};
  if (!file.is_open() || ::fstat(file.number(), &status) != 0) {
    bytes.fail(fmt::format("cannot be read: {}", std::strerror(errno)));
  }
  return status;
}

}  // namespace

TableBytes::TableBytes(const std::string& path) : name_(path), path_(std::filesystem::absolute(path)), file_(open()) {
  const struct stat status = status_of(*this, file_);
  if (!S_ISREG(status.st_mode)) fail("is no regular file");
  size_ = status.st_size;
  device_ = status.st_dev;
  inode_ = status.st_ino;
}

TableBytes::TableBytes(std::string name, Descriptor file) : name_(std::move(name)), file_(std::move(file)) {
  size_ = status_of(*this, file_).st_size;
}

TableBytes::TableBytes(TableBytes&& other) noexcept
    : name_(std::move(other.name_)),
      path_(std::move(other.path_)),
      file_(std::move(other.file_)),
      is_counted_(std::exchange(other.is_counted_, false)),
      size_(other.size_),
      device_(other.device_),
      inode_(other.inode_) {}

TableBytes::~TableBytes() {
  if (is_counted_) --held_files;
}

void TableBytes::fail(const std::string& why) const { throw std::runtime_error(fmt::format("{}: {}", name_, why)); }

Descriptor TableBytes::open() const { return Descriptor(::open(path_.c_str(), O_RDONLY | O_CLOEXEC | O_NOCTTY)); }

void TableBytes::release_if_many() {
  if (path_.empty() || is_counted_) return;
  is_counted_ = ++held_files <= most_held_files();
  if (is_counted_) return;
  --held_files;
  file_ = Descriptor();
}

std::string TableBytes::read(std::int64_t at, std::int64_t count) const {
  if (at < 0 || count < 0 || at > size_ || count > size_ - at) fail("a part lies outside of the file; it is cut off");
  Descriptor again;
  if (!file_.is_open()) {
    again = open();
    const struct stat status = status_of(*this, again);
    if (status.st_dev != device_ || status.st_ino != inode_) fail("was replaced while it was read");
  }
  const int number = file_.is_open() ? file_.number() : again.number();
  std::string bytes(static_cast<std::size_t>(count), '\0');
  for (std::int64_t done = 0; done < count;) {
    const ssize_t got = ::pread(number, bytes.data() + done, static_cast<std::size_t>(count - done), at + done);
    if (got < 0 && errno == EINTR) continue;
    if (got < 0) fail(fmt::format("cannot be read: {}", std::strerror(errno)));
    if (got == 0) fail("became shorter while it was read");
    done += got;
  }
  return bytes;
}

}  // namespace llmt
