/// \file
/// The bytes of an Arrow file, read by number of byte.
#pragma once

#include <sys/types.h>

#include <cstdint>
#include <filesystem>
#include <string>

#include "base/descriptor.hpp"

namespace llmt {

/// A regular file, open for reading. Several threads may read.
class TableBytes {
 public:
  /// Throws std::runtime_error `path: ...` if it cannot be read.
  explicit TableBytes(const std::string& path);
  /// A file without a name. `name`: for errors.
  TableBytes(std::string name, Descriptor file);
  ~TableBytes();
  TableBytes(TableBytes&& other) noexcept;
  TableBytes& operator=(TableBytes&&) = delete;

  const std::string& name() const { return name_; }
  std::int64_t size() const { return size_; }

  std::string read(std::int64_t at, std::int64_t count) const;
  [[noreturn]] void fail(const std::string& why) const;

  /// Closes a file that has a name if the tables of this process hold half of the files that it may have open: it is
  /// then opened whenever it is read, and must still be the same file.
  void release_if_many();

 private:
  Descriptor open() const;

  std::string name_;
  std::filesystem::path path_;  // empty: the file has no name, or none that is needed
  Descriptor file_;
  bool is_counted_ = false;
  std::int64_t size_ = 0;
  dev_t device_ = 0;
  ino_t inode_ = 0;
};

}  // namespace llmt
