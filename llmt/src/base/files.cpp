#include "llmt/files.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/stat.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <filesystem>
#include <memory>
#include <stdexcept>
#include <system_error>
#include <vector>

#include "base/descriptor.hpp"
#include "base/staged_file.hpp"
#include "llmt/limits.hpp"

namespace llmt {
namespace {

[[noreturn]] void fail(const std::string& path, const char* what, const std::string& reason) {
  throw std::runtime_error(fmt::format("{}: cannot be {}: {}", path, what, reason));
}

[[noreturn]] void fail(const std::string& path, const char* what, int error) {
  fail(path, what, std::string(std::strerror(error)));
}

// "16 MiB", "7.8 GiB".
std::string size_text(std::uintmax_t bytes) {
  constexpr double kibi = 1024.0;
  double size = static_cast<double>(bytes);
  const char* unit = "bytes";
  for (const char* larger : {"KiB", "MiB", "GiB"}) {
    if (size < kibi) break;
    size /= kibi;
    unit = larger;
  }
  return fmt::format("{:.3g} {}", size, unit);
}

// Counts what has been read against the limit.
class Meter {
 public:
  Meter(const std::string& path, const FileLimit& limit) : path_(path), limit_(limit) {}

  void add(std::string_view piece) {
    bytes_ += piece.size();
    if (bytes_ > limit_.bytes) fail_size();
    // Pieces are far shorter than a line may be: only the line that began before the piece may be too long.
    if (line_bytes_ + std::min(piece.find('\n'), piece.size()) > limit_.line_bytes) {
      fail(path_, "read", fmt::format("no line ends within {}", size_text(limit_.line_bytes)));
    }
    const std::size_t last_break = piece.rfind('\n');
    line_bytes_ = last_break == std::string_view::npos ? line_bytes_ + piece.size() : piece.size() - last_break - 1;
  }
  [[noreturn]] void fail_size() const {
    fail(path_, "read", fmt::format("it holds more than {}, the most that is read", size_text(limit_.bytes)));
  }

 private:
  const std::string& path_;
  const FileLimit& limit_;
  std::uintmax_t bytes_ = 0;
  std::uintmax_t line_bytes_ = 0;
};

// The file that a link, or a chain of links, leads to, whether it is there or not.
std::filesystem::path end_of_links(const std::string& path) {
  std::filesystem::path target = path;
  std::error_code error;
  for (int links = 0; std::filesystem::is_symlink(target, error); ++links) {
    if (links == most(Limit::symbolic_links)) fail(path, "written", ELOOP);
    const std::filesystem::path next = std::filesystem::read_symlink(target, error);
    if (error) fail(path, "written", error.message());
    target = target.parent_path() / next;
  }
  return target;
}

// A device, a pipe, a folder.
bool is_special(const std::string& path) {
  std::error_code unknown;
  const std::filesystem::file_status there = std::filesystem::status(path, unknown);
  return std::filesystem::exists(there) && !std::filesystem::is_regular_file(there);
}

void write_directly(const std::string& path, const std::function<void(const TextSink&)>& produce) {
  Descriptor file(::open(path.c_str(), O_WRONLY | O_TRUNC | O_CLOEXEC | O_NOCTTY));
  if (!file.is_open()) fail(path, "written", errno);
  produce([&](std::string_view piece) {
    if (!write_all(file, piece)) fail(path, "written", errno);
  });
  if (!file.close()) fail(path, "written", errno);
}

}  // namespace

std::string read_file(const std::string& path, const FileLimit& limit) {
  const Descriptor file(::open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NOCTTY));
  struct stat status = {};
  if (!file.is_open() || ::fstat(file.number(), &status) != 0) fail(path, "read", errno);
  if (S_ISDIR(status.st_mode)) fail(path, "read", std::string("it is a folder"));
  Meter meter(path, limit);
  std::string content;
  if (S_ISREG(status.st_mode) && status.st_size > 0) {
    const auto size = static_cast<std::uintmax_t>(status.st_size);
    if (size > limit.bytes) meter.fail_size();
    content.reserve(size);  // a table may take half of the memory: no second copy while it grows
  }
  constexpr std::size_t piece = 1 << 18;
  const auto buffer = std::make_unique_for_overwrite<char[]>(piece);
  for (;;) {
    const ssize_t count = ::read(file.number(), buffer.get(), piece);
    if (count == 0) return content;
    if (count < 0 && errno == EINTR) continue;
    if (count < 0) fail(path, "read", errno);
    const std::string_view text(buffer.get(), count);
    meter.add(text);
    content.append(text);
  }
}

void write_file(const std::string& path, std::string_view content) {
  write_file(path, [&](const TextSink& sink) { sink(content); });
}

void write_files(std::span<const NewFile> files) {
  std::vector<std::unique_ptr<StagedFile>> staged;
  for (const NewFile& file : files) {
    if (is_special(file.path)) continue;
    staged.push_back(std::make_unique<StagedFile>(file.path, end_of_links(file.path)));
    staged.back()->write(file.content);
    staged.back()->finish();
  }
  for (const NewFile& file : files) {
    if (is_special(file.path)) write_file(file.path, file.content);
  }
  for (const auto& file : staged) file->replace_target();
  for (const auto& file : staged) file->make_durable();
}

void write_file(const std::string& path, const std::function<void(const TextSink&)>& produce) {
  if (is_special(path)) {
    write_directly(path, produce);
    return;
  }
  StagedFile file(path, end_of_links(path));
  produce([&](std::string_view piece) { file.write(piece); });
  file.finish();
  file.replace_target();
  file.make_durable();
}

void discard_unfinished_files() noexcept { TemporaryName::remove_announced(); }

}  // namespace llmt
