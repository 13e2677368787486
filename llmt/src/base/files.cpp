#include "llmt/files.hpp"

#include <fmt/format.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <memory>
#include <stdexcept>
#include <system_error>

namespace llmt {
namespace {

[[noreturn]] void fail(const std::string& path, const char* what, const std::string& reason) {
  throw std::runtime_error(fmt::format("{}: cannot be {}: {}", path, what, reason));
}

using Produce = std::function<void(const TextSink&)>;

// Writes all that `produce` passes on; on failure returns the reason.
std::string try_write(const std::string& path, const Produce& produce) {
  errno = 0;
  std::ofstream file(path, std::ios::binary | std::ios::trunc);
  if (file) {
    produce([&](std::string_view piece) { file.write(piece.data(), static_cast<std::streamsize>(piece.size())); });
  }
  file.close();
  return file ? std::string{} : std::string(std::strerror(errno != 0 ? errno : EIO));
}

}  // namespace

std::string read_file(const std::string& path) {
  if (std::filesystem::is_directory(path)) {
    fail(path, "read", "it is a folder");
  }
  std::error_code ignored;
  const std::uintmax_t size = std::filesystem::file_size(path, ignored);
  errno = 0;
  std::ifstream file(path, std::ios::binary);
  std::string content;
  if (const bool known = std::filesystem::is_regular_file(path, ignored); file && known) {
    content.reserve(size);  // a table may take half of the memory: no second copy while it grows
  }
  constexpr std::streamsize piece = 1 << 18;
  const auto buffer = std::make_unique_for_overwrite<char[]>(piece);
  while (file.read(buffer.get(), piece) || file.gcount() > 0) {
    content.append(buffer.get(), file.gcount());
  }
  if (!file.is_open() || file.bad()) {
    fail(path, "read", std::strerror(errno != 0 ? errno : EIO));
  }
  return content;
}

void write_file(const std::string& path, std::string_view content) {
  write_file(path, [&](const TextSink& sink) { sink(content); });
}

void write_file(const std::string& path, const Produce& produce) {
  std::error_code ignored;
  // A link stays a link: the file it points to is replaced.
  const std::filesystem::path target = std::filesystem::is_symlink(path, ignored)
                                           ? std::filesystem::weakly_canonical(path)
                                           : std::filesystem::path(path);
  if (std::filesystem::exists(target, ignored) && !std::filesystem::is_regular_file(target, ignored)) {
    const std::string reason = try_write(path, produce);
    if (!reason.empty()) {
      fail(path, "written", reason);
    }
    return;
  }
  const std::string temporary = fmt::format("{}.{}.tmp", target.string(), ::getpid());
  std::string reason;
  try {
    reason = try_write(temporary, produce);
  } catch (...) {
    std::filesystem::remove(temporary, ignored);
    throw;
  }
  if (reason.empty()) {
    std::error_code error;
    std::filesystem::rename(temporary, target, error);
    reason = error ? error.message() : std::string{};
  }
  if (!reason.empty()) {
    std::filesystem::remove(temporary, ignored);
    fail(path, "written", reason);
  }
}

}  // namespace llmt
